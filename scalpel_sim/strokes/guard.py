"""`Guard`: what may end one of the strokes in turn before or after its plan, or make it wait."""

import math
from typing import NamedTuple

from scalpel_sim.strokes.skin_course import SkinCourse

LONGEST_PURSUIT = 2.0
"""Time that a stroke may lose while it follows a line that the blade drags along, in durations of
its plan: a slack sheet of skin took 1.2, and a body that nothing holds goes along for ever."""


class Guard(NamedTuple):
    """One of the strokes in turn on its own clock, which stands while it waits."""

    begin: float
    """When it begins, on the clock of all strokes together [s]."""
    end: float
    """When it ends at the latest: where it has gone as far as it may."""
    pause: float = 0.0
    """Time for which the blade rests afterwards [s]."""
    force_limit: float = math.inf
    """Force on the blade at which something is done [N]."""
    at_limit: str = "stop"
    """Action at the limit: see `StrokeTable.at_limit`."""
    patience: float = 0.0
    """Time that it may lose by waiting before it stops [s]."""
    is_until_through: bool = False
    """Whether it ends as soon as the body is parted."""
    course: SkinCourse | None = None
    """The line on the skin that it follows as that lies; None: it goes as planned."""

    def moved_by(self, seconds: float, pause: float) -> "Guard":
        """Return it on a clock that is ahead [s], with a rest afterwards [s]."""
        course = None if self.course is None else self.course.moved_by(seconds)
        moved = self._replace(begin=self.begin + seconds, end=self.end + seconds, course=course)
        return moved._replace(pause=pause)

    @property
    def longest_delay(self) -> float:
        """Time that it may take beyond its plan by itself [s], ways through the air excluded."""
        delay = 0.0 if self.course is None else LONGEST_PURSUIT * (self.end - self.begin)
        if self.force_limit == math.inf:
            return delay
        own = {"wait": self.patience, "draw back": self.end - self.begin}.get(self.at_limit, 0.0)
        return delay + own
