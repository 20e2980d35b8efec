"""From the tissue's wrench to the one that the arm feels: finite, within limits, passive."""

import logging
import math
from typing import NoReturn

import numpy as np

from bridge.arithmetic import (
    CLEARLY,
    MAX_PLAUSIBLE_SPEED,
    MAX_PLAUSIBLE_TURN,
    PLAIN,
    Arithmetic,
    Six,
    Triple,
)
from bridge.coupling.limits import DeviceLimits, factor_to_limit
from bridge.coupling.passivity import Passivity, PassivityCounters, Travel
from bridge.poses import six

_log = logging.getLogger(__name__)

MAX_PLAUSIBLE_FORCE = 1e3
"""Largest plausible force [N]. Soft tissue under a scalpel exerts newtons; a kilonewton means that
the simulation diverges, and its direction means nothing. Scaled to the device's limit it would
still be the hardest push of the device, so it is replaced by zero."""

MAX_PLAUSIBLE_TORQUE = 1e2
"""Largest plausible torque [N m]: that force at a lever of 0.1 m, the length of a scalpel."""

MAX_IMPLAUSIBLE_FRAMES = 10
"""Frames in a row with an implausible wrench after which the run stops: 10 ms at 1 kHz. A single
one may be a node that the blade has flicked and that comes to rest."""

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

_NO_WRENCH: Six = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


class CouplingError(RuntimeError):
    """The tissue's wrench cannot be applied to an arm, or no hand moves a blade as it moved.

    The caller must set the arm's wrench to zero.
    """


