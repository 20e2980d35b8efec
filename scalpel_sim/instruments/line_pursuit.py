"""Leads a blade along a line on the skin as that lies now: as a surgeon looks where she cuts.

Tissue dents under a blade, is dragged along by it and pushed aside. The tip of a stroke with a
course is carried by what its line has moved: the blade goes on along the line as it lies, at the
speed of the stroke, and the clock of the stroke stands where the line is above the tip. So the
blade presses in until the skin is open, and goes on until it has passed the last of the line.
"""

import math
from typing import NamedTuple, Protocol

import numpy as np

from bridge import TissueLink
from scalpel_sim.strokes.skin_course import SkinCourse
from scalpel_sim.strokes.stroke import Stroke
from tissue import FloatArray, IntArray

LOOK_EVERY = 0.01
"""Time between two looks at the line [s]: that of a fast camera. Each takes the body's state, and
ten times as many gave no better cut."""

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


class LinePursuit:
    """Leads the clock and the shift of strokes with a course.

    Args:
        stroke: The strokes.
        link: The body that they cut.
        progress: How far they have come; written.
    """

    def __init__(self, stroke: Stroke, link: TissueLink, progress: PursuitState) -> None:
        self._stroke, self._link, self._progress = stroke, link, progress

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
            look.moved[:] = course.displacements(self._link.snapshot(), look.holders)
            look.next = progress.now + LOOK_EVERY
        if step <= 0.0:
            return
        at, later = progress.at, min(progress.at + _FASTEST_CLOCK * step, end)
        line = _CarriedLine(self._stroke, course, look.moved)
        place, plan = line.place(at), self._stroke.pose(at)
        tip = plan.tip + progress.shift
        planned = float(np.linalg.norm(self._stroke.pose(at + step).tip - plan.tip))
        error = place - tip
        if line.rests(at):
            share = course.speed * step / max(_BACK_ASIDE, float(np.linalg.norm(error)))
            tip = tip + min(share, 1.0) * error
            progress.at = min(at + step, end)
        else:
            ahead = line.ahead(at)
            edge = (plan.heel - plan.tip) / np.linalg.norm(plan.heel - plan.tip)
            error = error - (error @ ahead) * ahead
            in_depth = (error @ edge) * edge
            way = ahead + (error - in_depth) / _BACK_ASIDE + in_depth / _BACK_IN_DEPTH
            length = max(planned, _SLOWEST * course.speed * step)
            tip = tip + length / np.linalg.norm(way) * way
            progress.at = _passed(ahead, tip, (at, place), (later, line.place(later)))
        if end - progress.at < _AT_END:
            progress.at = end
        shift = tip - self._stroke.pose(progress.at).tip
        progress.shift = (float(shift[0]), float(shift[1]), float(shift[2]))

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


class _CarriedLine(NamedTuple):
    """The way of the tip as the line on the skin carries it."""

    stroke: Stroke
    course: SkinCourse
    moved: FloatArray
    """Displacement of each place of the course [m], shape (n, 3)."""

    def place(self, at: float) -> FloatArray:
        """Return where the tip is to be at an instant of the clock [m], shape (3,)."""
        times, moved = self.course.times, self.moved
        after = int(np.searchsorted(times, at))
        if after == 0 or after == len(times):
            return np.asarray(self.stroke.pose(at).tip + moved[min(after, len(times) - 1)])
        share = (at - times[after - 1]) / (times[after] - times[after - 1])
        carried = moved[after - 1] + share * (moved[after] - moved[after - 1])
        return np.asarray(self.stroke.pose(at).tip + carried)

    def rests(self, at: float) -> bool:
        """Return whether the tip rests, and the blade turns."""
        ways = self._near(at)
        return bool(max(map(np.linalg.norm, ways)) < _STILL)

    def _near(self, at: float) -> tuple[FloatArray, FloatArray]:
        """Return the way of the tip in its plan just before an instant, and just after [m]."""
        before, tip, after = (self.stroke.pose(at + t).tip for t in (-_AT_END, 0.0, _AT_END))
        return tip - before, after - tip

    def ahead(self, at: float) -> FloatArray:
        """Return the direction of the line there, as it lies; shape (3,)."""
        tip = self.stroke.pose(at).tip
        before, after = self._near(at)
        near = before if np.linalg.norm(after) < _STILL else after  # at the end of a leg
        planned = near / np.linalg.norm(near)
        later = at + _PEEK / self.course.speed
        chord = self.stroke.pose(later).tip - tip
        way = self.place(later) - self.place(at)
        if chord @ planned < _STRAIGHT * np.linalg.norm(chord) or way @ planned <= 0.0:
            return np.asarray(planned)
        return np.asarray(way / np.linalg.norm(way))


def _passed(
    ahead: FloatArray,
    tip: FloatArray,
    earlier: tuple[float, FloatArray],
    later: tuple[float, FloatArray],
) -> float:
    """Return the instant at which the line is level with the tip [s], between two others.

    Args:
        ahead: Direction of the line.
        tip: Where the tip is [m].
        earlier: The first of the two, and the place of the line then [m].
        later: The other one.
    """
    behind, before = (float((place - tip) @ ahead) for _, place in (earlier, later))
    if behind >= 0.0:
        return earlier[0]
    if before <= 0.0:
        return later[0]
    return earlier[0] + (later[0] - earlier[0]) * behind / (behind - before)
