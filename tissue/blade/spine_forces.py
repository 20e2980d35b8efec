"""Forces of the blade's blunt sides on the nodes, sliding against friction, and piercing."""

from tissue.blade.blade_state import (
    BladeState,
    add_reaction,
    add_to_node,
    running_totals,
    store_totals,
)
from tissue.blade.edge import BladeMotion, BladePose, displacement_of
from tissue.blade.material_frame import to_material
from tissue.blade.spine_contact import (
    IDLE,
    PIERCING,
    PRESSING,
    BluntContacts,
    BluntSide,
    blunt_side,
    press_energy,
    press_force,
    press_of,
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
def apply_blunt_forces(
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
    blunt, pose = blade.blunt, motion.pose
    if blunt.n_pressing == 0:
        return
    seconds = share * dt
    running = running_totals(blade.totals)
    for k in range(len(blunt.state)):
        if blunt.state[k] < PRESSING:
            continue
        side = blunt_side(blunt, pose, k)
        p = touched_point(blunt, body, positions, k)
        press = press_of(blunt, k, side, pose.normal, p, blade.toughness)
        force = press_force(blunt, k, side, pose.normal, press)
        for q in range(4):
            node = body.tetrahedra[blunt.tetrahedron[k], q]
            running = add_to_node(external, running, node, blunt.weights[k, q], force, seconds)
        running = add_reaction(running, p, force, displacement_of(motion, p), share, seconds)
    store_totals(blade.totals, running)


@kernel
def slip_blunt_sides(blade: BladeState, body: Body, visits: Visits, pose: BladePose) -> None:
    """Let samples slide, pierce and come free after a step; count the work.

    Args:
        blade: The samples and totals are written.
        body: The tissue.
        visits: For searches.
        pose: Pose of the blade.
    """
    blunt, totals, law = blade.blunt, blade.totals, blade.toughness
    if blunt.n_pressing == 0:
        return
    for k in range(len(blunt.state)):
        if blunt.state[k] < PRESSING:
            continue
        side = blunt_side(blunt, pose, k)
        p = touched_point(blunt, body, body.positions, k)
        press = press_of(blunt, k, side, pose.normal, p, law)
        before = press_energy(blunt, k, press)
        if press.depth <= 0.0:
            blunt.state[k] = IDLE
            blunt.n_pressing -= 1
            blunt.energy[k] = 0.0
            continue
        if press.surplus > 0.0:
            _pierce(blade, body, visits, k, side, pose.normal)
            continue
        if blunt.state[k] == PIERCING:
            _follow(blade, body, visits, k, side)
            p = touched_point(blunt, body, body.positions, k)
        stretch = sub(side.at, p)
        blunt.held[k, 0] = press.beside - dot(stretch, side.beside)
        blunt.held[k, 1] = press.across - dot(stretch, pose.normal)
        left = press_of(blunt, k, side, pose.normal, p, law)
        blunt.energy[k] = press_energy(blunt, k, left)
        totals.work_of_friction += before - blunt.energy[k]


@kernel
def _follow(blade: BladeState, body: Body, visits: Visits, k: int, side: BluntSide) -> None:
    """Let the point that piercing sample `k` holds follow it sideways: what it parted is open."""
    blunt = blade.blunt
    stretch = sub(side.at, touched_point(blunt, body, body.positions, k))
    sideways = axpy(-dot(stretch, side.outward), side.outward, stretch)
    _move_by(blade, body, visits, k, sideways)


@kernel
def _move_by(blade: BladeState, body: Body, visits: Visits, k: int, step: Vec3) -> bool:
    """Move the point of sample `k` through the material by `step` [m]; whether it stays inside."""
    blunt = blade.blunt
    p = add(vec3(blunt.rest, k), to_material(body, blunt.tetrahedron[k], step))
    return move_point(blade, body, visits, k, p)


@kernel
def _pierce(
    blade: BladeState, body: Body, visits: Visits, k: int, side: BluntSide, normal: Vec3
) -> None:
    """Move the point that sample `k` of the tip's end holds forward to where it holds; pay for it.

    Once the skin is broken it is no tougher than the rest.
    """
    blunt, totals, law = blade.blunt, blade.totals, blade.toughness
    p = touched_point(blunt, body, body.positions, k)
    before = press_energy(blunt, k, press_of(blunt, k, side, normal, p, law))
    blunt.state[k] = PIERCING
    again = press_of(blunt, k, side, normal, p, law)
    is_inside = _move_by(blade, body, visits, k, scale(again.surplus, side.outward))
    moved = sub(touched_point(blunt, body, body.positions, k), p)
    cost = tip_toughness(blunt, k, law) * blunt.length[k] * max(dot(moved, side.outward), 0.0)
    left = 0.0
    if is_inside:
        q = touched_point(blunt, body, body.positions, k)
        left = press_energy(blunt, k, press_of(blunt, k, side, normal, q, law))
    else:
        blunt.state[k] = IDLE
        blunt.n_pressing -= 1
    blunt.energy[k] = left
    totals.work_of_cutting += cost
    totals.work_of_breaking += before - left - cost


@kernel
def clear_blunt_forces(blunt: BluntContacts, body: Body, external: FloatArray) -> None:
    """Set the forces on the nodes that the blunt sides press on to zero."""
    if blunt.n_pressing == 0:
        return
    for k in range(len(blunt.state)):
        if blunt.state[k] >= PRESSING:
            for q in range(4):
                node = body.tetrahedra[blunt.tetrahedron[k], q]
                external[node, 0] = external[node, 1] = external[node, 2] = 0.0


@kernel
def add_blunt_stiffness(blunt: BluntContacts, body: Body, stiffness: FloatArray) -> None:
    """Add the rows of the blunt sides to x of `stiffness` [N/m], shape (capacity, 3)."""
    if blunt.n_pressing == 0:
        return
    for k in range(len(blunt.state)):
        if blunt.state[k] >= PRESSING:
            for q in range(4):
                node = body.tetrahedra[blunt.tetrahedron[k], q]
                stiffness[node, 0] += blunt.stiffness[k] * blunt.weights[k, q]


@kernel
def highest_blunt_frequency(
    blunt: BluntContacts, body: Body, frequency_squared: FloatArray, stiffness: FloatArray
) -> float:
    """Return a bound on w^2 [1/s2] over the nodes that the blunt sides press on.

    It is that of the body, `frequency_squared`, and of `stiffness` together.
    """
    worst = 0.0
    if blunt.n_pressing > 0:
        for k in range(len(blunt.state)):
            if blunt.state[k] >= PRESSING:
                for q in range(4):
                    node = body.tetrahedra[blunt.tetrahedron[k], q]
                    if not body.fixed[node]:
                        own = frequency_squared[node] + stiffness[node, 0] / body.masses[node]
                        worst = max(worst, own)
    return worst
