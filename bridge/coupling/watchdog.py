"""How much of the tissue's wrench an arm may feel while the tissue does not answer."""

import logging

_log = logging.getLogger(__name__)

WARN_AFTER = 0.010
"""Silence [s] after which a warning is logged: ten periods of a haptic device, and longer than the
usual delays of a busy machine."""

DECAY_AFTER = 0.050
"""Silence [s] after which the wrench fades. Until then the tissue's last answer and its stiffness
are a fair estimate: a hand moves by a few millimetres in that time."""

ZERO_AFTER = 0.500
"""Silence [s] after which nothing is felt, because the state at the blade is unknown. AMBF, a
driver for surgical robots, waits as long before it considers its commander lost."""

RAMP = 0.1
"""Time [s] in which a wrench returns from zero to its full value. A hand that is pushed by surprise
takes about as long to react; a wrench that returned at once would throw it."""


class Watchdog:
    """A factor between 0 and 1 for the wrench that the arm feels.

    A device that holds the last force of a tissue that has stopped would push for ever. So the
    factor falls linearly between `DECAY_AFTER` and `ZERO_AFTER` of silence, and rises over `RAMP`
    when answers come again.
    """

    def __init__(self) -> None:
        self._gain = 1.0
        self._is_silent = False
        self.n_silent = 0
        """Frames in which the tissue had been silent for `WARN_AFTER` or more."""
        self.n_faded = 0
        """Frames in which less than the full wrench was felt, by fading or by the ramp."""

    def gain(self, silence: float, dt: float) -> float:
        """Return the factor for the next `dt` [s].

        Args:
            silence: How long the arm has waited for the tissue by now [s].
            dt: Length of the frame [s].
        """
        if silence == 0.0 and self._gain == 1.0:
            self._is_silent = False
            return 1.0
        if silence >= WARN_AFTER:
            self.n_silent += 1
            if not self._is_silent:
                _log.warning(
                    "the tissue has not answered for %.0f ms: the arm feels its last answer, which "
                    "fades after %.0f ms",
                    1e3 * silence,
                    1e3 * DECAY_AFTER,
                )
        self._is_silent = silence >= WARN_AFTER
        allowed = min(1.0, max(0.0, (ZERO_AFTER - silence) / (ZERO_AFTER - DECAY_AFTER)))
        self._gain = min(allowed, self._gain + dt / RAMP)
        self.n_faded += self._gain < 1.0
        return self._gain

    def reset(self) -> None:
        """Set the factor to zero; it rises again over `RAMP`."""
        self._gain = 0.0
