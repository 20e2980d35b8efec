"""`PenaltyForces`: contacts as springs that push apart and rub, evaluated with all other forces.

A contact lies between a node and a point of a face, between points of two edges, or between a node
and the floor. With the weights w of its nodes, its gap is g = n . sum(w_i x_i), and

    d = min(offset - g, largest depth)                  depth of the spring
    f = k max(d - tau n . v, 0)                         pressure, where d > 0; v = sum(w_i v_i)
    t = k (s + tau v_t), no longer than mu k d          friction, against the stretch s and sliding

The weights of two sides add up to zero, so what one side gets the other gives; the force acts with
weights that put it and its reaction on one line (`line_of_action`), and where there is none a
couple takes what they turn (`couples`). Friction is a spring
that begins at an anchor; where it pulls with more than Coulomb's limit, the anchor follows at the
end of the substep, so that within a substep forces depend on positions and velocities alone.

Source: Cundall and Strack (1979), A discrete numerical model for granular assemblies, for the
springs with friction.
"""

from typing import NamedTuple

import numpy as np

from tissue.contact.penalty.couples import Couples, add_couple, new_couples
from tissue.contact.penalty.eight_contacts import (
    combined,
    four_of,
    points_of_contacts,
    share_within,
    smaller,
    three_of,
    vectors_where_positive,
    where_positive,
)
from tissue.contact.penalty.line_of_action import weights_on_line
from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import inlined, kernel
from tissue.core.simd import WIDTH, filled, lanes, load_lanes
from tissue.core.simd_gather import larger, larger_bits, where_larger
from tissue.core.simd_rows import (
    add_to_row,
    store_rows_of_four,
    store_rows_of_three,
)
from tissue.core.structs import Arrays, FloatCell, IntCell
from tissue.core.vec3 import Vec3, axpy, cross, dot, scale, store, sub, vec3


class _Bits(NamedTuple):
    """Bits of eight contacts."""

    pressing: int
    """Which press."""
    turning: int
    """Which of these need a couple."""


HANDED_ON = -1.0
"""Value of `PenaltyForces.push` where a contact of the next list goes on with the force."""


