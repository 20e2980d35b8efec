"""Strands that the blade catches, bends and cuts: ligaments.

A strand is a string from a point of the tissue to another end. Where the cutting edge sweeps across
it, the string goes around the edge without friction, so that its tension T is the same on both
sides of the bend. The edge feels T (u + w), with the unit vectors u and w from the bend to the two
ends. Forces act at the ends and at the bend along the string: they and their torques cancel.

The edge goes into the strand where that force in the plane of the blade exceeds

    F = toughness * section / diameter,

as an edge does that cuts a bar of that width: the work of cutting is toughness times area (A. G.
Atkins, The Science and Engineering of Cutting, 2009). The bend then lags behind the edge until the
force is F, and the energy that the string loses is spent on cutting: the strand is severed when
toughness times section is spent, neither more nor less. So the blade pays as it moves, at any
speed, and a slack strand is not cut before it is taut. Until it is cut the bend stays at its place
on the edge, so that an edge that is drawn along itself pulls, and cuts, too. A strand of section A
is round: its diameter is 2 sqrt(A / pi). An impulse of the whole energy in one step would have to
be E / v on a blade of speed v: unbounded on a slow one.
"""

import math
from typing import Final, NamedTuple

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
from tissue.blade.wrench import WrenchReport, report_strand
from tissue.core.array_types import FloatArray
from tissue.core.jit import kernel
from tissue.core.vec3 import Vec3, add, axpy, dot, lerp, norm, scale, store, sub, vec3
from tissue.integrators.attachments import (
    CAUGHT,
    SEVERED,
    STRAIGHT,
    Attachments,
    attached_point,
    count_impulse,
    holding_energy,
    spread_force,
    tension_of,
)
from tissue.integrators.step_context import StepContext

_ROUNDING: Final = 1e-9
"""Sine of an angle by which a straight strand may seem bent, by rounding. Smaller, and the edge
would lose strands that it has just caught; larger, and it would keep some that it has left."""

_DOUBLINGS: Final = 64
"""Doublings of a slip at most, from a thousandth of the stretch: more than any geometry takes."""

_HALVINGS: Final = 50
"""Halvings of an interval, which then is shorter than the rounding of its ends."""


class _Bent(NamedTuple):
    """A strand that goes around a bend."""

    to_point: Vec3
    """Unit vector from the bend to the point of the tissue."""
    to_end: Vec3
    """Unit vector from the bend to the other end."""
    length: float
    """Length of the strand [m]."""


@kernel
def _radius(attachments: Attachments, p: int) -> float:
    """Return the radius of strand `p` [m]."""
    return math.sqrt(attachments.section[p] / math.pi)


@kernel
def _resistance(strands: Attachments, p: int) -> float:
    """Return the force at which the edge goes into strand `p` [N]."""
    force: float = strands.toughness[p] * strands.section[p] / (2.0 * _radius(strands, p))
    return force


@kernel
def _bent(attachments: Attachments, p: int, x: Vec3, bend: Vec3, end: Vec3) -> _Bent:
    """Return strand `p` from `x` around a bend to its other end [m].

    Nearer to an end than its radius a strand has no direction: there the vectors are shorter.
    """
    radius = _radius(attachments, p)
    a, b = sub(x, bend), sub(end, bend)
    la, lb = norm(a), norm(b)
    return _Bent(scale(1.0 / max(la, radius), a), scale(1.0 / max(lb, radius), b), la + lb)


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
    """Add the forces of caught strands on nodes and blade; count impulses and works.

    Args:
        context: Strands, totals of the blade and forces on nodes are written.
        edge: The cutting edge over the time step.
        positions: Positions of the nodes [m].
        velocities: Their velocities [m/s].
        when: Instant, as a fraction of the time step.
        share: Weight of this evaluation in the integral over the time step.
        dt: Length of the time step [s].
    """
    strands, motion, seconds = context.attachments, motion_at(edge, when), share * dt
    running = running_totals(context.blade.totals)
    for p in range(len(strands.nodes)):
        if strands.state[p] != CAUGHT:
            continue
        x = attached_point(strands, p, positions)
        begin, end = vec3(strands.begin, p), vec3(strands.end, p)
        other = lerp(when, begin, end)
        bend = _bend_point(motion.pose, strands.place[p, 0], strands.place[p, 1])
        bent = _bent(strands, p, x, bend, other)
        if bent.length <= strands.length[p]:
            continue
        of_blade, of_end = displacement_of(motion, bend), sub(end, begin)
        of_point = scale(dt, attached_point(strands, p, velocities))
        way = dot(bent.to_point, sub(of_point, of_blade)) + dot(bent.to_end, sub(of_end, of_blade))
        tension = tension_of(strands, p, bent.length, way / dt)
        spring = strands.stiffness[p] * (bent.length - strands.length[p])
        strands.dissipated += share * (tension - spring) * way
        at_end = scale(tension, bent.to_end)
        strands.work += share * dot(at_end, of_end)
        count_impulse(strands, p, other, scale(seconds, at_end))
        spread_force(strands, p, scale(-tension, bent.to_point), context.stages.external)
        pushed = scale(-tension, add(bent.to_point, bent.to_end))
        of_strand = axpy(seconds, pushed, running.impulse_on_tissue)
        running = RunningTotals(running.impulse, running.angular_impulse, of_strand, running.work)
        running = add_reaction(running, bend, pushed, of_blade, share, seconds)
    store_totals(context.blade.totals, running)


