"""Impulses of contact with geoms: what they do to nodes, how they add up, and their work."""

from typing import Final

from tissue.contact.geoms.geom_arrays import GeomContacts
from tissue.contact.geoms.geom_motion import geom_motion_at
from tissue.core.array_types import FloatArray
from tissue.core.jit import kernel
from tissue.core.vec3 import Vec3, axpy, cross, dot, scale, store, vec3
from tissue.mesh.body import Body

SWEEPS: Final = 8
"""Sweeps over contacts that share nodes. Fewer: a face that is pressed between its nodes sinks in
by some percent of what it moves in a substep; more: time for nothing that shows, with 60 the work
of what is put out is the same."""


@kernel
def weighted(contacts: GeomContacts, c: int, values: FloatArray) -> Vec3:
    """Return nodal values at the point of contact `c`."""
    node, weight = contacts.node, contacts.weight
    total = scale(weight[c, 0], vec3(values, node[c, 0]))
    for q in range(1, 3):
        if weight[c, q] != 0.0:
            total = axpy(weight[c, q], vec3(values, node[c, q]), total)
    return total


@kernel
def mobility_at(contacts: GeomContacts, body: Body, c: int) -> float:
    """Return by how much an impulse changes the velocity of the point of contact `c` [1/kg]."""
    total = 0.0
    for q in range(3):
        node, weight = contacts.node[c, q], contacts.weight[c, q]
        if not body.fixed[node]:
            total += weight * weight / body.masses[node]
    return total


@kernel
def add_to_nodes(
    contacts: GeomContacts, body: Body, c: int, change: Vec3, values: FloatArray
) -> None:
    """Add what a change at the point of contact `c` does to its nodes, by weight and by mass.

    Args:
        contacts: Nodes and weights.
        body: Masses; fixed nodes stay as they are.
        c: The contact.
        change: An impulse [N s], where `values` are velocities; a force [N], where they are
            accelerations.
        values: Written, shape (n_nodes, 3).
    """
    for q in range(3):
        node, weight = contacts.node[c, q], contacts.weight[c, q]
        if weight != 0.0 and not body.fixed[node]:
            store(values, node, axpy(weight / body.masses[node], change, vec3(values, node)))


@kernel
def note_velocities(contacts: GeomContacts, body: Body, c: int) -> None:
    """Note the velocities of the nodes of contact `c`."""
    for q in range(3):
        node = contacts.node[c, q]
        store(contacts.velocity, node, vec3(body.velocities, node))


@kernel
def clear_geom_forces(contacts: GeomContacts, external: FloatArray) -> None:
    """Set the forces on the nodes of all contacts to zero."""
    for c in range(contacts.first, contacts.first + contacts.n_contacts):
        for q in range(3):
            store(external, contacts.node[c, q], Vec3(0.0, 0.0, 0.0))


@kernel
def push(contacts: GeomContacts, c: int, impulse: Vec3, x: Vec3, v: Vec3, dt: float) -> None:
    """Count an impulse of contact `c` on the tissue, and its works.

    Args:
        contacts: Impulses and works are written.
        c: The contact.
        impulse: On the tissue [N s].
        x: Where it acts [m].
        v: Velocity of the tissue there meanwhile [m/s].
        dt: Length of the time step [s].
    """
    store(contacts.impulse, c, axpy(1.0, impulse, vec3(contacts.impulse, c)))
    store(contacts.moment, c, axpy(1.0, cross(x, impulse), vec3(contacts.moment, c)))
    of_geom = dot(impulse, geom_motion_at(contacts.geoms, contacts.geom[c], x)) / dt
    contacts.work += of_geom
    contacts.dissipated += of_geom - dot(impulse, v)


@kernel
def sum_wrenches(
    contacts: GeomContacts,
    origins: FloatArray,
    per_second: float,
    forces: FloatArray,
    torques: FloatArray,
) -> None:
    """Add up the forces of the tissue on each geom in the time step.

    Args:
        contacts: Impulses on the tissue.
        origins: Where torques are about, for each geom [m], shape (n, 3).
        per_second: One over the length of the time step [1/s].
        forces: Written [N], shape (n, 3); zero before.
        torques: Written [N m], shape (n, 3); zero before.
    """
    for c in range(contacts.first, contacts.first + contacts.n_contacts):
        g = contacts.geom[c]
        store(forces, g, axpy(-per_second, vec3(contacts.impulse, c), vec3(forces, g)))
        store(torques, g, axpy(-per_second, vec3(contacts.moment, c), vec3(torques, g)))
    for g in range(len(forces)):
        store(torques, g, axpy(-1.0, cross(vec3(origins, g), vec3(forces, g)), vec3(torques, g)))
