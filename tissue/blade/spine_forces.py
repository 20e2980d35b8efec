"""Forces of the blade's blunt sides on the nodes, sliding against friction, and piercing."""

from tissue.blade.blade_state import (
    BladeState,
    add_reaction,
    add_to_node,
    count_cutting,
    running_totals,
    store_totals,
)
from tissue.blade.edge import BladeMotion, BladePose, displacement_of
from tissue.blade.material_frame import to_material
from tissue.blade.spine_contact import (
    IDLE,
    PIERCING,
    PRESSING,
    SpineContacts,
    SpineSide,
    press_energy,
    press_force,
    press_of,
    spine_side,
    tip_toughness,
    touched_point,
)
from tissue.blade.spine_search import move_point
from tissue.core.array_types import FloatArray
from tissue.core.jit import kernel
from tissue.core.vec3 import Vec3, add, axpy, dot, scale, sub, vec3
from tissue.mesh.body import Body
from tissue.mesh.star import Visits


@kernel
def apply_spine_forces(
    blade: BladeState,
    body: Body,
    motion: BladeMotion,
    positions: FloatArray,
    share: float,
    dt: float,
    external: FloatArray,
) -> None:
    """Add the forces of the blunt sides to those on the nodes; count impulse and work.

    Args:
        blade: Its totals are written.
        body: The tissue.
        motion: Pose and motion of the blade.
        positions: Positions of the nodes [m].
        share: Weight of this evaluation in the integral over the step; they add up to 1.
        dt: Length of the time step [s].
        external: Forces on the nodes [N], shape (capacity, 3).
    """
    spine, pose = blade.spine, motion.pose
    if spine.n_pressing == 0:
        return
    seconds = share * dt
    running = running_totals(blade.totals)
    for k in range(len(spine.state)):
        if spine.state[k] < PRESSING:
            continue
        side = spine_side(spine, pose, k)
        p = touched_point(spine, body, positions, k)
        press = press_of(spine, k, side, pose.normal, p, blade.toughness)
        force = press_force(spine, k, side, pose.normal, press)
        for q in range(4):
            node = body.tetrahedra[spine.tetrahedron[k], q]
            running = add_to_node(external, running, node, spine.weights[k, q], force, seconds)
        running = add_reaction(running, p, force, displacement_of(motion, p), share, seconds)
    store_totals(blade.totals, running)


@kernel
def slip_spine(blade: BladeState, body: Body, visits: Visits, pose: BladePose) -> None:
    """Slide samples, pierce with them and release them after a step; count the work.

    Args:
        blade: The samples and totals are written.
        body: The tissue.
        visits: For searches.
        pose: Pose of the blade.
    """
    spine, totals, law = blade.spine, blade.totals, blade.toughness
    if spine.n_pressing == 0:
        return
    for k in range(len(spine.state)):
        if spine.state[k] < PRESSING:
            continue
        side = spine_side(spine, pose, k)
        p = touched_point(spine, body, body.positions, k)
        press = press_of(spine, k, side, pose.normal, p, law)
        before = press_energy(spine, k, press)
        if press.depth <= 0.0:
            spine.state[k] = IDLE
            spine.n_pressing -= 1
            spine.energy[k] = 0.0
            continue
        if press.surplus > 0.0:
            _pierce(blade, body, visits, k, side, pose.normal)
            continue
        if spine.state[k] == PIERCING:
            _follow(blade, body, visits, k, side)
            p = touched_point(spine, body, body.positions, k)
        stretch = sub(side.at, p)
        spine.held[k, 0] = press.beside - dot(stretch, side.beside)
        spine.held[k, 1] = press.across - dot(stretch, pose.normal)
        left = press_of(spine, k, side, pose.normal, p, law)
        spine.energy[k] = press_energy(spine, k, left)
        totals.work_of_friction += before - spine.energy[k]


