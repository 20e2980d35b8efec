"""Leads a blade along a line on the skin as that lies now: as a surgeon looks where she cuts.

Tissue dents under a blade, is dragged along by it and pushed aside. The tip of a stroke with a
course is carried by what its line has moved: the blade goes on along the line as it lies, at the
speed of the stroke, and the clock of the stroke stands where the line is above the tip. So the
blade presses in until the skin is open, and goes on until it has passed the last of the line. There
it goes back with the tissue that it has dragged along: drawn out while that pulls at its edge, the
tissue would spring back over it, and be cut beyond the line.
"""

import math
from typing import NamedTuple, Protocol

import numpy as np

from bridge import TissueLink
from scalpel_sim.quaternions import Vector
from scalpel_sim.strokes.path import pose_on_path
from scalpel_sim.strokes.skin_course import SkinCourse
from scalpel_sim.strokes.stroke import Stroke
from tissue import FloatArray, IntArray
from tissue.support import SameTypes, Vec3, add, axpy, dot, kernel, lerp, norm, scale, sub, vec3

LOOK_EVERY = 0.01
"""Time between two looks at the line [s]: that of a fast camera. Ten times as many gave no better
cut."""

_BACK_ASIDE = 1.5e-3
"""Way along the line over which the tip makes up for a distance aside [m]: as that over which its
edge turns at a bend. On less the blade pushes soft tissue aside rather than cut back to the line;
on 20 mm a curved cut in the organ strayed by a millimetre."""

_BACK_IN_DEPTH = 0.3e-3
"""Way along the line over which it makes up for an error of depth [m]: along itself an edge meets
friction alone, and a sheet of skin sinks and rises by millimetres within as many of the line."""

_SLOWEST = 0.2
"""Least share of its speed that the blade has, but where it rests: its plan slows down to rest at
the end of the line, which tissue may have moved on."""

_FASTEST_CLOCK = 2.0
"""Seconds of the clock in one of time, at most: where tissue springs back by the blade."""

_PEEK = 1e-3
"""Distance ahead to which the direction of the line is taken [m]."""

_STRAIGHT = 0.9
"""Cosine of the bend within that distance from which on there is a corner, and the direction of
the plan is taken."""

_AT_END = 2e-3
"""Time before the end of a path that counts as its end [s]: two frames."""

_STILL = 1e-9
"""Way of the tip within that time below which it rests [m]: rounding of a turn about the tip. In
the first of a ramp it goes a hundred times as far."""

_BACK_TO_PLAN = 0.05
"""Speed at which a tip that has left its line goes back to its plan [m/s]."""


class PursuitState(Protocol):
    """Progress of strokes, as far as a pursuit changes it."""

    at: float
    """Clock of the strokes [s]."""
    now: float
    """Simulated time [s]."""
    shift: tuple[float, float, float]
    """Where the tip is led to, from where the plan has it [m]."""
    looks: list["LastLook"]
    """The last look at the line of each stroke; none of a stroke that follows no line."""


class LastLook:
    """The last look at a line: a part of the state of a run.

    Args:
        n: Number of places of the line.
    """

    def __init__(self, n: int) -> None:
        self.next = -math.inf
        """When the next one is due [s], simulated time."""
        self.holders: IntArray = np.full(n, -1)
        """Tetrahedron that held each place, or -1."""
        self.moved: FloatArray = np.zeros((n, 3))
        """Displacement of each place since the stroke was planned [m]."""
        self.before: FloatArray = np.zeros(3)
        """That of the last place before the tip went along the line [m]."""


class LinePursuit:
    """Leads the clock and the shift of strokes with a course.

    Args:
        stroke: The strokes.
        link: The body that they cut.
        progress: How far they have come; written.
    """

    def __init__(self, stroke: Stroke, link: TissueLink, progress: PursuitState) -> None:
        self._stroke, self._link, self._progress = stroke, link, progress
        self._pursue = SameTypes(pursue)

    def go(self, part: int, course: SkinCourse, end: float, step: float) -> None:
        """Go on along the line.

        Args:
            part: Which of the strokes it is.
            course: Its course.
            end: When it ends, on the clock [s].
            step: Time for which it goes [s].
        """
        progress = self._progress
        look = progress.looks[part]
        if progress.now >= look.next:
            look.moved[:] = course.displacements(self._link, look.holders)
            look.next = progress.now + LOOK_EVERY
            if progress.at < course.times[0]:
                look.before[:] = look.moved[-1]
        if progress.at >= course.times[-1]:
            self._go_back(look, course)
        if step > 0.0:
            clock, line = (progress.at, step, end), (self._stroke.path, course.times, look.moved)
            progress.at, progress.shift = self._pursue.call(
                *clock, progress.shift, course.speed, *line
            )

    def _go_back(self, look: LastLook, course: SkinCourse) -> None:
        """Put the end of the line back along the line to where it was before the blade came."""
        forward = self._stroke.pose(course.times[-1]).forward
        dragged = float((look.moved[-1] - look.before) @ forward)
        look.moved[-1] -= max(dragged, 0.0) * forward

    def leave(self, step: float) -> None:
        """Bring the tip back to the plan.

        Args:
            step: Time for which it goes there [s].
        """
        x, y, z = self._progress.shift
        size = math.sqrt(x * x + y * y + z * z)
        if size > 0.0:
            share = max(1.0 - _BACK_TO_PLAN * step / size, 0.0)
            self._progress.shift = (share * x, share * y, share * z)


