"""Contact with geoms after a substep: the impulses that keep nodes and faces outside.

In a substep what touches is held by reactions (`tissue.forces.geom_reactions`). Then each
contact gets the change of its impulse that lets its point move no further into the geom, and
within Coulomb's cone not along it either. What rests is so in exact balance, what slides is braked
by the friction coefficient times the pressure, and no stiffness of contact is chosen or limits the
step. A point that is inside all the same is put onto the surface.

Where nodes belong to several contacts these are solved together, by Gauss and Seidel's method.

Sources: Belytschko, Liu and Moran (2000), Nonlinear finite elements for continua and structures,
section 10.4, for contact as a correction of explicit steps; Moreau (1988), Unilateral contact and
dry friction in finite freedom dynamics, for impacts and friction in terms of velocities.
"""

from typing import Final

from tissue.contact.geoms.geom_arrays import (
    NODE_CONTACT,
    GeomContacts,
    geom_motion_at,
    n_corners,
    place_geoms,
    to_geom,
    turned_from_geom,
)
from tissue.contact.geoms.signed_distance import distance_to
from tissue.core.array_types import FloatArray
from tissue.core.jit import kernel
from tissue.core.vec3 import Vec3, add, axpy, cross, dot, norm, scale, store, sub, vec3
from tissue.mesh.body import Body
from tissue.mesh.node_means import friction_of_row

_PUSH_OF_FACE: Final = 0.03
"""Share of its depth by which a face is put out of a geom in a substep; a node is so wholly. Faces
that meet under a sharp geom are pushed in different directions. Larger: each undoes what the others
did, which is work on the tissue, at 0.3 up to a fifth of that of a rod; smaller: what sank in as a
geom came suddenly stays in for longer than a few time steps."""

_SLIDING: Final = 1.0 - 1e-9
"""Share of the limit of friction above which a contact slides: the rest is rounding."""

SWEEPS: Final = 8
"""Sweeps over contacts that share nodes. Fewer: a face that is pressed between its nodes sinks in
by some percent of what it moves in a substep; more: time for nothing that shows, with 60 the work
of what is put out is the same."""


@kernel
def end_geom_substep(
    contacts: GeomContacts, body: Body, seconds: float, when: float, dt: float
) -> None:
    """Correct forces, velocities and positions after a substep.

    Args:
        contacts: Written.
        body: Velocities and positions are written.
        seconds: Length of the substep [s].
        when: Its end, as a fraction of the time step.
        dt: Length of the time step [s].
    """
    rows = range(contacts.first, contacts.first + contacts.n_contacts)
    place_geoms(contacts.geoms, when)
    for c in rows:
        store(contacts.force, c, scale(1.0 / seconds, vec3(contacts.pressed, c)))
        store(contacts.pressed, c, Vec3(0.0, 0.0, 0.0))
        _locate(contacts, body, c, seconds, dt)
    _note_resistances(contacts, body, seconds)
    n_sweeps = SWEEPS if contacts.are_coupled == 1 else 1
    # First positions: the velocities still show with which forces the tissue resists.
    for _ in range(n_sweeps):
        for c in rows:
            _push_out(contacts, body, c)
    for _ in range(n_sweeps):
        for c in rows:
            _correct_impulse(contacts, body, c, seconds, dt)
    for c in rows:
        _hold(contacts, body, c)
        note_velocities(contacts, body, c)


@kernel
def _locate(contacts: GeomContacts, body: Body, c: int, seconds: float, dt: float) -> None:
    """Find where contact `c` is, how far from the geom, and in which direction that pushes.

    A face is pushed along its own normal, as it was listed: at its deepest point, where the geom
    would touch it, that is the normal of the geom. Anywhere else a small ball would push a point
    aside, off which it then slides, and a box would, near an edge, out to the side.
    """
    point = weighted(contacts, c, body.positions)
    found = distance_to(contacts.geoms, contacts.geom[c], point)
    contacts.gap[c] = found.distance + contacts.slop[c]
    if contacts.face[c] == NODE_CONTACT:
        store(contacts.normal, c, found.normal)
    store(contacts.point, c, point)
    contacts.mobility[c] = 0.0
    force, motion = vec3(contacts.force, c), geom_motion_at(contacts.geoms, contacts.geom[c], point)
    relative = axpy(-1.0 / dt, motion, weighted(contacts, c, body.velocities))
    # Twice the path: contacts nearby may push the point there.
    if dot(force, force) > 0.0 or contacts.gap[c] <= 2.0 * seconds * norm(relative):
        note_mobility(contacts, body, c)