@kernel
def slip_strands(strands: Attachments, positions: FloatArray, edge: Edge, when: float) -> None:
    """Let the edge go into the strands that it has caught, and go from those that it has left.

    Args:
        strands: Written.
        positions: Positions of the nodes [m].
        edge: The cutting edge over the time step.
        when: Instant, as a fraction of the time step.
    """
    pose = pose_at(edge, when)
    for p in range(len(strands.nodes)):
        if strands.state[p] != CAUGHT:
            continue
        x = attached_point(strands, p, positions)
        other = lerp(when, vec3(strands.begin, p), vec3(strands.end, p))
        if not _back_off(strands, p, pose, x, other):
            free_strand(strands, p, x, other, _bend_of(strands, p, pose))
            continue
        _slip(strands, p, pose, x, other)
        store(strands.bend, p, _bend_of(strands, p, pose))


@kernel
def _bend_of(strands: Attachments, p: int, pose: BladePose) -> Vec3:
    """Return where strand `p` goes around the blade [m]."""
    return _bend_point(pose, strands.place[p, 0], strands.place[p, 1])


@kernel
def _back_off(strands: Attachments, p: int, pose: BladePose, x: Vec3, end: Vec3) -> bool:
    """Let a strand lie straight in its slit where the edge has backed off.

    Returns:
        Whether the edge still holds the strand: it is not ahead of the edge, or beside it.
    """
    along, behind = strands.place[p, 0], strands.place[p, 1]
    if along < 0.0 or along > pose.length:
        return False
    if _pulls_forward(strands, p, pose, behind, x, end) <= _ROUNDING:
        return True
    low, high = 0.0, behind
    if _pulls_forward(strands, p, pose, 0.0, x, end) > _ROUNDING:
        return False
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        if _pulls_forward(strands, p, pose, middle, x, end) > _ROUNDING:
            high = middle
        else:
            low = middle
    before = _energy_at(strands, p, _bend_of(strands, p, pose), x, end)
    strands.place[p, 1] = low
    strands.released += before - _energy_at(strands, p, _bend_of(strands, p, pose), x, end)
    return True


@kernel
def _pulls_forward(
    strands: Attachments, p: int, pose: BladePose, behind: float, x: Vec3, end: Vec3
) -> float:
    """Return how far a strand with its bend so far behind the edge would pull forward [1]."""
    bent = _bent(strands, p, x, _bend_point(pose, strands.place[p, 0], behind), end)
    return dot(add(bent.to_point, bent.to_end), pose.forward)


@kernel
def _energy_at(strands: Attachments, p: int, bend: Vec3, x: Vec3, end: Vec3) -> float:
    """Return the energy of a strand that goes around a bend [J]."""
    return holding_energy(strands, p, norm(sub(x, bend)) + norm(sub(end, bend)))


@kernel
def _slip(strands: Attachments, p: int, pose: BladePose, x: Vec3, end: Vec3) -> None:
    """Let the bend lag behind the edge until the edge bears it, and spend the energy on cutting."""
    bend = _bend_of(strands, p, pose)
    cutting, most = strands.toughness[p] * strands.section[p], _resistance(strands, p)
    force = force_at(strands, p, bend, x, end)
    in_plane = axpy(-dot(force, pose.normal), pose.normal, force)
    size = norm(in_plane)
    if size <= most:
        return
    way = scale(1.0 / size, in_plane)
    # The energy is convex in the place of the bend: along a line the force falls.
    high = 1e-3 * (norm(sub(x, bend)) + norm(sub(end, bend)) - strands.length[p])
    for _ in range(_DOUBLINGS):
        if dot(force_at(strands, p, axpy(high, way, bend), x, end), way) <= most:
            break
        high *= 2.0
    low = 0.0
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        if dot(force_at(strands, p, axpy(middle, way, bend), x, end), way) > most:
            low = middle
        else:
            high = middle
    before = _energy_at(strands, p, bend, x, end)
    taken = before - _energy_at(strands, p, axpy(high, way, bend), x, end)
    left = cutting - strands.spent[p]
    if taken >= left:
        strands.severing += left
        strands.released += before - left
        strands.spent[p], strands.state[p] = cutting, SEVERED
        strands.n_caught -= 1
        return
    strands.severing += taken
    strands.spent[p] += taken
    strands.place[p, 0] += high * dot(way, pose.along)
    strands.place[p, 1] -= high * dot(way, pose.forward)


