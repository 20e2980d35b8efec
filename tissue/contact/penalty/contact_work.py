"""The end of a substep: anchors follow what slides, and the work of contact is counted.

The force of a contact acts where it and its reaction are on one line (`line_of_action`), its depth
is that of the listed points. As the sides turn together the two do not move alike, and the force
does work that is not in the energy of the spring. Where that is more than the spring gave up, it
gives up the rest: its offset shrinks. Without that, a node that was pressed deep beside a small
face kept a flap of a cut block swinging at 0.2 m/s without end.
"""

from tissue.contact.penalty.contact_forces import PenaltyForces, clear_contact_forces
from tissue.contact.penalty.couples import work_of_couple
from tissue.contact.penalty.eight_contacts import (
    TINY,
    combined,
    four_of,
    points_of_contacts,
    share_within,
    smaller,
    three_of,
    vectors_where_positive,
)
from tissue.core.array_types import FloatArray
from tissue.core.jit import inlined, kernel
from tissue.core.simd import WIDTH, Lanes, lanes, load_lanes, square_root, store_lanes
from tissue.core.simd_blocks import sum_of_lanes
from tissue.core.simd_gather import larger, larger_bits, largest, where_larger
from tissue.core.simd_rows import store_rows_of_three
from tissue.core.vec3 import add, axpy, dot, scale, sub


@kernel
def end_contact_substep(
    forces: PenaltyForces, positions: FloatArray, velocities: FloatArray, external: FloatArray
) -> None:
    """Let anchors follow what slides; count work, and note forces and energies after a substep.

    The work is the impulse times the mean of the velocities before and after: that is by what it
    changed the kinetic energy, however long the substep.

    Args:
        forces: Written.
        positions: Positions of the nodes [m], as `points_of_column` reads them.
        velocities: Their velocities [m/s], alike.
        external: Forces on the nodes [N], shape (capacity, 3); those of contact are cleared.
    """
    clear_contact_forces(forces, external)
    forces.stored, forces.n_pressing = 0.0, 0
    end = forces.first + forces.n_contacts
    for c in range(forces.first, end, WIDTH):
        _end_eight(forces, positions, velocities, c, min(end - c, WIDTH))
    forces.couples.have_acted = 0


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
    share, one = share_within(lanes(forces.friction) * depth, stretch), lanes(1.0)
    stretch = scale(share, stretch)
    slid = sub(tangential, stretch)
    # What has let go is slack where it is; what holds keeps its anchor to the last bit.
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
        forces: `work` is written, and `impulse` and couples are cleared.
        positions: Positions of the nodes [m].
        velocities: Their velocities [m/s].
        c: The first of them.
        n: How many of the eight there are.

    Returns:
        That work [J]. It is what forces do that act beside the listed points, as both sides turn.
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
    if forces.couples.have_acted == 1:
        store_lanes(forces.work_of_couples, 0, zero)
        for i in range(n):
            of_couple = work_of_couple(forces.couples, forces.node, c + i, positions, velocities)
            forces.work_of_couples[i] = of_couple
            forces.work += of_couple
        more = more + load_lanes(forces.work_of_couples, 0)
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