@kernel
def _note_resistances(contacts: GeomContacts, body: Body, seconds: float) -> None:
    """Record with which forces the rest of the tissue acted on the nodes of contacts.

    They give the work of the displacement after the last substep, too.
    """
    rows, resistance = (
        range(contacts.first, contacts.first + contacts.n_contacts),
        contacts.resistance,
    )
    for c in rows:
        for q in range(n_corners(contacts, c)):
            node = contacts.node[c, q]
            change = sub(vec3(body.velocities, node), vec3(contacts.velocity, node))
            store(resistance, node, scale(body.masses[node] / seconds, change))
    for c in rows:
        for q in range(n_corners(contacts, c)):
            node, weight = contacts.node[c, q], contacts.weight[c, q]
            held = axpy(-weight, vec3(contacts.force, c), vec3(resistance, node))
            store(resistance, node, held)
    for c in rows:
        for q in range(n_corners(contacts, c)):
            _correct_work(contacts, contacts.node[c, q])


@kernel
def _correct_work(contacts: GeomContacts, node: int) -> None:
    """Take the mean of the forces before and after for the work of a node's last displacement.

    With that before alone, a geom that is pressed hard between nodes took or gave up to 9 % of its
    work that no other term had; the trapezoidal rule leaves 0.9 %.
    """
    displacement = vec3(contacts.displacement, node)
    after = 0.5 * dot(vec3(contacts.resistance, node), displacement)
    contacts.dissipated += after - contacts.half_work[node]
    store(contacts.displacement, node, Vec3(0.0, 0.0, 0.0))
    contacts.half_work[node] = 0.0


@kernel
def _correct_impulse(contacts: GeomContacts, body: Body, c: int, seconds: float, dt: float) -> None:
    """Change the force of contact `c` so that its point does not move into the geom or along it."""
    mobility, gap = contacts.mobility[c], contacts.gap[c]
    before = vec3(contacts.force, c)
    if mobility == 0.0:
        return
    normal, x = vec3(contacts.normal, c), vec3(contacts.point, c)
    v = weighted(contacts, c, body.velocities)
    relative = axpy(-1.0 / dt, geom_motion_at(contacts.geoms, contacts.geom[c], x), v)
    approach = dot(normal, relative)
    per_force = seconds * mobility
    # What is not there yet may come as near in the next substep as it is now.
    most = max(gap, 0.0) / seconds
    press = max(dot(normal, before) - (approach + most) / per_force, 0.0)
    along = axpy(-approach, normal, relative)
    pull = axpy(-dot(normal, before), normal, before)
    pull = axpy(-1.0 / per_force, along, pull)
    limit, length = contacts.friction[c] * press, norm(pull)
    if length > limit:
        pull = scale(limit / length, pull)
    now = axpy(press, normal, pull)
    store(contacts.force, c, now)
    change = scale(seconds, sub(now, before))
    push(contacts, c, change, x, axpy(0.5 * mobility, change, v), dt)
    add_to_nodes(contacts, c, change, body.velocities)


@kernel
def _push_out(contacts: GeomContacts, body: Body, c: int) -> None:
    """Put the point of contact `c` onto the surface, if it is inside."""
    mobility = contacts.mobility[c]
    if mobility == 0.0:
        return
    normal = vec3(contacts.normal, c)
    moved = sub(weighted(contacts, c, body.positions), vec3(contacts.point, c))
    gap = contacts.gap[c] + dot(normal, moved)
    if gap < 0.0:
        share = 1.0 if contacts.face[c] == NODE_CONTACT else _PUSH_OF_FACE
        _move(contacts, body, c, scale(-share * gap / mobility, normal))


