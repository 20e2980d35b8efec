"""Fibres that the blade catches, bends and cuts: ligaments.

A fibre is a string from a point of the tissue to another end. Where the cutting edge sweeps across
it, the string goes around the edge without friction, so that its tension T is the same on both
sides of the bend. The edge feels T (u + w), with the unit vectors u and w from the bend to the two
ends. Forces act at the ends and at the bend along the string: they and their torques cancel.

The edge goes into the fibre where that force in the plane of the blade exceeds

    F = toughness * section / diameter,

as an edge does that cuts a bar of that width: the work of cutting is toughness times area (A. G.
Atkins, The Science and Engineering of Cutting, 2009). The bend then lags behind the edge until the
force is F, and the energy that the string loses is spent on cutting: the fibre is severed when
toughness times section is spent, neither more nor less. So the blade pays as it moves, at any
speed, and a slack fibre is not cut before it is taut. Until it is cut the bend stays at its place
on the edge, so that an edge that is drawn along itself pulls, and cuts, too. A fibre of section A
is round: its diameter is 2 sqrt(A / pi). An impulse of the whole energy in one step would have to
be E / v on a blade of speed v: unbounded on a slow one.
"""

from typing import Final

from tissue.blade.blade_state import RunningTotals, add_reaction, running_totals, store_totals
from tissue.blade.edge import (
    LEAST_SINE,
    BladePose,
    Edge,
    blade_coordinates,
    displacement_of,
    motion_at,
    pose_at,
)
from tissue.blade.wrench import WrenchReport, report_fibre
from tissue.core.array_types import FloatArray
from tissue.core.jit import kernel
from tissue.core.vec3 import Vec3, add, axpy, dot, lerp, norm, scale, store, sub, vec3
from tissue.forces.attachments import (
    CAUGHT,
    SEVERED,
    STRAIGHT,
    Attachments,
    attached_point,
    count_impulse,
    end_after_step,
    holding_energy,
    other_end,
    other_motion,
    pull_other_end,
    spread_force,
    tension_of,
)
from tissue.forces.fibre_shape import bent_fibre, cutting_resistance, end_zone
from tissue.forces.step_context import StepContext

_ROUNDING: Final = 1e-9
"""Sine of an angle by which a straight fibre may seem bent, by rounding. Smaller, and the edge
would lose fibres that it has just caught; larger, and it would keep some that it has left."""

_DOUBLINGS: Final = 64
"""Doublings of a slip at most, from a thousandth of the stretch: more than any geometry takes."""

_HALVINGS: Final = 50
"""Halvings of an interval, which then is shorter than the rounding of its ends."""


@kernel
def _bend_point(pose: BladePose, along: float, behind: float) -> Vec3:
    """Return the point of the blade's plane at these coordinates [m]."""
    return axpy(-behind, pose.forward, axpy(along, pose.along, pose.tip))


@kernel
def add_caught_forces(
    context: StepContext,
    edge: Edge,
    positions: FloatArray,
    velocities: FloatArray,
    when: float,
    share: float,
    dt: float,
) -> None:
    """Add the forces of caught fibres on nodes and blade; count impulses and works.

    Args:
        context: Fibres, totals of the blade and forces on nodes are written.
        edge: The cutting edge over the time step.
        positions: Positions of the nodes [m].
        velocities: Their velocities [m/s].
        when: Instant, as a fraction of the time step.
        share: Weight of this evaluation in the integral over the time step.
        dt: Length of the time step [s].
    """
    fibres, motion, seconds = context.attachments, motion_at(edge, when), share * dt
    running = running_totals(context.blade.totals)
    for p in range(len(fibres.nodes)):
        if fibres.state[p] != CAUGHT:
            continue
        x = attached_point(fibres, p, positions)
        other = other_end(fibres, p, positions, when)
        bend = _bend_point(motion.pose, fibres.place[p, 0], fibres.place[p, 1])
        bent = bent_fibre(fibres, p, x, bend, other)
        if bent.length <= fibres.length[p]:
            continue
        of_blade = displacement_of(motion, bend)
        of_end = other_motion(fibres, p, velocities, dt)
        of_point = scale(dt, attached_point(fibres, p, velocities))
        stretching = dot(bent.to_point, sub(of_point, of_blade)) + dot(
            bent.to_end, sub(of_end, of_blade)
        )
        tension = tension_of(fibres, p, bent.length, stretching / dt)
        spring = fibres.stiffness[p] * (bent.length - fibres.length[p])
        fibres.dissipated += share * (tension - spring) * stretching
        at_end = scale(tension, bent.to_end)
        if fibres.is_tie[p] == 1:
            pull_other_end(fibres, p, scale(-1.0, at_end), context.stages.external)
        else:
            fibres.work += share * dot(at_end, of_end)
        count_impulse(fibres, p, other, scale(seconds, at_end))
        spread_force(fibres, p, scale(-tension, bent.to_point), context.stages.external)
        pushed = scale(-tension, add(bent.to_point, bent.to_end))
        of_fibre = axpy(seconds, pushed, running.impulse_on_tissue)
        running = RunningTotals(running.impulse, running.angular_impulse, of_fibre, running.work)
        running = add_reaction(running, bend, pushed, of_blade, share, seconds)
    store_totals(context.blade.totals, running)


