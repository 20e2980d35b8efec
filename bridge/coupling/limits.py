"""The limits of a haptic device, and the factor that brings a vector within one of them."""

import math
from dataclasses import dataclass, fields

from tissue import FloatArray

_ROUNDING = 1e-15
"""Relative distance to keep below a limit, so that rounding never carries a force above it."""


@dataclass(frozen=True)
class DeviceLimits:
    """Force and torque that the haptic device can exert.

    Raises:
        ValueError: a limit is not positive.
    """

    force: float = math.inf
    """Largest force [N]."""
    torque: float = math.inf
    """Largest torque about the wrench's point [N m]."""
    slew: float = math.inf
    """Largest rate of change of the force [N/s]."""

    def __post_init__(self) -> None:
        for limit in fields(self):
            value = getattr(self, limit.name)
            if not value > 0.0:
                raise ValueError(f"the limit of {limit.name} is {value}; it must be positive")

    def allow(self, wrench: FloatArray) -> bool:
        """Return whether force and torque of a wrench, shape (6,), are within their limits."""
        fx, fy, fz, tx, ty, tz = wrench.tolist()
        return math.hypot(fx, fy, fz) <= self.force and math.hypot(tx, ty, tz) <= self.torque


def magnitude(vector: FloatArray) -> float:
    """Return the length of a vector, shape (3,)."""
    return math.hypot(*vector.tolist())


def factor_to_limit(limit: float, size: float) -> float:
    """Return the factor that brings a quantity of this magnitude within its limit; 1 if it is."""
    return limit / size * (1.0 - _ROUNDING) if size > limit else 1.0