@kernel
def pursue(
    at: float, step: float, end: float, shift: Vector, speed: float,
    path: FloatArray, times: FloatArray, moved: FloatArray,
) -> tuple[float, Vector]:  # fmt: skip
    """Go on along a line as it lies; return the clock [s] and the shift [m] then.

    Args:
        at: The clock [s].
        step: Time for which the tip goes [s].
        end: When the stroke ends, on the clock [s].
        shift: Where the tip is led to, from where the plan has it [m].
        speed: Speed of the stroke [m/s].
        path: `Stroke.path`.
        times: When the tip is to be below each place of the line [s], shape (n,).
        moved: Displacement of each of these places since the stroke was planned [m], shape (n, 3).
    """
    line = _CarriedLine(path, times, moved)
    plan, (x, y, z) = _tip(line, at), shift
    tip, place = add(plan, Vec3(x, y, z)), _place(line, at)
    before, after = sub(plan, _tip(line, at - _AT_END)), sub(_tip(line, at + _AT_END), plan)
    error = sub(place, tip)
    if max(norm(before), norm(after)) < _STILL:  # it rests, and the blade turns
        share = speed * step / max(_BACK_ASIDE, norm(error))
        tip = axpy(min(share, 1.0), error, tip)
        at = min(at + step, end)
    else:
        near = before if norm(after) < _STILL else after  # at the end of a leg
        ahead = _ahead(line, at, speed, scale(1.0 / norm(near), near))
        edge = _edge(line, at)
        error = axpy(-dot(error, ahead), ahead, error)
        in_depth = scale(dot(error, edge), edge)
        way = axpy(1.0 / _BACK_ASIDE, sub(error, in_depth), ahead)
        way = axpy(1.0 / _BACK_IN_DEPTH, in_depth, way)
        length = max(norm(sub(_tip(line, at + step), plan)), _SLOWEST * speed * step)
        tip = axpy(length / norm(way), way, tip)
        later = min(at + _FASTEST_CLOCK * step, end)
        behind, before_it = dot(sub(place, tip), ahead), dot(sub(_place(line, later), tip), ahead)
        at = _passed(at, behind, later, before_it)
    if end - at < _AT_END:
        at = end
    moved_by = sub(tip, _tip(line, at))
    return at, (moved_by.x, moved_by.y, moved_by.z)


class _CarriedLine(NamedTuple):
    """The way of the tip as the line on the skin carries it: see `pursue`."""

    path: FloatArray
    times: FloatArray
    moved: FloatArray


@kernel
def _tip(line: _CarriedLine, at: float) -> Vec3:
    """Return where the tip is in its plan at an instant of the clock [m]."""
    x, y, z = pose_on_path(at, line.path)[0]
    return Vec3(x, y, z)


@kernel
def _edge(line: _CarriedLine, at: float) -> Vec3:
    """Return the unit vector from tip to heel in the plan."""
    x, y, z = pose_on_path(at, line.path)[1]
    edge = sub(Vec3(x, y, z), _tip(line, at))
    return scale(1.0 / norm(edge), edge)


@kernel
def _place(line: _CarriedLine, at: float) -> Vec3:
    """Return where the tip is to be at an instant of the clock [m]."""
    times, moved = line.times, line.moved
    after = int(np.searchsorted(times, at))
    if after == 0 or after == len(times):
        return add(_tip(line, at), vec3(moved, min(after, len(times) - 1)))
    share = (at - times[after - 1]) / (times[after] - times[after - 1])
    return add(_tip(line, at), lerp(share, vec3(moved, after - 1), vec3(moved, after)))


@kernel
def _ahead(line: _CarriedLine, at: float, speed: float, planned: Vec3) -> Vec3:
    """Return the direction of the line as it lies; that of its plan at a corner."""
    later = at + _PEEK / speed
    chord = sub(_tip(line, later), _tip(line, at))
    way = sub(_place(line, later), _place(line, at))
    if dot(chord, planned) < _STRAIGHT * norm(chord) or dot(way, planned) <= 0.0:
        return planned
    return scale(1.0 / norm(way), way)


@kernel
def _passed(earlier: float, behind: float, later: float, before: float) -> float:
    """Return the instant at which the line is level with the tip [s], between two others.

    Args:
        earlier: The first of the two [s].
        behind: Distance of the line from the tip then, ahead [m].
        later: The other one [s].
        before: Distance of the line from the tip then [m].
    """
    if behind >= 0.0:
        return earlier
    if before <= 0.0:
        return later
    return earlier + (later - earlier) * behind / (behind - before)