@kernel
def force_at(strands: Attachments, p: int, bend: Vec3, x: Vec3, end: Vec3) -> Vec3:
    """Return the elastic force of a strand on its bend [N].

    Args:
        strands: All of them.
        p: The strand.
        bend: Where it is bent [m].
        x: Its point of the tissue [m].
        end: Its other end [m].
    """
    bent = _bent(strands, p, x, bend, end)
    tension = tension_of(strands, p, max(bent.length, strands.length[p]), 0.0)
    return scale(tension, add(bent.to_point, bent.to_end))


@kernel
def catch_strand(
    strands: Attachments, p: int, pose: BladePose, x: Vec3, end: Vec3, of_strand: float
) -> None:
    """Let a strand, still straight, go around the blade where it passes through its plane.

    The edge is ahead of that place by what it moved since it met the strand.

    Args:
        strands: Written.
        p: The strand.
        pose: The blade.
        x: Its point of the tissue [m].
        end: Its other end [m].
        of_strand: Where the edge met it, as a fraction from that point.
    """
    chord = sub(end, x)
    across = dot(chord, pose.normal)
    if abs(across) > LEAST_SINE * norm(chord):
        of_strand = min(max(dot(sub(pose.tip, x), pose.normal) / across, 0.0), 1.0)
    at = blade_coordinates(pose, lerp(of_strand, x, end))
    strands.place[p, 0] = min(max(at.along, 0.0), pose.length)
    strands.place[p, 1] = max(at.behind, 0.0)
    bend = _bend_of(strands, p, pose)
    store(strands.bend, p, bend)
    strands.released += holding_energy(strands, p, norm(chord))
    strands.released -= _energy_at(strands, p, bend, x, end)
    strands.state[p] = CAUGHT
    strands.n_caught += 1


@kernel
def free_strand(strands: Attachments, p: int, x: Vec3, end: Vec3, bend: Vec3) -> None:
    """Let the blade go from a strand, which is then straight; count the energy that this releases.

    Args:
        strands: Written.
        p: The strand.
        x: Its point of the tissue [m].
        end: Its other end [m].
        bend: Where it was bent [m].
    """
    strands.released += _energy_at(strands, p, bend, x, end)
    strands.released -= holding_energy(strands, p, norm(sub(end, x)))
    strands.state[p], strands.side[p] = STRAIGHT, 0.0
    strands.n_caught -= 1


@kernel
def free_strands(strands: Attachments, positions: FloatArray) -> None:
    """Let the blade, which is taken away, go from all strands."""
    for p in range(len(strands.nodes)):
        if strands.state[p] == CAUGHT:
            x, end = attached_point(strands, p, positions), vec3(strands.begin, p)
            free_strand(strands, p, x, end, vec3(strands.bend, p))
        strands.side[p] = 0.0


@kernel
def write_stiffening(
    strands: Attachments, positions: FloatArray, travel: float, out: FloatArray
) -> None:
    """Write by what factor each attachment is stiffer than its springs, at most, in an increment.

    A bent strand under tension resists to a motion of its point across it, too, by the tension over
    the distance to the bend.

    Args:
        strands: The attachments.
        positions: Positions of the nodes [m].
        travel: How far the edge moves in the increment, at most [m].
        out: The factors, shape (n,); written.
    """
    for p in range(len(strands.nodes)):
        out[p] = 1.0
        if strands.state[p] == CAUGHT:
            x, bend = attached_point(strands, p, positions), vec3(strands.bend, p)
            near = norm(sub(x, bend))
            length = near + norm(sub(vec3(strands.end, p), bend)) + 2.0 * travel
            stretch = max(length - strands.length[p], 0.0)
            out[p] += stretch / max(near - travel, _radius(strands, p))
        elif strands.state[p] == SEVERED:
            out[p] = 0.0


@kernel
def report_strands(
    report: WrenchReport, strands: Attachments, positions: FloatArray, edge: Edge
) -> None:
    """Add the forces of caught strands at the end of a time step to the report of the blade."""
    pose = pose_at(edge, 1.0)
    for p in range(len(strands.nodes)):
        if strands.state[p] != CAUGHT:
            continue
        x, end = attached_point(strands, p, positions), vec3(strands.end, p)
        bend = _bend_of(strands, p, pose)
        force = force_at(strands, p, bend, x, end)
        bent = _bent(strands, p, x, bend, end)
        along = norm(add(bent.to_point, bent.to_end))
        # A strand that is being cut pulls no harder when the blade goes on.
        is_cut = norm(force) >= (1.0 - _ROUNDING) * _resistance(strands, p)
        stiffness = 0.0 if is_cut else strands.stiffness[p] * along * along
        report_strand(report, pose, bend, scale(-1.0, force), stiffness)
