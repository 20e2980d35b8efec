"""Keeps a simulation at most at real time, or slower, and measures how fast it runs."""

import time
from collections.abc import Callable

SHORTEST_PAUSE = 5e-3
"""Shortest pause that slows a run to real time [s]: a shorter one costs more than it gains."""

MOST_BEHIND = 0.05
"""How far simulated time may fall behind and be caught up [s]. What is lost beyond is lost: a blade
that is led by hand must not run ahead of the hand afterwards."""

MEASURED_OVER = 0.5
"""Wall time over which the factor is measured [s]."""


class Pace:
    """Slows a simulation to real time, or to slow motion, where it is faster.

    Args:
        clock: Wall time [s].
        sleep: Waits for so many seconds.
        shortest_pause: Shortest pause that slows the run [s]; 0: it waits after each frame, as a
            device needs it.
    """

    def __init__(
        self,
        clock: Callable[[], float] = time.monotonic,
        sleep: Callable[[float], None] = time.sleep,
        shortest_pause: float = SHORTEST_PAUSE,
    ) -> None:
        self.rate = 1.0
        """Simulated time over wall time, at most."""
        self.factor = 1.0
        """Simulated time over wall time, lately."""
        self._clock, self._sleep = clock, sleep
        self._shortest_pause = shortest_pause
        self._due = self._since = clock()
        self._simulated = 0.0

    def wait(self, dt: float) -> None:
        """Wait, after a frame of that length [s], until its end is due."""
        self._due += dt / self.rate
        self._simulated += dt
        now = self._clock()
        if self._due - now > self._shortest_pause:
            self._sleep(self._due - now)
            now = self._clock()
        self._due = max(self._due, now - MOST_BEHIND)
        if now - self._since >= MEASURED_OVER:
            self.factor = self._simulated / (now - self._since)
            self._simulated, self._since = 0.0, now

    def go_on(self) -> None:
        """Forget the time that has passed since the last frame: it was not the simulation's."""
        self._due = self._since = self._clock()
        self._simulated = 0.0
