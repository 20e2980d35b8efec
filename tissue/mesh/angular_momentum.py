"""Angular momentum through splits of elements.

Masses stand at nodes. A split moves a share of the masses at the corners to the new node between
them: what these shares had of rotation about that node is lost. It is noted where it is lost, and
given back to the nodes of the changed tetrahedra as a rigid rotation, which has no momentum.
"""

from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import kernel
from tissue.core.vec3 import Vec3, add, cross, dot, scale, sub, vec3
from tissue.mesh.body import Body
from tissue.mesh.changes import Change

SLENDEREST = 1e-9
"""Determinant of the inertia of nodes over the cube of a third of its trace below which they count
as lying on a line, about which no rotation has an angular momentum: nothing is given back then."""


@kernel
def note_spin(change: Change, volume: float, arm: Vec3, motion: Vec3) -> None:
    """Add up the angular momentum that a corner of a tetrahedron no longer has.

    Args:
        change: Its `lost_spin` is written.
        volume: Volume at rest whose fourth the corner carried, times `relative_density`; negative
            for a new corner [m3].
        arm: From any point that is the same for all corners to the corner [m].
        motion: Velocity of the corner [m/s].
    """
    spin = scale(0.25 * volume, cross(arm, motion))
    change.lost_spin[0] += spin.x
    change.lost_spin[1] += spin.y
    change.lost_spin[2] += spin.z


@kernel
def return_spin(body: Body, change: Change, nodes: IntArray, n: int) -> None:
    """Turn the first `n` of `nodes` by what the last pass lost of angular momentum.

    Args:
        body: Velocities are written.
        change: What was lost, and is forgotten.
        nodes: The nodes of the changed tetrahedra, each once.
        n: How many these are.
    """
    density = body.materials.density[0]
    lost = scale(density, Vec3(change.lost_spin[0], change.lost_spin[1], change.lost_spin[2]))
    _forget(change.lost_spin)
    if dot(lost, lost) == 0.0:
        return
    centre = _centre(body, nodes, n)
    x, y, z = Vec3(0.0, 0.0, 0.0), Vec3(0.0, 0.0, 0.0), Vec3(0.0, 0.0, 0.0)
    for i in range(n):
        if not body.fixed[nodes[i]]:
            mass = _own_mass(body, nodes[i])
            r = sub(vec3(body.positions, nodes[i]), centre)
            squared = dot(r, r)
            x = add(x, scale(mass, Vec3(squared - r.x * r.x, -r.x * r.y, -r.x * r.z)))
            y = add(y, scale(mass, Vec3(-r.x * r.y, squared - r.y * r.y, -r.y * r.z)))
            z = add(z, scale(mass, Vec3(-r.x * r.z, -r.y * r.z, squared - r.z * r.z)))
    determinant = dot(x, cross(y, z))
    if determinant <= SLENDEREST * ((x.x + y.y + z.z) / 3.0) ** 3:
        return
    # By Cramer's rule; the inertia is symmetric, so its rows are its columns.
    turn = scale(
        1.0 / determinant,
        Vec3(dot(lost, cross(y, z)), dot(lost, cross(z, x)), dot(lost, cross(x, y))),
    )
    for i in range(n):
        node = nodes[i]
        if not body.fixed[node]:
            gained = cross(turn, sub(vec3(body.positions, node), centre))
            body.velocities[node, 0] += gained.x
            body.velocities[node, 1] += gained.y
            body.velocities[node, 2] += gained.z


@kernel
def _forget(spin: FloatArray) -> None:
    for c in range(3):
        spin[c] = 0.0


@kernel
def _own_mass(body: Body, node: int) -> float:
    """Return the mass of a node without what mass scaling added, whose momentum no one sees."""
    mass: float = body.masses[node] - body.added_masses[node]
    return mass


@kernel
def _centre(body: Body, nodes: IntArray, n: int) -> Vec3:
    """Return the centre of mass of those of the first `n` of `nodes` that can move [m]."""
    total, moment = 0.0, Vec3(0.0, 0.0, 0.0)
    for i in range(n):
        if not body.fixed[nodes[i]]:
            mass = _own_mass(body, nodes[i])
            total += mass
            moment = add(moment, scale(mass, vec3(body.positions, nodes[i])))
    return scale(1.0 / total, moment) if total > 0.0 else moment
