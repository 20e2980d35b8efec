"""Forces of contacts in every evaluation; anchors and work after a substep. Eight at a time.

The force of a contact acts where it and its reaction are on one line (`torque_balance`), its depth
is that of the listed points. As the sides turn together the two do not move by the same, and the
force does work that is not in the energy of the spring. Where that is more than the spring gave up,
it gives up the rest: its offset shrinks. Without that, a node that was pressed deep near a small
face kept a flap of a cut block swinging at 0.2 m/s without end.
"""

from typing import NamedTuple

from tissue.contact.geometry.eight_contacts import (
    TINY,
    combined,
    four_of,
    points_of_contacts,
    share_within,
    smaller,
    three_of,
    vectors_where_positive,
    where_positive,
)
from tissue.contact.response.contacts import PenaltyForces, clear_contact_forces
from tissue.contact.response.torque_balance import (
    balance_torque,
    weights_on_line,
    work_of_balance,
)
from tissue.core.array_types import FloatArray
from tissue.core.jit import inlined, kernel
from tissue.core.simd import WIDTH, Lanes, lanes, load_lanes, square_root, store_lanes
from tissue.core.simd_blocks import sum_of_lanes
from tissue.core.simd_rows import (
    add_to_row,
    larger,
    larger_bits,
    largest,
    store_rows_of_four,
    store_rows_of_three,
    where_larger,
)
from tissue.core.vec3 import Vec3, add, axpy, cross, dot, scale, sub, vec3


class _Bits(NamedTuple):
    """Bits of eight contacts."""

    pressing: int
    """Which press."""
    turning: int
    """Which of these needs a torque balance."""


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
        velocities: Their velocities [m/s], in the same layout.
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
            _balance_torques(forces, positions, velocities, (c, n, bits.turning), seconds, external)


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
    share = share_within(load_lanes(forces.friction, c) * depth, pull)
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
        if _is_floor_contact(forces, c + i):
            forces.floor_impulse[0] += seconds * x
            forces.floor_impulse[1] += seconds * y
            forces.floor_impulse[2] += seconds * z
        else:
            forces.pressure_impulse += seconds * forces.acting[i, 3]


@kernel
def _is_floor_contact(forces: PenaltyForces, c: int) -> bool:
    """Whether contact `c` is one of a node and the floor."""
    return bool(forces.node[c, 0] == forces.node[c, 1])


