"""What the arm may feel of what the tissue says: a finite wrench within the device's limits."""

import math
from dataclasses import dataclass, fields

import numpy as np

from tissue.types import FloatArray, Wrench

ABSURD_FORCE = 1e3
"""[N]. Soft tissue under a scalpel answers with newtons; a kilonewton is a simulation that blows
up, and its direction means nothing. Cut down to the device's limit it would still be the hardest
push that the device has, so it becomes zero instead."""

ABSURD_TORQUE = 1e2
"""[N m]. The same, at a lever of 0.1 m, the length of a scalpel."""

ABSURD_FRAMES_IN_A_ROW = 10
"""After so many frames in a row with an absurd wrench the run stops: 10 ms at 1 kHz, as far back as
a run may be rolled. A single one may be a node that the blade flicks and that comes to rest."""


ROUNDING = 1e-15
"""By which fraction to stay below a limit, so that rounding never carries a force above it."""


class CouplingError(RuntimeError):
    """The tissue does not answer with a wrench that an arm may feel. The arm must let go of it."""


@dataclass(frozen=True)
class DeviceLimits:
    """What the haptic device can exert.

    Raises:
        ValueError: a limit is not positive.
    """

    force: float = math.inf
    """[N]."""
    torque: float = math.inf
    """About the wrench's point [N m]."""
    slew: float = math.inf
    """How fast the force may change [N/s]."""

    def __post_init__(self) -> None:
        for limit in fields(self):
            value = getattr(self, limit.name)
            if not value > 0.0:
                raise ValueError(f"the limit of {limit.name} is {value}; it must be positive")


class Coupling:
    """Turns the tissue's wrench into one that the arm may feel, and counts what it changed.

    A wrench above a limit is made shorter as a whole, force and torque by one factor. So both keep
    their directions, and the force its line of action.

    A wrench that is not finite raises at once: a NaN in a tissue never heals. An absurd wrench
    counts as zero, and raises when it stays.
    """

    def __init__(self, limits: DeviceLimits) -> None:
        self._limits = limits
        self._felt_force = np.zeros(3)
        self._felt_torque = np.zeros(3)
        self._absurd_in_a_row = 0
        self.n_force_limited = 0
        self.n_torque_limited = 0
        self.n_slew_limited = 0
        self.n_not_finite = 0
        self.n_absurd = 0

    def felt(self, wrench: Wrench, dt: float) -> Wrench:
        """Return what the arm feels for the next `dt` [s].

        Raises:
            CouplingError: the wrench is not finite, or was absurd for too long.
        """
        force, torque = self._plausible(wrench)
        force, torque = self._within_limits(force, torque)
        force, torque = self._within_slew(force, torque, dt)
        self._felt_force, self._felt_torque = force, torque
        return Wrench(force, torque, wrench.point)

    def _plausible(self, wrench: Wrench) -> tuple[FloatArray, FloatArray]:
        """Return force and torque, or zeros for an absurd wrench."""
        force_size = math.hypot(*wrench.force.tolist())
        torque_size = math.hypot(*wrench.torque.tolist())
        if not (math.isfinite(force_size + torque_size) and np.isfinite(wrench.point).all()):
            self.n_not_finite += 1
            raise CouplingError(
                f"the tissue answered with a force of {wrench.force.tolist()} N and a torque of "
                f"{wrench.torque.tolist()} N m at {wrench.point.tolist()} m, which is not finite: "
                "its simulation has diverged. A smaller frame or a slower stroke may help"
            )
        if force_size <= ABSURD_FORCE and torque_size <= ABSURD_TORQUE:
            self._absurd_in_a_row = 0
            return wrench.force, wrench.torque
        self.n_absurd += 1
        self._absurd_in_a_row += 1
        if self._absurd_in_a_row == ABSURD_FRAMES_IN_A_ROW:
            raise CouplingError(
                f"the tissue has answered with more than {ABSURD_FORCE:g} N or {ABSURD_TORQUE:g} "
                f"N m for {ABSURD_FRAMES_IN_A_ROW} frames in a row (now {force_size:.3g} N, "
                f"{torque_size:.3g} N m): its simulation blows up. A smaller frame or a slower "
                "stroke may help"
            )
        return np.zeros(3), np.zeros(3)

    def _within_limits(
        self, force: FloatArray, torque: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return force and torque, both shortened by the factor that the stricter limit asks."""
        force_size = math.hypot(*force.tolist())
        torque_size = math.hypot(*torque.tolist())
        self.n_force_limited += force_size > self._limits.force
        self.n_torque_limited += torque_size > self._limits.torque
        factor = min(
            _factor(self._limits.force, force_size), _factor(self._limits.torque, torque_size)
        )
        return factor * force, factor * torque

    def _within_slew(
        self, force: FloatArray, torque: FloatArray, dt: float
    ) -> tuple[FloatArray, FloatArray]:
        """Return what can be reached in `dt` on the straight way from what is felt now.

        Both ends are within the limits, so everything between is.
        """
        change = math.hypot(*(force - self._felt_force).tolist())
        factor = _factor(self._limits.slew * dt, change)
        if factor == 1.0:
            return force, torque
        self.n_slew_limited += 1
        return (
            self._felt_force + factor * (force - self._felt_force),
            self._felt_torque + factor * (torque - self._felt_torque),
        )


def _factor(limit: float, size: float) -> float:
    """Return by what to multiply something of this size to keep it within its limit."""
    return limit / size * (1.0 - ROUNDING) if size > limit else 1.0
