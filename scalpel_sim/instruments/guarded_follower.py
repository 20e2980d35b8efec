"""Leads a blade along strokes that a force may stop, or that end when the body is parted.

Strokes have a clock of their own. It goes with simulated time, stands while a stroke waits, goes
back while the blade is drawn back, and comes to rest when a stroke is through. From there the blade
goes through the air to where the next stroke begins. Where nothing of this happens the poses are
those of a stroke without a guard, to the bit.
"""

import math
from typing import NamedTuple, Protocol

import numpy as np

from bridge import TissueFrame, TissueLink
from scalpel_sim.instruments.line_pursuit import LastLook, LinePursuit
from scalpel_sim.instruments.stroke_follower import NO_SHIFT, Commanded, StrokeFollower
from scalpel_sim.strokes.asked import n_large
from scalpel_sim.strokes.guard import LONGEST_PURSUIT, Guard
from scalpel_sim.strokes.sequence import through_air
from scalpel_sim.strokes.skin_course import SkinCourse
from scalpel_sim.strokes.stroke import Stroke
from scalpel_sim.strokes.timing import SPEED_UP_TIME
from tissue import StepResult, pieces_of

LONGEST_WAY = 10.0
"""Longest time on the way through the air from a stroke to the next [s]: a metre."""

SLOWER_FROM = 0.8
"""Share of its limit from which on a force makes a stroke that waits slower: at the limit it
stands. Going and standing in turn would shake the arm."""

GOING, SLOWING, DRAWING_BACK, RESTING = "going", "slowing", "drawing back", "resting"
OVER, ENDED = "leading over", "ended"

AS_PLANNED, THROUGH, STOPPED = "as planned", "through", "stopped at the limit of force"
GAVE_UP, DREW_BACK = "gave up waiting at the limit of force", "drew back at the limit of force"
DRAGGED = "gave up: the tissue went along with the blade"
"""Ends that a stroke may have."""


class StrokeEnd(NamedTuple):
    """End of one of the strokes in turn."""

    how: str
    """`AS_PLANNED`, or another of these."""
    time: float
    """Simulated time then [s]."""


class StrokeProgress:
    """Progress of strokes: all that a saved state must know of them.

    Args:
        stroke: The strokes, with their guards.
    """

    def __init__(self, stroke: Stroke) -> None:
        self.force = 0.0
        """Force on the blade in the last frame [N]."""
        self.at = 0.0
        """Their clock [s]."""
        self.mode = GOING
        self.since = 0.0
        """When the mode began [s], simulated time."""
        self.at_since = 0.0
        """Their clock then [s]."""
        self.now = 0.0
        """Simulated time of the last frame [s]."""
        self.part = 0
        """Which of the strokes it is, or the next one."""
        self.has_begun = False
        self.waited = 0.0
        """Time that it has lost by waiting [s]."""
        self.lost = 0.0
        """Time that it has lost because the tissue went along with the blade [s]."""
        self.n_before = 0
        """Number of pieces before it, where that counts."""
        self.area_before = 0.0
        """Area that was cut before it [m2]."""
        self.area_looked_at = 0.0
        """Area that was cut when pieces were counted last [m2]."""
        self.box: tuple[float, ...] = ()
        """Lowest and highest corner of the body when the blade was led over [m]."""
        self.shift = NO_SHIFT
        """Where the tip is led to, from where the plan has it [m]."""
        courses = [guard.course for guard in stroke.guards]
        self.looks = [LastLook(0 if each is None else len(each.times)) for each in courses]
        """The last look at the line of each stroke."""
        self.ends: tuple[StrokeEnd, ...] = ()
        """Ends of strokes so far."""

    def enter(self, mode: str) -> None:
        """Begin a mode now."""
        self.mode, self.since, self.at_since = mode, self.now, self.at

    @property
    def seconds(self) -> float:
        """Time since the mode began [s]."""
        return self.now - self.since


class Sensed(Protocol):
    """Facts that the bridge knows of the tissue."""

    @property
    def result(self) -> StepResult | None:
        """Result of the last step."""