class PenaltyForces(Arrays):
    """Two lists of contacts: that in use, and room for the next; both of `capacity` rows.

    The capacity is a multiple of eight: so many contacts are evaluated at a time. The rows of one
    list are one after the other, so arrays have 2 * capacity rows.
    """

    first: IntCell
    """First row of the list in use: 0, or the capacity."""
    n_contacts: IntCell
    """Number of contacts in the list in use."""
    n_fading: IntCell
    """Number of contacts at the end of that list that were given up while they pressed: their
    forces fade."""
    n_pressing: IntCell
    """Number of contacts that pressed at the end of the last substep."""
    n_nodes: IntCell
    """Number of nodes in contact."""
    has_acted: IntCell
    """1 if forces of contact are among those on the nodes, else 0."""
    work: FloatCell
    """Work of all contact forces on the body so far [J]; mostly negative."""
    stored: FloatCell
    """Energy of the springs at the end of the last substep [J]."""
    pressure_impulse: FloatCell
    """Sum of the impulses that pressed sides together since totals were cleared [N s]."""
    penetration: FloatCell
    """Greatest depth of a contact that pressed since totals were cleared [m]."""
    floor_impulse: FloatArray
    """Impulse of the floor on the body since totals were cleared [N s], shape (3,)."""
    touching: IntArray
    """Nodes in contact, each once; shape (4 * capacity,)."""
    node: IntArray
    """Nodes: one and the corners of a face, or the ends of two edges; four times the same on the
    floor. Shape (2 * capacity, 4)."""
    weight: FloatArray
    """Weight of each node; they add up to 0, or to 1 on the floor. Shape (2 * capacity, 4)."""
    normal: FloatArray
    """Unit vector towards the side of the positive weights, shape (2 * capacity, 3)."""
    height: FloatArray
    """Height of the floor where that is the other side, else 0 [m]; shape (2 * capacity,)."""
    stiffness: FloatArray
    """Stiffness k [N/m], shape (2 * capacity,)."""
    offset: FloatArray
    """Gap below which the spring pushes [m], shape (2 * capacity,)."""
    largest_depth: FloatArray
    """Depth above which the force grows no more [m], shape (2 * capacity,)."""
    damping_time: FloatArray
    """Damping per stiffness tau [s], shape (2 * capacity,)."""
    push: FloatArray
    """Elastic part of the pressure at the end of the last substep [N], or HANDED_ON; shape
    (2 * capacity,)."""
    anchor: FloatArray
    """Where the spring of friction is slack: sum(w_i x_i) without its part along the normal [m],
    shape (2 * capacity, 3)."""
    spread: FloatArray
    """Weights that the force of each contact last acted with: those that put it and its reaction on
    one line (`line_of_action`); shape (2 * capacity, 4)."""
    impulse: FloatArray
    """Impulse of each contact since the last substep ended [N s], shape (2 * capacity, 3)."""
    velocity: FloatArray
    """sum(w_i v_i) as a contact began to push in this substep [m/s], with the weights `spread`;
    shape (2 * capacity, 3)."""
    listed_velocity: FloatArray
    """sum(w_i v_i) at the same instant [m/s], with the weights of the list; alike."""
    couples: Couples
    """What keeps forces from turning the body where they are on no line with their reaction."""
    work_of_couples: FloatArray
    """Scratch: work of the couples of eight contacts [J]; shape (8,)."""
    acting: FloatArray
    """Scratch: the forces of eight contacts, and their pressures [N]; shape (8, 4)."""
    place: FloatArray
    """The numbers from 0 to 7."""
    friction: float
    """Coefficient of friction."""
    retardation_time: float
    """Longest damping per stiffness [s]."""


def new_penalty_forces(capacity: int, friction: float, retardation_time: float) -> PenaltyForces:
    """Return no contacts, with room for that many."""
    rows = 2 * filled(capacity)
    of_floats = ("height", "stiffness", "offset", "largest_depth", "push")
    of_vectors = ("anchor", "impulse", "velocity", "listed_velocity")
    return PenaltyForces(
        first=0,
        n_contacts=0,
        n_fading=0,
        n_pressing=0,
        n_nodes=0,
        has_acted=0,
        work=0.0,
        stored=0.0,
        pressure_impulse=0.0,
        penetration=0.0,
        floor_impulse=np.zeros(3),
        touching=np.zeros(2 * rows, np.int64),
        node=np.zeros((rows, 4), np.int64),
        weight=np.zeros((rows, 4)),
        spread=np.zeros((rows, 4)),
        normal=np.zeros((rows, 3)),
        **{name: np.zeros(rows) for name in of_floats},
        **{name: np.zeros((rows, 3)) for name in of_vectors},
        damping_time=np.full(rows, float(retardation_time)),
        couples=new_couples(rows),
        work_of_couples=np.zeros(WIDTH),
        acting=np.zeros((WIDTH, 4)),
        place=np.arange(float(WIDTH)),
        friction=float(friction),
        retardation_time=float(retardation_time),
    )


def grown_penalty_forces(forces: PenaltyForces, capacity: int) -> PenaltyForces:
    """Return the contacts with room for that many; the first list is the one in use."""
    n, used = forces.n_contacts, slice(forces.first, forces.first + forces.n_contacts)
    larger = new_penalty_forces(capacity, forces.friction, forces.retardation_time)
    of_rows = ("node", "weight", "normal", "height", "stiffness", "offset", "largest_depth")
    for name in (*of_rows, "damping_time", "push", "anchor"):
        getattr(larger, name)[:n] = getattr(forces, name)[used]
    cells = ("n_contacts", "n_fading", "n_pressing", "work", "stored", "pressure_impulse")
    for name in (*cells, "penetration"):
        setattr(larger, name, getattr(forces, name))
    larger.floor_impulse[:] = forces.floor_impulse
    return larger