@kernel
def slip_fibres(fibres: Attachments, positions: FloatArray, edge: Edge, when: float) -> None:
    """Move the edge into the fibres that it has caught, and release those that it has left.

    Args:
        fibres: Written.
        positions: Positions of the nodes [m].
        edge: The cutting edge over the time step.
        when: Instant, as a fraction of the time step.
    """
    pose = pose_at(edge, when)
    for p in range(len(fibres.nodes)):
        if fibres.state[p] != CAUGHT:
            continue
        x = attached_point(fibres, p, positions)
        other = other_end(fibres, p, positions, when)
        if not _back_off(fibres, p, pose, x, other):
            free_fibre(fibres, p, x, other, _bend_of(fibres, p, pose))
            continue
        _slip(fibres, p, pose, x, other)
        store(fibres.bend, p, _bend_of(fibres, p, pose))


@kernel
def _bend_of(fibres: Attachments, p: int, pose: BladePose) -> Vec3:
    """Return where fibre `p` goes around the blade [m]."""
    return _bend_point(pose, fibres.place[p, 0], fibres.place[p, 1])


@kernel
def _back_off(fibres: Attachments, p: int, pose: BladePose, x: Vec3, end: Vec3) -> bool:
    """Straighten a fibre in its slit where the edge has backed off.

    Returns:
        Whether the edge still holds the fibre: it is not ahead of the edge, or past its ends.
    """
    along, behind = fibres.place[p, 0], fibres.place[p, 1]
    if along < 0.0 or along > pose.length:
        return False
    if _pulls_forward(fibres, p, pose, behind, x, end) <= _ROUNDING:
        return True
    low, high = 0.0, behind
    if _pulls_forward(fibres, p, pose, 0.0, x, end) > _ROUNDING:
        return False
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        if _pulls_forward(fibres, p, pose, middle, x, end) > _ROUNDING:
            high = middle
        else:
            low = middle
    before = _energy_at(fibres, p, _bend_of(fibres, p, pose), x, end)
    fibres.place[p, 1] = low
    fibres.released += before - _energy_at(fibres, p, _bend_of(fibres, p, pose), x, end)
    return True


@kernel
def _pulls_forward(
    fibres: Attachments, p: int, pose: BladePose, behind: float, x: Vec3, end: Vec3
) -> float:
    """Return how far a fibre with its bend so far behind the edge would pull forward [1]."""
    bent = bent_fibre(fibres, p, x, _bend_point(pose, fibres.place[p, 0], behind), end)
    return dot(add(bent.to_point, bent.to_end), pose.forward)


@kernel
def _energy_at(fibres: Attachments, p: int, bend: Vec3, x: Vec3, end: Vec3) -> float:
    """Return the energy of a fibre that goes around a bend [J]."""
    return holding_energy(fibres, p, norm(sub(x, bend)) + norm(sub(end, bend)))


@kernel
def _slip(fibres: Attachments, p: int, pose: BladePose, x: Vec3, end: Vec3) -> None:
    """Move the bend behind the edge until the edge bears it; spend the energy on cutting."""
    bend = _bend_of(fibres, p, pose)
    cutting, most = fibres.toughness[p] * fibres.section[p], cutting_resistance(fibres, p)
    force = force_at(fibres, p, bend, x, end)
    in_plane = axpy(-dot(force, pose.normal), pose.normal, force)
    size = norm(in_plane)
    if size <= most:
        return
    direction = scale(1.0 / size, in_plane)
    # The energy is convex in the place of the bend: along a line the force falls.
    high = 1e-3 * (norm(sub(x, bend)) + norm(sub(end, bend)) - fibres.length[p])
    for _ in range(_DOUBLINGS):
        if dot(force_at(fibres, p, axpy(high, direction, bend), x, end), direction) <= most:
            break
        high *= 2.0
    low = 0.0
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        if dot(force_at(fibres, p, axpy(middle, direction, bend), x, end), direction) > most:
            low = middle
        else:
            high = middle
    before = _energy_at(fibres, p, bend, x, end)
    taken = before - _energy_at(fibres, p, axpy(high, direction, bend), x, end)
    left = cutting - fibres.spent[p]
    if taken >= left:
        fibres.severing += left
        fibres.released += before - left
        fibres.spent[p], fibres.state[p] = cutting, SEVERED
        fibres.n_caught -= 1
        return
    fibres.severing += taken
    fibres.spent[p] += taken
    fibres.place[p, 0] += high * dot(direction, pose.along)
    fibres.place[p, 1] -= high * dot(direction, pose.forward)