class Coupling:
    """Turns the tissue's wrench into the one that the arm feels, and counts each change.

    In this order:

    - A wrench that is not finite raises at once, because a NaN in a tissue stays. An implausible
      wrench is replaced by zero, and raises if it persists.
    - The wrench fades while the tissue does not answer, and returns by a ramp after silence or an
      implausible wrench: see `Watchdog`.
    - A wrench above a limit is scaled as a whole, force and torque by one factor. So both keep
      their directions, and the force its line of action.
    - A wrench that would generate energy at the arm is damped: see `Passivity`.
    - The force changes no faster than the device can follow.

    Args:
        limits: Limits of the device.
        passivity: Whether the passivity controller acts; its observer always counts.
        arithmetic: What computes its energies.
    """

    def __init__(
        self, limits: DeviceLimits, *, passivity: bool = True, arithmetic: Arithmetic = PLAIN
    ) -> None:
        self._limits = limits
        self._watchdog = Watchdog()
        self._passivity = Passivity(limits, passivity, arithmetic)
        self._has_no_slew = limits.slew == math.inf
        # Up to these force [N] and torque [N m] no limit acts.
        self._clear = (
            CLEARLY * min(limits.force, MAX_PLAUSIBLE_FORCE),
            CLEARLY * min(limits.torque, MAX_PLAUSIBLE_TORQUE),
        )
        self._felt = _NO_WRENCH
        self._n_implausible_in_a_row = 0
        self.n_force_limited = 0
        self.n_torque_limited = 0
        self.n_slew_limited = 0
        self.n_not_finite = 0
        self.n_implausible = 0

    def passes(self, wrench: Six, motion: Six, work: float, silence: float) -> bool:
        """Act as `felt` where the arm feels the wrench as it is; else return False.

        It then has done nothing. So it is in most frames, and takes a third of the time.

        Args:
            wrench: As for `felt`, about a finite point.
            motion: See `Travel`.
            work: Work of the blade on the tissue [J]; see `Travel`.
            silence: As for `felt` [s].
        """
        if (
            silence == 0.0
            and self._has_no_slew
            and self._watchdog.is_idle
            and self._passivity.pass_on(wrench, motion, work, self._clear)
        ):
            self._n_implausible_in_a_row = 0
            self._felt = wrench
            return True
        return False

    def felt(self, wrench: Six, point: Triple, dt: float, travel: Travel, silence: float) -> Six:
        """Return force and torque that the arm feels for the next `dt` [s]; unchanged: `wrench`.

        Args:
            wrench: Wrench of the tissue on the blade, about the tip: force [N] and torque [N m].
            point: The tip [m].
            dt: Length of the frame [s].
            travel: Motion and work of the blade since the last frame, in the frame of the wrench.
            silence: How long the arm has waited for the tissue by now [s].

        Raises:
            CouplingError: the wrench is not finite, or was implausible for too long.
        """
        fx, fy, fz, tx, ty, tz = wrench
        force_size, torque_size = math.hypot(fx, fy, fz), math.hypot(tx, ty, tz)
        if not math.isfinite(force_size + torque_size + math.hypot(*point)):
            self._refuse(wrench, point)
        wanted = wrench
        if force_size <= MAX_PLAUSIBLE_FORCE and torque_size <= MAX_PLAUSIBLE_TORQUE:
            self._n_implausible_in_a_row = 0
        else:
            self._count_implausible(force_size, torque_size)
            force_size = torque_size = 0.0
            wanted = _NO_WRENCH
        gain = self._watchdog.gain(silence, dt)
        limits = self._limits
        if gain != 1.0 or force_size > limits.force or torque_size > limits.torque:
            factor = self._factor_within_limits(gain, force_size, torque_size)
            wanted = six(factor * np.array(wanted))
        passive = self._passivity.correct(wanted, travel)
        felt = passive if limits.slew == math.inf else self._within_slew(passive, dt)
        self._passivity.record(felt, wanted, travel)
        self._felt = felt
        return felt

    @property
    def passivity(self) -> PassivityCounters:
        """Energy that the passivity observer counted, and actions of the controller."""
        return self._passivity.counters

    @property
    def n_silent(self) -> int:
        """Frames in which the tissue had been silent for 10 ms or more."""
        return self._watchdog.n_silent

    @property
    def n_faded(self) -> int:
        """Frames in which the arm felt less than the full wrench, by silence or the ramp."""
        return self._watchdog.n_faded

    def _refuse(self, wrench: Six, point: Triple) -> NoReturn:
        """Raise the error of a wrench that is not finite."""
        self.n_not_finite += 1
        raise CouplingError(
            f"the tissue answered with a force of {list(wrench[:3])} N and a torque of "
            f"{list(wrench[3:])} N m at {list(point)} m, which is not finite: "
            "no arm can feel that. A smaller time step or a slower stroke may help"
        )

    def _count_implausible(self, force_size: float, torque_size: float) -> None:
        """Count an implausible wrench, which is replaced by zero; raise if it persists."""
        self.n_implausible += 1
        self._n_implausible_in_a_row += 1
        if self._n_implausible_in_a_row == MAX_IMPLAUSIBLE_FRAMES:
            raise CouplingError(
                f"the tissue has answered with more than {MAX_PLAUSIBLE_FORCE:g} N or "
                f"{MAX_PLAUSIBLE_TORQUE:g} N m for {MAX_IMPLAUSIBLE_FRAMES} frames in a row (now "
                f"{force_size:.3g} N, {torque_size:.3g} N m), far beyond what a hand exerts. If "
                "its motion is unstable, a smaller time step or a slower stroke may help"
            )
        self._watchdog.reset()

    def _factor_within_limits(self, gain: float, force_size: float, torque_size: float) -> float:
        """Return the factor of the whole wrench that the stricter limit requires."""
        force_size, torque_size = gain * force_size, gain * torque_size
        limits = self._limits
        self.n_force_limited += force_size > limits.force
        self.n_torque_limited += torque_size > limits.torque
        return gain * min(
            factor_to_limit(limits.force, force_size), factor_to_limit(limits.torque, torque_size)
        )

    def _within_slew(self, wrench: Six, dt: float) -> Six:
        """Return the wrench that can be reached in `dt` on a straight line from the one felt now.

        Both ends are within the other limits, so every wrench between them is too.
        """
        reach = self._limits.slew * dt
        change = math.dist(wrench[:3], self._felt[:3])
        if change <= reach:
            return wrench
        self.n_slew_limited += 1
        before = np.array(self._felt)
        return six(before + factor_to_limit(reach, change) * (np.array(wrench) - before))


def expect_plausible_motion(motion: Six, dt: float) -> None:
    """Refuse a blade that no hand moves so.

    Args:
        motion: Translation of its tip [m] and its rotation vector [rad] in a frame.
        dt: Length of the frame [s].

    Raises:
        CouplingError: it moved faster than `MAX_PLAUSIBLE_SPEED`, or turned by more than
            `MAX_PLAUSIBLE_TURN`.
    """
    x, y, z, u, v, w = motion
    distance, turn = math.hypot(x, y, z), math.hypot(u, v, w)
    if distance > MAX_PLAUSIBLE_SPEED * dt or turn > MAX_PLAUSIBLE_TURN:
        raise CouplingError(
            f"the tip of the blade moved by {distance:.3g} m, and the blade turned by {turn:.3g} "
            f"rad, in {dt:g} s; up to {MAX_PLAUSIBLE_SPEED:g} m/s and {MAX_PLAUSIBLE_TURN:.3g} rad "
            "are taken. Move the arm there by a path, or make another Bridge where it is put "
            "elsewhere"
        )


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

    @property
    def is_idle(self) -> bool:
        """Whether the factor is 1, and the tissue was not silent in the last frame."""
        return self._gain == 1.0 and not self._is_silent

    def reset(self) -> None:
        """Set the factor to zero; it rises again over `RAMP`."""
        self._gain = 0.0
