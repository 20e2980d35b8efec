"""Forces of contacts act so that they and their reactions turn nothing.

A contact is listed once in a time step, and its sides slide past each other meanwhile, rub, and
overlap. A force on a node and the opposite one on the listed point of a face are then on two
parallel lines, and make a torque. So a force acts where its own line meets the face; between two
feature edges, where its line meets both.

The line of a force that is nearly along the face, or of a deep overlap near a small face, meets
it far away or nowhere. So a weight leaves the listed one by `_LARGEST_SHIFT` at most: what needs
n times that shift gets 1 / n of it, and nothing jumps where the line meets no face.

The torque that is left is taken by forces that turn the four nodes of the contact as one rigid
body. With the nodes at r_q from their centre of mass, and J their tensor of inertia,

    c_q = m_q alpha x r_q        J alpha = -torque

Of all forces with that torque and without a resultant these have the least sum(|c_q|^2 / m_q), by
Gauss's principle of least constraint: what is left of the contact is what strains its nodes, and is
never more than it was: the stable step stays. They exist wherever the nodes are, and follow them
without a jump.

Source: Gauss (1829), Über ein neues allgemeines Grundgesetz der Mechanik.
"""

from typing import NamedTuple

import numpy as np

from tissue.contact.geometry.eight_contacts import TINY, Four, FourPoints, combined
from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import inlined, kernel
from tissue.core.simd import Lanes, lanes
from tissue.core.simd_rows import larger, larger_bits, where_larger
from tissue.core.structs import Arrays, IntCell
from tissue.core.vec3 import Vec3, add, axpy, cross, dot, scale, store, sub, vec3

_LARGEST_SHIFT = 0.3
"""Largest difference of a weight from the listed one. More: deep overlaps act far from where they
are; the stable step is that of the listed weights. Less: more is left to torque balances."""

_FLAT = 1e-14
"""Pivot of a tensor of inertia, over its trace, below which the nodes are on one line and nothing
turns them about it. Larger: thin contacts keep a torque; smaller: it divides by rounding errors."""


class _Shift(NamedTuple):
    """Distance of the points of a contact from the line of its force: `p / per` and `q / per`."""

    p: Lanes
    """Shift of the second weight of a face, or of the point on the first feature edge; times
    `per`."""
    q: Lanes
    """Shift of the third weight of a face, or of the point on the second feature edge; times
    `per`."""
    per: Lanes


class OnLine(NamedTuple):
    """Where the forces of eight contacts act."""

    weights: Four
    """Weights of the nodes; those of each contact add up to what the listed ones do."""
    turning: int
    """Bits for the contacts whose force and reaction are still on two lines."""


class TorqueBalance(Arrays):
    """The torque balances of contacts, one row for each contact of `PenaltyForces`."""

    has_acted: IntCell
    """1 if a balance has acted since the last substep ended, else 0."""
    mass: FloatArray
    """Mass of each node of the contact [kg], shape (rows, 4)."""
    turn: FloatArray
    """Angular velocity that the balance has given the nodes since then [rad/s], shape (rows, 3)."""
    spin: FloatArray
    """Angular momentum of the nodes about their centre as it began to act [kg m2/s], shape (rows,
    3)."""


@inlined
def weights_on_line(x: FourPoints, listed: Four, force: Vec3) -> OnLine:
    """Return the weights of the nodes for forces that turn nothing, as far as there are any.

    Args:
        x: Positions of the nodes [m].
        listed: The weights that the contacts were listed with. The first is 1 for a node and a
            face, and for a node and the floor, whose four nodes are one.
        force: The force on the side of the positive weights [N]; of any length.
    """
    zero, one = lanes(0.0), lanes(1.0)
    across = combined(listed, x)
    is_feature_edge = larger_bits(one, listed.a)
    shift = _to_line_on_face(x, across, force)
    if is_feature_edge != 0:
        other = _to_line_of_edges(x, across, force)
        shift = _Shift(
            where_larger(one, listed.a, other.p, shift.p),
            where_larger(one, listed.a, other.q, shift.q),
            where_larger(one, listed.a, other.per, shift.per),
        )
    most = larger(larger(_size(shift.p), _size(shift.q)), _size(shift.p + shift.q))
    longest, square = lanes(1.0 / _LARGEST_SHIFT) * most, shift.per * shift.per
    share = shift.per / larger(larger(square, longest * longest), lanes(TINY))
    p, q = share * shift.p, share * shift.q
    on_face = Four(zero, p + q, zero - p, zero - q)
    moved = Four(
        where_larger(one, listed.a, zero - p, on_face.a),
        where_larger(one, listed.a, p, on_face.b),
        where_larger(one, listed.a, q, on_face.c),
        where_larger(one, listed.a, zero - q, on_face.d),
    )
    weights = Four(listed.a + moved.a, listed.b + moved.b, listed.c + moved.c, listed.d + moved.d)
    # The floor is no node: it gives no reaction, and the weights add up to 1.
    has_reaction = larger_bits(lanes(0.5), listed.a + listed.b + listed.c + listed.d)
    return OnLine(weights, has_reaction & ~larger_bits(square, longest * longest))


