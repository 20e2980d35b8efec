"""Couples: what keeps the force of a contact and its reaction from turning the body.

Where the two are not on one line (`line_of_action`), forces that turn the four nodes of the contact
as one rigid body take their torque. With the nodes at r_q from their centre of mass, and J their
tensor of inertia,

    c_q = m_q alpha x r_q        J alpha = -torque

Of all forces with that torque and without a resultant these have the least sum(|c_q|^2 / m_q), by
Gauss's principle of least constraint: what is left of the contact is what strains its nodes, and is
never more than it was: the stable step stays. They exist wherever the nodes are, and follow them
without a jump.

Source: Gauss (1829), Über ein neues allgemeines Grundgesetz der Mechanik.
"""

import numpy as np

from tissue.contact.penalty.eight_contacts import FourPoints
from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import kernel
from tissue.core.structs import Arrays, IntCell
from tissue.core.vec3 import Vec3, add, axpy, cross, dot, scale, store, sub, vec3

_FLAT = 1e-14
"""Pivot of a tensor of inertia, over its trace, below which the nodes are on one line and nothing
turns them about it. Larger: thin contacts keep a torque; smaller: it divides by rounding errors."""


class Couples(Arrays):
    """The couples of contacts, one row for each contact of `PenaltyForces`."""

    have_acted: IntCell
    """1 if a couple has acted since the last substep ended, else 0."""
    mass: FloatArray
    """Mass of each node of the contact [kg], shape (rows, 4)."""
    turn: FloatArray
    """Angular velocity that the couple has given the nodes since then [rad/s], shape (rows, 3)."""
    spin: FloatArray
    """Angular momentum of the nodes about their centre as it began to act [kg m2/s]; alike."""


def new_couples(rows: int) -> Couples:
    """Return no couples, for that many contacts."""
    return Couples(
        have_acted=0,
        mass=np.zeros((rows, 4)),
        turn=np.zeros((rows, 3)),
        spin=np.zeros((rows, 3)),
    )


@kernel
def add_couple(
    couples: Couples,
    nodes: IntArray,
    c: int,
    torque: Vec3,
    positions: FloatArray,
    velocities: FloatArray,
    seconds: float,
    external: FloatArray,
) -> None:
    """Add forces that take the torque of contact `c` to those on its nodes.

    Args:
        couples: Written.
        nodes: The nodes of the contacts, shape (rows, 4).
        c: The contact.
        torque: Torque of its force and reaction [N m].
        positions: Positions of the nodes [m].
        velocities: Their velocities [m/s].
        seconds: Weight of this evaluation in the integral over time [s].
        external: Forces on the nodes [N], shape (capacity, 3); written.
    """
    arms = _arms(couples, nodes, c, positions)
    alpha = scale(-1.0, _turned_by(couples, c, arms, torque))
    for q in range(4):
        node = nodes[c, q]
        force = scale(couples.mass[c, q], cross(alpha, arms[q]))
        store(external, node, add(vec3(external, node), force))
    turn = vec3(couples.turn, c)
    if dot(turn, turn) == 0.0:
        store(couples.spin, c, _spin(couples, nodes, c, arms, velocities))
    store(couples.turn, c, axpy(seconds, alpha, turn))
    couples.have_acted = 1


@kernel
def work_of_couple(
    couples: Couples, nodes: IntArray, c: int, positions: FloatArray, velocities: FloatArray
) -> float:
    """Return the work of the couple of contact `c` in the substep that ends [J], and clear it.

    Args:
        couples: Written.
        nodes: The nodes of the contacts, shape (rows, 4).
        c: The contact.
        positions: Positions of the nodes [m].
        velocities: Their velocities [m/s].
    """
    turn = vec3(couples.turn, c)
    if dot(turn, turn) == 0.0:
        return 0.0
    arms = _arms(couples, nodes, c, positions)
    both = add(vec3(couples.spin, c), _spin(couples, nodes, c, arms, velocities))
    store(couples.turn, c, Vec3(0.0, 0.0, 0.0))
    return float(0.5 * dot(turn, both))


@kernel
def _arms(couples: Couples, nodes: IntArray, c: int, positions: FloatArray) -> FourPoints:
    """Return where the nodes of contact `c` are from their centre of mass [m].

    They are measured from the heaviest, which may be the centre but for rounding.
    """
    heaviest, mass = 0, 0.0
    for q in range(4):
        mass += couples.mass[c, q]
        if couples.mass[c, q] > couples.mass[c, heaviest]:
            heaviest = q
    origin, centre = vec3(positions, nodes[c, heaviest]), Vec3(0.0, 0.0, 0.0)
    for q in range(4):
        apart = sub(vec3(positions, nodes[c, q]), origin)
        centre = axpy(couples.mass[c, q] / mass, apart, centre)
    return FourPoints(
        sub(sub(vec3(positions, nodes[c, 0]), origin), centre),
        sub(sub(vec3(positions, nodes[c, 1]), origin), centre),
        sub(sub(vec3(positions, nodes[c, 2]), origin), centre),
        sub(sub(vec3(positions, nodes[c, 3]), origin), centre),
    )


@kernel
def _spin(
    couples: Couples, nodes: IntArray, c: int, arms: FourPoints, velocities: FloatArray
) -> Vec3:
    """Return the angular momentum of the nodes about their centre [kg m2/s]."""
    total = Vec3(0.0, 0.0, 0.0)
    for q in range(4):
        total = axpy(couples.mass[c, q], cross(arms[q], vec3(velocities, nodes[c, q])), total)
    return total


@kernel
def _turned_by(couples: Couples, c: int, arms: FourPoints, torque: Vec3) -> Vec3:
    """Return the angular acceleration that a torque gives the nodes as one body [rad/s2]."""
    xx, yy, zz, xy, xz, yz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for q in range(4):
        m, r = couples.mass[c, q], arms[q]
        xx += m * (r.y * r.y + r.z * r.z)
        yy += m * (r.x * r.x + r.z * r.z)
        zz += m * (r.x * r.x + r.y * r.y)
        xy -= m * r.x * r.y
        xz -= m * r.x * r.z
        yz -= m * r.y * r.z
    # J = L D L^T; about an axis on which all nodes are there is no torque either.
    least = _FLAT * (xx + yy + zz)
    per_x = 1.0 / xx if xx > least else 0.0
    l_y, l_z = xy * per_x, xz * per_x
    d_y = yy - l_y * xy
    per_y = 1.0 / d_y if d_y > least else 0.0
    l_yz = (yz - l_y * xz) * per_y
    d_z = zz - l_z * xz - l_yz * l_yz * d_y
    per_z = 1.0 / d_z if d_z > least else 0.0
    y = torque.y - l_y * torque.x
    z = (torque.z - l_z * torque.x - l_yz * y) * per_z
    y = y * per_y - l_yz * z
    return Vec3(torque.x * per_x - l_y * y - l_z * z, y, z)