@kernel
def clear_contact_totals(forces: PenaltyForces) -> None:
    """Begin to count impulses and penetration."""
    forces.pressure_impulse = forces.penetration = 0.0
    forces.n_pressing = 0
    for x in range(3):
        forces.floor_impulse[x] = 0.0


@kernel
def weighted_sum(forces: PenaltyForces, c: int, values: FloatArray) -> Vec3:
    """Return the weighted sum of nodal values at contact `c`: one side less the other."""
    weight, node = forces.weight, forces.node
    total = scale(weight[c, 0], vec3(values, node[c, 0]))
    for q in range(1, 4):
        total = axpy(weight[c, q], vec3(values, node[c, q]), total)
    return total


@kernel
def is_floor_contact(forces: PenaltyForces, c: int) -> bool:
    """Whether contact `c` is one of a node and the floor."""
    return bool(forces.node[c, 0] == forces.node[c, 1])


@kernel
def clear_contact_forces(forces: PenaltyForces, external: FloatArray) -> None:
    """Set the forces on the nodes of all contacts to zero, if there are any."""
    if forces.has_acted == 0:
        return
    forces.has_acted = 0
    for i in range(forces.n_nodes):
        store(external, forces.touching[i], Vec3(0.0, 0.0, 0.0))


@kernel
def list_touching_nodes(forces: PenaltyForces, share: FloatArray) -> None:
    """List the nodes in contact, and write the share of each in all contacts: sum(|w|)."""
    rows, n = range(forces.first, forces.first + forces.n_contacts), 0
    for c in rows:
        for q in range(4):
            share[forces.node[c, q]] = -1.0
    for c in rows:
        for q in range(4):
            node = forces.node[c, q]
            if share[node] < 0.0:
                share[node] = 0.0
                forces.touching[n] = node
                n += 1
            share[node] += abs(forces.weight[c, q])
    forces.n_nodes = n


@kernel
def add_contact_forces(
    forces: PenaltyForces,
    positions: FloatArray,
    velocities: FloatArray,
    seconds: float,
    external: FloatArray,
) -> None:
    """Add the forces of all contacts to those on the nodes, and count their impulses.

    Args:
        forces: Totals are written.
        positions: Positions of the nodes [m], as `points_of_column` reads them.
        velocities: Their velocities [m/s], alike.
        seconds: Weight of this evaluation in the integral over time [s].
        external: Forces on the nodes [N], shape (capacity, 3); those of contact are added.
    """
    end = forces.first + forces.n_contacts
    forces.has_acted = 1
    for c in range(forces.first, end, WIDTH):
        n, bits = min(end - c, WIDTH), _eight_forces(forces, positions, velocities, seconds, c)
        if bits.pressing == 0:
            continue
        _add_eight(forces, c, n, bits.pressing, seconds, external)
        if bits.turning != 0:
            _add_couples(forces, positions, velocities, (c, n, bits.turning), seconds, external)