class GuardedFollower:
    """Leads a hand along strokes with guards. See `Controller`.

    Args:
        hand: Holds a blade already, or shows where to lead one.
        stroke: The path of the blade, tissue frame, with its guards.
        frame: Where the tissue lies in the world.
        link: The tissue.
        bridge: Has its last result.
        progress: How far the strokes have come; written.
    """

    def __init__(
        self,
        hand: Commanded,
        stroke: Stroke,
        frame: TissueFrame,
        link: TissueLink,
        bridge: Sensed,
        progress: StrokeProgress,
    ) -> None:
        self._hand, self._stroke, self._frame = hand, stroke, frame
        self._link, self._bridge, self.progress = link, bridge, progress
        self._pursuit = LinePursuit(stroke, link, progress)
        self._node_size = math.nan
        self._follower = StrokeFollower(hand, stroke, frame)
        self._way: tuple[tuple[float, int], Stroke, StrokeFollower] | None = None

    def lead(self, t: float) -> None:
        """Lead the blade to its pose at simulated time `t` [s], a step after the last one."""
        progress = self.progress
        step, progress.now = t - progress.now, t
        if progress.mode == GOING:
            self._go(step)
        elif progress.mode == SLOWING:
            self._slow_down()
        elif progress.mode == DRAWING_BACK:
            self._draw_back()
        elif progress.mode == RESTING:
            self._rest()
        elif progress.mode == OVER and progress.seconds >= self._way_over()[0].duration:
            progress.part += 1
            progress.at = self._guard.begin
            progress.enter(GOING)
        if progress.mode != ENDED and not self._is_following:
            self._pursuit.leave(step)
        if progress.mode == OVER:
            self._way_over()[1].lead(progress.seconds, progress.shift)
        else:
            self._follower.lead(progress.at, progress.shift)

    @property
    def _is_following(self) -> bool:
        """Whether the blade follows a line on the skin."""
        progress = self.progress
        return progress.mode == GOING and progress.has_begun and self._guard.course is not None

    @property
    def _guard(self) -> Guard:
        return self._stroke.guards[self.progress.part]

    def _go(self, step: float) -> None:
        """Go on along the path, or note what keeps the blade from it."""
        progress, guards = self.progress, self._stroke.guards
        if progress.part < len(guards) and progress.at >= self._guard.begin:
            guard = self._guard
            if not progress.has_begun:
                self._begin()
            if guard.is_until_through and self._is_through():
                self._end(THROUGH, SLOWING)
                return
            if guard.at_limit == "wait":
                step = self._yield_to_force(step)
            elif progress.force > guard.force_limit:
                is_back = guard.at_limit == "draw back"
                self._end(*((DREW_BACK, DRAWING_BACK) if is_back else (STOPPED, ENDED)))
            if progress.mode != GOING:
                return
            if guard.course is not None:
                self._follow_line(guard.course, step)
        # Without a delay this is the time itself, to the bit.
        progress.at = progress.at_since + progress.seconds
        while progress.part < len(guards) and progress.at >= self._guard.end:
            self._end(AS_PLANNED, GOING, is_new=False)
            progress.part += 1
            progress.has_begun = False
        if progress.at >= self._stroke.duration:
            progress.enter(ENDED)

    def _begin(self) -> None:
        """Note what was there before a stroke."""
        progress = self.progress
        progress.has_begun, progress.waited, progress.lost = True, 0.0, 0.0
        progress.area_before = progress.area_looked_at = self._area
        if self._guard.is_until_through:
            progress.n_before = self._n_pieces()

    def _follow_line(self, course: SkinCourse, step: float) -> None:
        """Go on along a line for a time [s], and stop when the tissue goes along for too long."""
        progress, guard = self.progress, self._guard
        before = progress.at
        self._pursuit.go(progress.part, course, guard.end, step)
        progress.enter(GOING)  # from there
        progress.lost += max(step - (progress.at - before), 0.0)
        if progress.lost > LONGEST_PURSUIT * (guard.end - guard.begin):
            self._end(DRAGGED, ENDED)

    def _yield_to_force(self, step: float) -> float:
        """Return the time [s] that is left of a step.

        It goes slower the nearer the force is to its limit, and stops when too much time is lost.
        """
        progress, guard = self.progress, self._guard
        room = (guard.force_limit - progress.force) / ((1.0 - SLOWER_FROM) * guard.force_limit)
        if room >= 1.0:
            return step
        rate = max(room, 0.0)
        progress.waited += (1.0 - rate) * step
        if guard.course is None:
            progress.at += rate * step
            progress.enter(GOING)  # from there
        if progress.waited > guard.patience:
            self._end(GAVE_UP, ENDED)
        return rate * step

    def _end(self, how: str, mode: str, is_new: bool = True) -> None:
        """Note how a stroke has ended, and enter a mode if that is new."""
        self.progress.ends += (StrokeEnd(how, self.progress.now),)
        if is_new:
            self.progress.enter(mode)

    def _slow_down(self) -> None:
        """Bring the clock to rest as at the end of a path: by half a cosine."""
        progress, whole = self.progress, SPEED_UP_TIME
        share = min(progress.seconds / whole, 1.0)
        gone = 0.5 * whole * (share + math.sin(math.pi * share) / math.pi)
        progress.at = min(progress.at_since + gone, self._guard.end)
        if share == 1.0:
            progress.enter(RESTING)

    def _draw_back(self) -> None:
        """Turn the clock back to where the stroke began."""
        progress = self.progress
        progress.at = max(progress.at_since - progress.seconds, self._guard.begin)
        if progress.at == self._guard.begin:
            progress.enter(RESTING)

    def _rest(self) -> None:
        """Rest as after the stroke, and go to the next one, if there is one."""
        progress = self.progress
        if progress.seconds < self._guard.pause:
            return
        progress.has_begun = False
        if progress.part + 1 == len(self._stroke.guards):
            progress.enter(ENDED)
            return
        boxes = self._link.chunks().boxes
        progress.box = (*boxes[:, 0].min(axis=0).tolist(), *boxes[:, 1].max(axis=0).tolist())
        progress.enter(OVER)

    def _way_over(self) -> tuple[Stroke, StrokeFollower]:
        """Return the way through the air to the next stroke, which a loaded state makes again."""
        progress = self.progress
        key = (progress.at_since, progress.part)
        if self._way is None or self._way[0] != key:
            start = self._stroke.pose(progress.at_since)
            end = self._stroke.pose(self._stroke.guards[progress.part + 1].begin)
            way = through_air(start, end, np.array(progress.box).reshape(2, 3))
            self._way = key, way, StrokeFollower(self._hand, way, self._frame)
        return self._way[1:]

    @property
    def _area(self) -> float:
        result = self._bridge.result
        return 0.0 if result is None else result.cut_area

    def _is_through(self) -> bool:
        """Whether the stroke has parted the body, and no tissue is on the edge."""
        progress, result = self.progress, self._bridge.result
        if result is None or result.anchored_length > 0.0:
            return False
        if result.cut_area in (progress.area_before, progress.area_looked_at):
            return False
        progress.area_looked_at = result.cut_area
        return self._n_pieces() > progress.n_before

    def _n_pieces(self) -> int:
        """Return the number of pieces, crumbs left out."""
        if math.isnan(self._node_size):
            self._node_size = self._link.cut_report().node_size
        volumes = np.array([piece.rest_volume for piece in pieces_of(self._link.snapshot())])
        return n_large(volumes, self._node_size)
