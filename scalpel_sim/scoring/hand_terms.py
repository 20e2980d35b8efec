"""Terms of one instrument: its force in each frame, and its way from control step to step."""

import math

from tissue import Wrench

_OF_JERK = 4
"""Places from which a third derivative follows."""


class HandTerms:
    """Force, way and hold of an instrument so far.

    Args:
        name: Name of the instrument.
        limit: Force that counts as no excess [N]; None: any.
        can_hold: Whether it is a grasper.
    """

    def __init__(self, name: str, limit: float | None, can_hold: bool) -> None:
        self.name = name
        self.limit = limit
        self.can_hold = can_hold
        self.force = 0.0
        """Greatest force [N]."""
        self.impulse = 0.0
        """Integral of the size of the force over time [N s]."""
        self.path_length = 0.0
        """Length of its way, from control step to control step [m]."""
        self.dropped = 0
        """Number of control steps in which it held no tissue, and did in the one before."""
        self._n_held = 0
        self._n_steps = 0
        self._squares = 0.0
        self._last: tuple[tuple[float, ...], ...] = ()
        self._held_last = False

    def begin_way(self) -> None:
        """Begin its way anew: it was put elsewhere."""
        self.path_length, self._squares = 0.0, 0.0
        self._last, self._n_steps, self._n_held = (), 0, 0

    def feel(self, wrench: Wrench, dt: float) -> None:
        """Count the wrench on it in a frame of `dt` [s]."""
        x, y, z = wrench.numbers[:3]
        size = math.sqrt(x * x + y * y + z * z)
        if size > self.force:
            self.force = size
        self.impulse += size * dt

    def move(self, place: tuple[float, ...], holds: bool, dt: float) -> None:
        """Count a control step.

        Args:
            place: Where it is now, x, y and z [m].
            holds: Whether it holds tissue.
            dt: Length of the control step [s].
        """
        self._last = (*self._last[-3:], place)
        self._n_steps += 1
        if self._n_steps >= 2:
            self.path_length += math.dist(*self._last[-2:])
        if self._n_steps >= _OF_JERK:
            for a, b, c, d in zip(*self._last, strict=True):
                self._squares += ((d - a - 3.0 * (c - b)) / dt**3) ** 2
        self.dropped += self._held_last and not holds
        self._held_last = holds
        self._n_held += holds

    @property
    def force_above(self) -> float:
        """Greatest force beyond the limit [N]; 0 without one."""
        return 0.0 if self.limit is None else max(self.force - self.limit, 0.0)

    @property
    def jerk(self) -> float:
        """Root mean square of the third derivative of its place [m/s3], by differences."""
        n = self._n_steps - _OF_JERK + 1
        return math.sqrt(self._squares / n) if n > 0 else 0.0

    @property
    def held(self) -> float | None:
        """Share of the control steps in which it held tissue; None of what cannot."""
        return self._n_held / max(self._n_steps, 1) if self.can_hold else None
