"""How much of the tissue's wrench an arm may feel, by how long the tissue has been silent."""

import logging

_log = logging.getLogger(__name__)

WARN_AFTER = 0.010
"""[s] of silence: ten periods of a haptic device. Longer than a busy machine's usual hiccup."""

DECAY_AFTER = 0.050
"""[s] of silence, after which the wrench fades. Until then what the tissue last said, and its
stiffness there, is a fair guess: a hand moves by a few millimetres in that time."""

ZERO_AFTER = 0.500
"""[s] of silence, after which nothing is felt: nobody knows any more what is at the blade. The
same time after which the driver of a surgical robot (AMBF) takes its commander for gone."""

RAMP = 0.1
"""[s] in which a wrench comes back whole. A hand that is pushed by surprise takes about as long to
answer; a wrench that returned at once would throw it."""


class Watchdog:
    """A factor between 0 and 1 for what the arm feels: down with silence, and up again by a ramp.

    A device that holds the last force of a tissue that has died pushes for ever. So the wrench
    fades between `DECAY_AFTER` and `ZERO_AFTER`, linearly, and when answers come again it returns
    in `RAMP`.
    """

    def __init__(self) -> None:
        self._gain = 1.0
        self._is_silent = False
        self.n_silent = 0
        """Frames in which the tissue had been silent for `WARN_AFTER` or more."""
        self.n_faded = 0
        """Frames in which less than the whole wrench was felt, by fading or by the ramp."""

    def gain(self, silence: float, dt: float) -> float:
        """Return the factor for the next `dt` [s].

        Args:
            silence: How long the arm has waited for the tissue by now [s].
            dt: Length of the frame [s].
        """
        if silence >= WARN_AFTER:
            self.n_silent += 1
            if not self._is_silent:
                _log.warning(
                    "the tissue has been silent for %.0f ms: what the arm feels is its last "
                    "answer, and fades from %.0f ms on",
                    1e3 * silence,
                    1e3 * DECAY_AFTER,
                )
        self._is_silent = silence >= WARN_AFTER
        allowed = min(1.0, max(0.0, (ZERO_AFTER - silence) / (ZERO_AFTER - DECAY_AFTER)))
        self._gain = min(allowed, self._gain + dt / RAMP)
        self.n_faded += self._gain < 1.0
        return self._gain

    def let_go(self) -> None:
        """Feel nothing now, and return by the ramp."""
        self._gain = 0.0