@kernel
def _hold(contacts: GeomContacts, body: Body, c: int) -> None:
    """Take a point that sticks back to its anchor, and move the anchor of one that slides."""
    geoms, g, mobility = contacts.geoms, contacts.geom[c], contacts.mobility[c]
    force, normal = vec3(contacts.force, c), vec3(contacts.normal, c)
    x, press = weighted(contacts, c, body.positions), dot(force, normal)
    contacts.touches[c] = contacts.sticks[c] = 0
    if press <= 0.0 or mobility == 0.0:
        contacts.is_held[c] = 0
        return
    contacts.touches[c] = 1
    pull = norm(axpy(-press, normal, force))
    sticks = pull < _SLIDING * contacts.friction[c] * press
    contacts.sticks[c] = 1 if sticks else 0
    if sticks and contacts.is_held[c] == 1:
        anchor = turned_from_geom(geoms.axes, g, vec3(contacts.anchor, c))
        back = sub(add(vec3(geoms.origin, g), anchor), x)
        back = axpy(-dot(back, normal), normal, back)
        _move(contacts, body, c, scale(1.0 / mobility, back))
    else:
        contacts.is_held[c] = 1
        store(contacts.anchor, c, to_geom(geoms, g, x))


@kernel
def _move(contacts: GeomContacts, body: Body, c: int, by: Vec3) -> None:
    """Displace the nodes of contact `c` by a vector over their masses [kg m].

    The work is counted with the forces before. `_correct_work` adds that of the forces after.
    """
    for q in range(n_corners(contacts, c)):
        node, response = contacts.node[c, q], contacts.response[c, q]
        if response != 0.0:
            shift = scale(response, by)
            store(body.positions, node, add(vec3(body.positions, node), shift))
            store(contacts.displacement, node, add(vec3(contacts.displacement, node), shift))
            work = dot(vec3(contacts.resistance, node), shift)
            contacts.dissipated += work
            contacts.half_work[node] += 0.5 * work


@kernel
def friction_of(contacts: GeomContacts, body: Body, c: int) -> float:
    """Return the coefficient of friction of contact `c`."""
    of_geom: float = contacts.geoms.friction[contacts.geom[c]]
    if of_geom >= 0.0:
        return of_geom
    if body.materials.has_one_friction == 1:
        return body.materials.friction[0]  # type: ignore[no-any-return]
    return friction_of_row(body, contacts.node, contacts.weight, c)


@kernel
def weighted(contacts: GeomContacts, c: int, values: FloatArray) -> Vec3:
    """Return nodal values at the point of contact `c`."""
    node, weight = contacts.node, contacts.weight
    total = scale(weight[c, 0], vec3(values, node[c, 0]))
    for q in range(1, n_corners(contacts, c)):
        if weight[c, q] != 0.0:
            total = axpy(weight[c, q], vec3(values, node[c, q]), total)
    return total


@kernel
def note_mobility(contacts: GeomContacts, body: Body, c: int) -> None:
    """Write by how much an impulse changes the velocities of contact `c` and its nodes [1/kg]."""
    total = 0.0
    for q in range(n_corners(contacts, c)):
        node, weight = contacts.node[c, q], contacts.weight[c, q]
        contacts.response[c, q] = 0.0
        if not body.fixed[node]:
            total += weight * weight / body.masses[node]
            contacts.response[c, q] = weight / body.masses[node]
    contacts.mobility[c] = total


@kernel
def add_to_nodes(contacts: GeomContacts, c: int, change: Vec3, values: FloatArray) -> None:
    """Add what a change at the point of contact `c` does to its nodes, by weight and by mass.

    Args:
        contacts: Nodes, and how they respond; fixed nodes stay as they are.
        c: The contact.
        change: An impulse [N s], where `values` are velocities; a force [N], where they are
            accelerations.
        values: Written, shape (n_nodes, 3).
    """
    for q in range(n_corners(contacts, c)):
        node, response = contacts.node[c, q], contacts.response[c, q]
        if response != 0.0:
            store(values, node, axpy(response, change, vec3(values, node)))


@kernel
def note_velocities(contacts: GeomContacts, body: Body, c: int) -> None:
    """Record the velocities of the nodes of contact `c`."""
    for q in range(n_corners(contacts, c)):
        node = contacts.node[c, q]
        store(contacts.velocity, node, vec3(body.velocities, node))


@kernel
def clear_geom_forces(contacts: GeomContacts, external: FloatArray) -> None:
    """Set the forces on the nodes of all contacts to zero."""
    for c in range(contacts.first, contacts.first + contacts.n_contacts):
        for q in range(n_corners(contacts, c)):
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