@inlined
def _to_line_on_face(x: FourPoints, across: Vec3, force: Vec3) -> _Shift:
    """Return the shift along the face to where the line of a force through the node meets it.

    Args:
        x: Positions of the node and the corners [m].
        across: From the listed point of the face to the node [m].
        force: The force [N].
    """
    ab, ac = sub(x.c, x.b), sub(x.d, x.b)
    area = cross(ab, ac)
    along = dot(area, force)
    shift = axpy(lanes(0.0) - dot(area, across), force, scale(along, across))
    p, q = dot(cross(shift, ac), area), dot(cross(ab, shift), area)
    return _Shift(p, q, along * dot(area, area))


@inlined
def _to_line_of_edges(x: FourPoints, across: Vec3, force: Vec3) -> _Shift:
    """Return the shifts along the edges ab and cd to where one line along a force meets both.

    Args:
        x: Positions of the ends of the edges [m].
        across: From the listed point of the second edge to that of the first [m].
        force: The force [N].
    """
    u, v, zero = sub(x.b, x.a), sub(x.d, x.c), lanes(0.0)
    p, q = dot(across, cross(v, force)), dot(across, cross(u, force))
    return _Shift(zero - p, zero - q, dot(cross(u, v), force))


@inlined
def _size(a: Lanes) -> Lanes:
    """Return the absolute values."""
    return larger(a, lanes(0.0) - a)


def new_torque_balance(rows: int) -> TorqueBalance:
    """Return no torque balances, for that many contacts."""
    return TorqueBalance(
        has_acted=0,
        mass=np.zeros((rows, 4)),
        turn=np.zeros((rows, 3)),
        spin=np.zeros((rows, 3)),
    )


@kernel
def balance_torque(
    balance: TorqueBalance,
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
        balance: Written.
        nodes: The nodes of the contacts, shape (rows, 4).
        c: The contact.
        torque: Torque of its force and reaction [N m].
        positions: Positions of the nodes [m].
        velocities: Their velocities [m/s].
        seconds: Weight of this evaluation in the integral over time [s].
        external: Forces on the nodes [N], shape (capacity, 3); written.
    """
    arms = _arms(balance, nodes, c, positions)
    alpha = scale(-1.0, _turned_by(balance, c, arms, torque))
    for q in range(4):
        node = nodes[c, q]
        force = scale(balance.mass[c, q], cross(alpha, arms[q]))
        store(external, node, add(vec3(external, node), force))
    turn = vec3(balance.turn, c)
    if dot(turn, turn) == 0.0:
        store(balance.spin, c, _spin(balance, nodes, c, arms, velocities))
    store(balance.turn, c, axpy(seconds, alpha, turn))
    balance.has_acted = 1


@kernel
def work_of_balance(
    balance: TorqueBalance, nodes: IntArray, c: int, positions: FloatArray, velocities: FloatArray
) -> float:
    """Return the work that balances contact `c` in the substep that ends [J], and clear it.

    Args:
        balance: Written.
        nodes: The nodes of the contacts, shape (rows, 4).
        c: The contact.
        positions: Positions of the nodes [m].
        velocities: Their velocities [m/s].
    """
    turn = vec3(balance.turn, c)
    if dot(turn, turn) == 0.0:
        return 0.0
    arms = _arms(balance, nodes, c, positions)
    both = add(vec3(balance.spin, c), _spin(balance, nodes, c, arms, velocities))
    store(balance.turn, c, Vec3(0.0, 0.0, 0.0))
    return float(0.5 * dot(turn, both))


@kernel
def _arms(balance: TorqueBalance, nodes: IntArray, c: int, positions: FloatArray) -> FourPoints:
    """Return where the nodes of contact `c` are from their centre of mass [m].

    They are measured from the heaviest, which may be the centre but for rounding.
    """
    heaviest, mass = 0, 0.0
    for q in range(4):
        mass += balance.mass[c, q]
        if balance.mass[c, q] > balance.mass[c, heaviest]:
            heaviest = q
    origin, centre = vec3(positions, nodes[c, heaviest]), Vec3(0.0, 0.0, 0.0)
    for q in range(4):
        apart = sub(vec3(positions, nodes[c, q]), origin)
        centre = axpy(balance.mass[c, q] / mass, apart, centre)
    return FourPoints(
        sub(sub(vec3(positions, nodes[c, 0]), origin), centre),
        sub(sub(vec3(positions, nodes[c, 1]), origin), centre),
        sub(sub(vec3(positions, nodes[c, 2]), origin), centre),
        sub(sub(vec3(positions, nodes[c, 3]), origin), centre),
    )


@kernel
def _spin(
    balance: TorqueBalance, nodes: IntArray, c: int, arms: FourPoints, velocities: FloatArray
) -> Vec3:
    """Return the angular momentum of the nodes about their centre [kg m2/s]."""
    total = Vec3(0.0, 0.0, 0.0)
    for q in range(4):
        total = axpy(balance.mass[c, q], cross(arms[q], vec3(velocities, nodes[c, q])), total)
    return total


@kernel
def _turned_by(balance: TorqueBalance, c: int, arms: FourPoints, torque: Vec3) -> Vec3:
    """Return the angular acceleration that a torque gives the nodes as one body [rad/s2]."""
    xx, yy, zz, xy, xz, yz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for q in range(4):
        m, r = balance.mass[c, q], arms[q]
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