@kernel
def _follow(blade: BladeState, body: Body, visits: Visits, k: int, side: SpineSide) -> None:
    """Move the point that piercing sample `k` holds sideways with it: tissue behind it is open.

    In strained tissue the point could come to lie deeper, and press harder by no work of the blade.
    """
    spine = blade.spine
    stretch = sub(side.at, touched_point(spine, body, body.positions, k))
    depth = dot(stretch, side.outward)
    _move_by(blade, body, visits, k, axpy(-depth, side.outward, stretch))
    moved = sub(side.at, touched_point(spine, body, body.positions, k))
    deeper = dot(moved, side.outward) - depth
    if deeper > 0.0:
        _move_by(blade, body, visits, k, scale(deeper, side.outward))


@kernel
def _move_by(blade: BladeState, body: Body, visits: Visits, k: int, step: Vec3) -> bool:
    """Move the point of sample `k` through the material by `step` [m]; whether it stays inside."""
    spine = blade.spine
    p = add(vec3(spine.rest, k), to_material(body, spine.tetrahedron[k], step))
    return move_point(blade, body, visits, k, p)


@kernel
def _pierce(
    blade: BladeState, body: Body, visits: Visits, k: int, side: SpineSide, normal: Vec3
) -> None:
    """Move the point that sample `k` of the tip's end holds forward to where it holds; pay for it.

    Once the skin is broken it is no tougher than the rest.
    """
    spine, totals, law = blade.spine, blade.totals, blade.toughness
    p = touched_point(spine, body, body.positions, k)
    before = press_energy(spine, k, press_of(spine, k, side, normal, p, law))
    spine.state[k] = PIERCING
    again = press_of(spine, k, side, normal, p, law)
    toughness, t = tip_toughness(spine, k, law), spine.tetrahedron[k]
    is_inside = _move_by(blade, body, visits, k, scale(again.surplus, side.outward))
    moved = sub(touched_point(spine, body, body.positions, k), p)
    cost = toughness * spine.length[k] * max(dot(moved, side.outward), 0.0)
    left = 0.0
    if is_inside:
        q = touched_point(spine, body, body.positions, k)
        left = press_energy(spine, k, press_of(spine, k, side, normal, q, law))
    else:
        spine.state[k] = IDLE
        spine.n_pressing -= 1
    spine.energy[k] = left
    count_cutting(blade, body, t, cost)
    totals.work_of_breaking += before - left - cost


@kernel
def clear_spine_forces(spine: SpineContacts, body: Body, external: FloatArray) -> None:
    """Set the forces on the nodes that the blunt sides press on to zero."""
    if spine.n_pressing == 0:
        return
    for k in range(len(spine.state)):
        if spine.state[k] >= PRESSING:
            for q in range(4):
                node = body.tetrahedra[spine.tetrahedron[k], q]
                external[node, 0] = external[node, 1] = external[node, 2] = 0.0


@kernel
def add_spine_stiffness(spine: SpineContacts, body: Body, stiffness: FloatArray) -> None:
    """Add the rows of the blunt sides to x of `stiffness` [N/m], shape (capacity, 3)."""
    if spine.n_pressing == 0:
        return
    for k in range(len(spine.state)):
        if spine.state[k] >= PRESSING:
            for q in range(4):
                node = body.tetrahedra[spine.tetrahedron[k], q]
                stiffness[node, 0] += spine.stiffness[k] * spine.weights[k, q]


@kernel
def highest_spine_frequency(
    spine: SpineContacts, body: Body, frequency_squared: FloatArray, stiffness: FloatArray
) -> float:
    """Return a bound on w^2 [1/s2] over the nodes that the blunt sides press on.

    It is that of the body, `frequency_squared`, and of `stiffness` together.
    """
    worst = 0.0
    if spine.n_pressing > 0:
        for k in range(len(spine.state)):
            if spine.state[k] >= PRESSING:
                for q in range(4):
                    node = body.tetrahedra[spine.tetrahedron[k], q]
                    if not body.fixed[node]:
                        own = frequency_squared[node] + stiffness[node, 0] / body.masses[node]
                        worst = max(worst, own)
    return worst
