"""What a haptic device can exert, and a wrench that is cut down to it with its direction kept."""

import math
from dataclasses import dataclass, fields

from tissue import FloatArray

_ROUNDING = 1e-15
"""By which fraction to stay below a limit, so that rounding never carries a force above it."""


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

    def allow(self, wrench: FloatArray) -> bool:
        """Return whether force and torque are within their limits, shape (6,)."""
        fx, fy, fz, tx, ty, tz = wrench.tolist()
        return math.hypot(fx, fy, fz) <= self.force and math.hypot(tx, ty, tz) <= self.torque


def size_of(vector: FloatArray) -> float:
    """Return the length of a vector, shape (3,)."""
    return math.hypot(*vector.tolist())


def factor_within(limit: float, size: float) -> float:
    """Return by what to multiply something of this size to keep it within its limit."""
    return limit / size * (1.0 - _ROUNDING) if size > limit else 1.0
