"""The end of a substep: anchors follow what slides, and the work of contact is counted."""

from tissue.contact.penalty.contact_forces import PenaltyForces, clear_contact_forces
from tissue.contact.penalty.couples import work_of_couple
from tissue.contact.penalty.eight_contacts import (
    combined,
    four_of,
    points_of_contacts,
    share_within,
    smaller,
    three_of,
)
from tissue.core.array_types import FloatArray
from tissue.core.jit import inlined, kernel
from tissue.core.simd import WIDTH, lanes, load_lanes, store_lanes
from tissue.core.simd_blocks import sum_of_lanes
from tissue.core.simd_gather import larger_bits, largest, where_larger
from tissue.core.simd_rows import store_rows_of_three
from tissue.core.vec3 import Vec3, add, axpy, dot, scale, sub


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
    free = where_larger(is_there, zero, load_lanes(forces.offset, c) + height - along, zero)
    pressing = larger_bits(free, zero)
    tangential = axpy(zero - along, normal, across)
    anchor = three_of(forces.anchor, c)
    depth = smaller(free, load_lanes(forces.largest_depth, c))
    k = where_larger(free, zero, load_lanes(forces.stiffness, c), zero)
    stretch = sub(tangential, anchor)
    share, one = share_within(lanes(forces.friction) * depth, stretch), lanes(1.0)
    stretch = scale(share, stretch)
    slid = sub(tangential, stretch)
    # What has let go is slack where it is; what holds keeps its anchor to the last bit.
    anchor = Vec3(
        where_larger(free, zero, where_larger(one, share, slid.x, anchor.x), tangential.x),
        where_larger(free, zero, where_larger(one, share, slid.y, anchor.y), tangential.y),
        where_larger(free, zero, where_larger(one, share, slid.z, anchor.z), tangential.z),
    )
    store_rows_of_three(forces.anchor, c, anchor.x, anchor.y, anchor.z)
    store_lanes(forces.push, c, k * depth)
    before = three_of(forces.impulse, c)
    has_begun = where_larger(is_there, zero, dot(before, before), zero)
    if larger_bits(has_begun, zero) != 0:
        v, began = points_of_contacts(forces.node, velocities, c), three_of(forces.velocity, c)
        both = add(began, combined(four_of(forces.spread, c), v))
        work = where_larger(has_begun, zero, half * dot(before, both), zero)
        forces.work += sum_of_lanes(work)
    store_rows_of_three(forces.impulse, c, zero, zero, zero)
    if forces.couples.have_acted == 1:
        for i in range(c, c + n):
            forces.work += work_of_couple(forces.couples, forces.node, i, positions, velocities)
    if pressing == 0:
        return
    held = depth * (free - half * depth) + half * dot(stretch, stretch)
    forces.stored += sum_of_lanes(where_larger(free, zero, k * held, zero))
    deepest = largest(where_larger(free, zero, height - along, zero))
    forces.penetration = max(forces.penetration, deepest)
    for i in range(n):
        forces.n_pressing += pressing >> i & 1
