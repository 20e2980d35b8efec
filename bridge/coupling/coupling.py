"""What the arm may feel of what the tissue says: finite, within the device's limits, passive."""

import math

import numpy as np

from bridge.coupling.limits import DeviceLimits, factor_within, size_of
from bridge.coupling.passivity import Passivity, PassivityCounters, Travel
from bridge.coupling.watchdog import Watchdog
from tissue import FloatArray, Wrench

__all__ = ["ABSURD_FORCE", "ABSURD_TORQUE", "Coupling", "CouplingError", "DeviceLimits"]

ABSURD_FORCE = 1e3
"""[N]. Soft tissue under a scalpel answers with newtons; a kilonewton is a simulation that blows
up, and its direction means nothing. Cut down to the device's limit it would still be the hardest
push that the device has, so it becomes zero instead."""

ABSURD_TORQUE = 1e2
"""[N m]. The same, at a lever of 0.1 m, the length of a scalpel."""

ABSURD_FRAMES_IN_A_ROW = 10
"""After so many frames in a row with an absurd wrench the run stops: 10 ms at 1 kHz, as far back as
a run may be rolled. A single one may be a node that the blade flicks and that comes to rest."""

_AT_REST = Travel(np.zeros(6), 0.0, 0.0)


class CouplingError(RuntimeError):
    """The tissue does not answer with a wrench that an arm may feel. The arm must let go of it."""


class Coupling:
    """Turns the tissue's wrench into one that the arm may feel, and counts what it changed.

    In this order:

    - A wrench that is not finite raises at once: a NaN in a tissue never heals. An absurd wrench
      counts as zero, and raises when it stays.
    - The longer the tissue is silent, the less is felt, and what comes back, after silence or after
      an absurd wrench, comes by a ramp: see `Watchdog`.
    - A wrench above a limit is made shorter as a whole, force and torque by one factor. So both
      keep their directions, and the force its line of action.
    - What would give the arm energy out of nothing is damped: see `Passivity`.
    - The force changes no faster than the device can follow.

    Args:
        limits: Of the device.
        passivity: Whether the passivity controller acts; its observer always counts.
    """

    def __init__(self, limits: DeviceLimits, *, passivity: bool = True) -> None:
        self._limits = limits
        self._watchdog = Watchdog()
        self._passivity = Passivity(limits, acts=passivity)
        self._felt = np.zeros(6)
        self._absurd_in_a_row = 0
        self.n_force_limited = 0
        self.n_torque_limited = 0
        self.n_slew_limited = 0
        self.n_not_finite = 0
        self.n_absurd = 0

    def felt(
        self, wrench: Wrench, dt: float, travel: Travel = _AT_REST, silence: float = 0.0
    ) -> Wrench:
        """Return what the arm feels for the next `dt` [s].

        Args:
            wrench: What the tissue says; its point is the tip.
            dt: Length of the frame [s].
            travel: What happened at the blade since the last frame, in the frame of the wrench.
            silence: How long the arm has waited for the tissue by now [s].

        Raises:
            CouplingError: the wrench is not finite, or was absurd for too long.
        """
        wanted = self._plausible(wrench)
        wanted = self._within_limits(wanted, self._watchdog.gain(silence, dt))
        passive = self._passivity.passive(wanted, travel)
        felt = self._within_slew(passive, dt)
        self._passivity.feel(felt, wanted, travel)
        self._felt = felt
        return Wrench(felt[:3], felt[3:], wrench.point)

    @property
    def passivity(self) -> PassivityCounters:
        """What the passivity observer saw, and its controller did."""
        return self._passivity.counters

    @property
    def n_silent(self) -> int:
        """Frames in which the tissue had been silent for 10 ms or more."""
        return self._watchdog.n_silent

    @property
    def n_faded(self) -> int:
        """Frames in which the arm felt less than the tissue's whole wrench, by silence or ramp."""
        return self._watchdog.n_faded

    def _plausible(self, wrench: Wrench) -> FloatArray:
        """Return force and torque, shape (6,), or zeros for an absurd wrench."""
        force_size, torque_size = size_of(wrench.force), size_of(wrench.torque)
        if not math.isfinite(force_size + torque_size + size_of(wrench.point)):
            self.n_not_finite += 1
            raise CouplingError(
                f"the tissue answered with a force of {wrench.force.tolist()} N and a torque of "
                f"{wrench.torque.tolist()} N m at {wrench.point.tolist()} m, which is not finite: "
                "its simulation has diverged. A smaller frame or a slower stroke may help"
            )
        if force_size <= ABSURD_FORCE and torque_size <= ABSURD_TORQUE:
            self._absurd_in_a_row = 0
            return np.concatenate([wrench.force, wrench.torque])
        self.n_absurd += 1
        self._absurd_in_a_row += 1
        if self._absurd_in_a_row == ABSURD_FRAMES_IN_A_ROW:
            raise CouplingError(
                f"the tissue has answered with more than {ABSURD_FORCE:g} N or {ABSURD_TORQUE:g} "
                f"N m for {ABSURD_FRAMES_IN_A_ROW} frames in a row (now {force_size:.3g} N, "
                f"{torque_size:.3g} N m): its simulation blows up. A smaller frame or a slower "
                "stroke may help"
            )
        self._watchdog.let_go()
        return np.zeros(6)

    def _within_limits(self, wrench: FloatArray, gain: float) -> FloatArray:
        """Return force and torque, both shortened by the factor that the stricter limit asks."""
        force_size, torque_size = gain * size_of(wrench[:3]), gain * size_of(wrench[3:])
        limits = self._limits
        self.n_force_limited += force_size > limits.force
        self.n_torque_limited += torque_size > limits.torque
        factor = gain * min(
            factor_within(limits.force, force_size), factor_within(limits.torque, torque_size)
        )
        return wrench if factor == 1.0 else factor * wrench

    def _within_slew(self, wrench: FloatArray, dt: float) -> FloatArray:
        """Return what can be reached in `dt` on the straight way from what is felt now.

        Both ends are within the other limits, so everything between is.
        """
        reach = self._limits.slew * dt
        change = 0.0 if reach == math.inf else size_of(wrench[:3] - self._felt[:3])
        if change <= reach:
            return wrench
        factor = factor_within(reach, change)
        self.n_slew_limited += 1
        return self._felt + factor * (wrench - self._felt)