@kernel
def force_at(fibres: Attachments, p: int, bend: Vec3, x: Vec3, end: Vec3) -> Vec3:
    """Return the elastic force of a fibre on its bend [N].

    Args:
        fibres: All of them.
        p: The fibre.
        bend: Where it is bent [m].
        x: Its point of the tissue [m].
        end: Its other end [m].
    """
    bent = bent_fibre(fibres, p, x, bend, end)
    tension = tension_of(fibres, p, max(bent.length, fibres.length[p]), 0.0)
    return scale(tension, add(bent.to_point, bent.to_end))


@kernel
def catch_fibre(
    fibres: Attachments, p: int, pose: BladePose, x: Vec3, end: Vec3, of_fibre: float
) -> None:
    """Bend a fibre, still straight, around the blade where it passes through its plane.

    The edge is ahead of that place by what it moved since it met the fibre.

    Args:
        fibres: Written.
        p: The fibre.
        pose: The blade.
        x: Its point of the tissue [m].
        end: Its other end [m].
        of_fibre: Where the edge met it, as a fraction from that point.
    """
    chord = sub(end, x)
    across = dot(chord, pose.normal)
    if abs(across) > LEAST_SINE * norm(chord):
        of_fibre = min(max(dot(sub(pose.tip, x), pose.normal) / across, 0.0), 1.0)
    at = blade_coordinates(pose, lerp(of_fibre, x, end))
    fibres.place[p, 0] = min(max(at.along, 0.0), pose.length)
    fibres.place[p, 1] = max(at.behind, 0.0)
    bend = _bend_of(fibres, p, pose)
    store(fibres.bend, p, bend)
    fibres.released += holding_energy(fibres, p, norm(chord))
    fibres.released -= _energy_at(fibres, p, bend, x, end)
    fibres.state[p] = CAUGHT
    fibres.n_caught += 1


@kernel
def free_fibre(fibres: Attachments, p: int, x: Vec3, end: Vec3, bend: Vec3) -> None:
    """Release a fibre from the blade, which is then straight; count the energy that this releases.

    Args:
        fibres: Written.
        p: The fibre.
        x: Its point of the tissue [m].
        end: Its other end [m].
        bend: Where it was bent [m].
    """
    fibres.released += _energy_at(fibres, p, bend, x, end)
    fibres.released -= holding_energy(fibres, p, norm(sub(end, x)))
    fibres.state[p], fibres.side[p] = STRAIGHT, 0.0
    fibres.n_caught -= 1


@kernel
def free_fibres(fibres: Attachments, positions: FloatArray) -> None:
    """Release all fibres from the blade, which is taken away."""
    for p in range(len(fibres.nodes)):
        if fibres.state[p] == CAUGHT:
            x = attached_point(fibres, p, positions)
            end = other_end(fibres, p, positions, 0.0)
            free_fibre(fibres, p, x, end, vec3(fibres.bend, p))
        fibres.side[p] = 0.0


@kernel
def write_stiffening(
    fibres: Attachments, positions: FloatArray, travel: float, out: FloatArray
) -> None:
    """Write by what factor each attachment is stiffer than its springs, at most, in an increment.

    A bent fibre under tension resists to a motion of its point across it, too, by the tension over
    the distance to the bend.

    Args:
        fibres: The attachments.
        positions: Positions of the nodes [m].
        travel: How far the edge moves in the increment, at most [m].
        out: The factors, shape (n,); written.
    """
    for p in range(len(fibres.nodes)):
        out[p] = 1.0
        if fibres.state[p] == CAUGHT:
            x, bend = attached_point(fibres, p, positions), vec3(fibres.bend, p)
            near = norm(sub(x, bend))
            far = norm(sub(end_after_step(fibres, p, positions), bend))
            length = near + far + 2.0 * travel
            if fibres.is_tie[p] == 1:  # either end is a point of the tissue
                near = min(near, far)
            stretch = max(length - fibres.length[p], 0.0)
            out[p] += stretch / max(near - travel, end_zone(fibres, p))
        elif fibres.state[p] == SEVERED:
            out[p] = 0.0


@kernel
def report_fibres(
    report: WrenchReport, fibres: Attachments, positions: FloatArray, edge: Edge
) -> None:
    """Add the forces of caught fibres at the end of a time step to the report of the blade."""
    pose = pose_at(edge, 1.0)
    for p in range(len(fibres.nodes)):
        if fibres.state[p] != CAUGHT:
            continue
        x = attached_point(fibres, p, positions)
        end = end_after_step(fibres, p, positions)
        bend = _bend_of(fibres, p, pose)
        force = force_at(fibres, p, bend, x, end)
        bent = bent_fibre(fibres, p, x, bend, end)
        along = norm(add(bent.to_point, bent.to_end))
        # A fibre that is being cut pulls no harder when the blade continues.
        is_cut = norm(force) >= (1.0 - _ROUNDING) * cutting_resistance(fibres, p)
        stiffness = 0.0 if is_cut else fibres.stiffness[p] * along * along
        report_fibre(report, pose, bend, scale(-1.0, force), stiffness)