@inlined
def _eight_forces(
    forces: PenaltyForces, positions: FloatArray, velocities: FloatArray, seconds: float, c: int
) -> _Bits:
    """Compute the forces of eight contacts, and add up their impulses; return which press.

    Args:
        forces: `spread`, `acting`, `impulse`, `velocity` and `listed_velocity` are written.
        positions: Positions of the nodes [m].
        velocities: Their velocities [m/s].
        seconds: Weight of this evaluation in the integral over time [s].
        c: The first of them.
    """
    zero, tau = lanes(0.0), load_lanes(forces.damping_time, c)
    x, w = points_of_contacts(forces.node, positions, c), four_of(forces.weight, c)
    across, normal = combined(w, x), three_of(forces.normal, c)
    along = dot(normal, across)
    free = load_lanes(forces.offset, c) + load_lanes(forces.height, c) - along
    if larger_bits(free, zero) == 0:
        return _Bits(0, 0)
    depth = smaller(free, load_lanes(forces.largest_depth, c))
    k, v = load_lanes(forces.stiffness, c), points_of_contacts(forces.node, velocities, c)
    velocity = combined(w, v)
    approach = dot(normal, velocity)
    force = larger(k * (depth - tau * approach), zero)
    anchor = three_of(forces.anchor, c)
    stretch = sub(axpy(zero - along, normal, across), anchor)
    pull = axpy(tau, axpy(zero - approach, normal, velocity), stretch)
    share = share_within(lanes(forces.friction) * depth, pull)
    total = axpy(force, normal, scale(zero - share * k, pull))
    is_acting = where_larger(free, zero, dot(total, total), zero)
    found = weights_on_line(x, w, total)
    now, last = combined(found.weights, v), four_of(forces.spread, c)
    spread = where_positive(is_acting, found.weights, last)
    before = three_of(forces.impulse, c)
    began = three_of(forces.velocity, c)
    has_begun, weight = dot(before, before), where_larger(is_acting, zero, lanes(seconds), zero)
    began = vectors_where_positive(has_begun, began, now)
    listed_before = three_of(forces.listed_velocity, c)
    listed = vectors_where_positive(has_begun, listed_before, velocity)
    store_rows_of_four(forces.spread, c, spread.a, spread.b, spread.c, spread.d)
    after = axpy(weight, total, before)
    store_rows_of_three(forces.impulse, c, after.x, after.y, after.z)
    store_rows_of_three(forces.velocity, c, began.x, began.y, began.z)
    store_rows_of_three(forces.listed_velocity, c, listed.x, listed.y, listed.z)
    store_rows_of_four(forces.acting, 0, total.x, total.y, total.z, force)
    pressing = larger_bits(is_acting, zero)
    return _Bits(pressing, pressing & found.turning)


@inlined
def _add_eight(
    forces: PenaltyForces, c: int, n: int, pressing: int, seconds: float, external: FloatArray
) -> None:
    """Add the forces of eight contacts to those on the nodes.

    Args:
        forces: Totals are written.
        c: The first contact.
        n: How many of the eight there are.
        pressing: Bits for which press.
        seconds: Weight of this evaluation in the integral over time [s].
        external: Forces on the nodes [N]; written.
    """
    for i in range(n):
        if pressing >> i & 1 == 0:
            continue
        x, y, z = forces.acting[i, 0], forces.acting[i, 1], forces.acting[i, 2]
        for q in range(4):
            add_to_row(external, forces.node[c + i, q], forces.spread[c + i, q], x, y, z)
        if is_floor_contact(forces, c + i):
            forces.floor_impulse[0] += seconds * x
            forces.floor_impulse[1] += seconds * y
            forces.floor_impulse[2] += seconds * z
        else:
            forces.pressure_impulse += seconds * forces.acting[i, 3]


@kernel
def _add_couples(
    forces: PenaltyForces,
    positions: FloatArray,
    velocities: FloatArray,
    eight: tuple[int, int, int],
    seconds: float,
    external: FloatArray,
) -> None:
    """Add the couples of those of eight contacts that need one to the forces on the nodes.

    Args:
        forces: `couples` is written.
        positions: Positions of the nodes [m].
        velocities: Their velocities [m/s].
        eight: The first contact, how many of the eight there are, and bits for which need one.
        seconds: Weight of this evaluation in the integral over time [s].
        external: Forces on the nodes [N]; written.
    """
    first, n, turning = eight
    for i in range(n):
        if turning >> i & 1 == 0:
            continue
        c, across = first + i, Vec3(0.0, 0.0, 0.0)
        for q in range(4):
            across = axpy(forces.spread[c, q], vec3(positions, forces.node[c, q]), across)
        force = Vec3(forces.acting[i, 0], forces.acting[i, 1], forces.acting[i, 2])
        torque = cross(across, force)
        add_couple(forces.couples, forces.node, c, torque, positions, velocities, seconds, external)