@kernel
def _balance_torques(
    forces: PenaltyForces,
    positions: FloatArray,
    velocities: FloatArray,
    eight: tuple[int, int, int],
    seconds: float,
    external: FloatArray,
) -> None:
    """Add the torque balances of those of eight contacts that need one to the forces on the nodes.

    Args:
        forces: `balance` is written.
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
        balance_torque(
            forces.balance, forces.node, c, torque, positions, velocities, seconds, external
        )


@kernel
def end_contact_substep(
    forces: PenaltyForces, positions: FloatArray, velocities: FloatArray, external: FloatArray
) -> None:
    """Move the anchors of what slides; count work, and record forces and energies after a substep.

    The work is the impulse times the mean of the velocities before and after: that is by what it
    changed the kinetic energy, however long the substep.

    Args:
        forces: Written.
        positions: Positions of the nodes [m], as `points_of_column` reads them.
        velocities: Their velocities [m/s], in the same layout.
        external: Forces on the nodes [N], shape (capacity, 3); those of contact are cleared.
    """
    clear_contact_forces(forces, external)
    forces.stored, forces.n_pressing = 0.0, 0
    end = forces.first + forces.n_contacts
    for c in range(forces.first, end, WIDTH):
        _end_eight(forces, positions, velocities, c, min(end - c, WIDTH))
    forces.balance.has_acted = 0


@inlined
def _end_eight(
    forces: PenaltyForces, positions: FloatArray, velocities: FloatArray, c: int, n: int
) -> None:
    """End a substep for eight contacts, of which `n` are there, from `c` on."""
    zero, half, w = lanes(0.0), lanes(0.5), four_of(forces.weight, c)
    across, normal = (
        combined(w, points_of_contacts(forces.node, positions, c)),
        three_of(forces.normal, c),
    )
    along, height = dot(normal, across), load_lanes(forces.height, c)
    is_there = lanes(float(n)) - load_lanes(forces.place, 0)
    offset = load_lanes(forces.offset, c)
    free = where_larger(is_there, zero, offset + height - along, zero)
    largest_depth, stiffness = load_lanes(forces.largest_depth, c), load_lanes(forces.stiffness, c)
    gained = _count_work(forces, positions, velocities, c, n)
    if larger_bits(gained, zero) != 0:
        left = _free_after(free, largest_depth, stiffness, gained)
        store_lanes(forces.offset, c, offset - (free - left))
        free = left
    pressing = larger_bits(free, zero)
    tangential = axpy(zero - along, normal, across)
    anchor = three_of(forces.anchor, c)
    depth = smaller(free, largest_depth)
    k = where_larger(free, zero, stiffness, zero)
    stretch = sub(tangential, anchor)
    share, one = share_within(load_lanes(forces.friction, c) * depth, stretch), lanes(1.0)
    stretch = scale(share, stretch)
    slid = sub(tangential, stretch)
    # What was released is slack where it is; what holds keeps its anchor to the last bit.
    anchor = vectors_where_positive(one - share, slid, anchor)
    anchor = vectors_where_positive(free, anchor, tangential)
    store_rows_of_three(forces.anchor, c, anchor.x, anchor.y, anchor.z)
    store_lanes(forces.push, c, k * depth)
    if pressing == 0:
        return
    held = depth * (free - half * depth) + half * dot(stretch, stretch)
    forces.stored += sum_of_lanes(where_larger(free, zero, k * held, zero))
    deepest = largest(where_larger(free, zero, height - along, zero))
    forces.penetration = max(forces.penetration, deepest)
    for i in range(n):
        forces.n_pressing += pressing >> i & 1


@inlined
def _count_work(
    forces: PenaltyForces, positions: FloatArray, velocities: FloatArray, c: int, n: int
) -> Lanes:
    """Count the work of eight contacts; return by how much it is more than at the listed points.

    Args:
        forces: `work` is written, and `impulse` and torque balances are cleared.
        positions: Positions of the nodes [m].
        velocities: Their velocities [m/s].
        c: The first of them.
        n: How many of the eight there are.

    Returns:
        That work [J]. It is what forces do that act off the listed points, as both sides turn.
    """
    zero, half = lanes(0.0), lanes(0.5)
    more, before = zero, three_of(forces.impulse, c)
    is_there = lanes(float(n)) - load_lanes(forces.place, 0)
    has_begun = where_larger(is_there, zero, dot(before, before), zero)
    if larger_bits(has_begun, zero) != 0:
        v = points_of_contacts(forces.node, velocities, c)
        both = add(three_of(forces.velocity, c), combined(four_of(forces.spread, c), v))
        listed = add(three_of(forces.listed_velocity, c), combined(four_of(forces.weight, c), v))
        work = where_larger(has_begun, zero, half * dot(before, both), zero)
        forces.work += sum_of_lanes(work)
        more = work - where_larger(has_begun, zero, half * dot(before, listed), zero)
    store_rows_of_three(forces.impulse, c, zero, zero, zero)
    if forces.balance.has_acted == 1:
        store_lanes(forces.balance_work, 0, zero)
        for i in range(n):
            of_balance = work_of_balance(forces.balance, forces.node, c + i, positions, velocities)
            forces.balance_work[i] = of_balance
            forces.work += of_balance
        more = more + load_lanes(forces.balance_work, 0)
    return more


@inlined
def _free_after(free: Lanes, largest_depth: Lanes, stiffness: Lanes, gained: Lanes) -> Lanes:
    """Return the depths of springs that give up energy, as far as they have any.

    Args:
        free: Their depths, which may be above the largest [m].
        largest_depth: Depths above which their forces grow no more [m].
        stiffness: Their stiffness [N/m].
        gained: The energies [J].
    """
    zero, half = lanes(0.0), lanes(0.5)
    depth, kink = smaller(free, largest_depth), half * largest_depth * largest_depth
    held = where_larger(free, zero, depth * (free - half * depth), zero)
    left = larger(held - gained / larger(stiffness, lanes(TINY)), zero)
    rising = square_root(left + left)
    flat = (left + kink) / larger(largest_depth, lanes(TINY))
    given = where_larger(left, kink, flat, rising)
    return where_larger(held, zero, where_larger(gained, zero, given, free), free)
