"""A wrench of tissue on a body of a MuJoCo model, as `xfrc_applied` takes it."""

import math

from bridge import MAX_PLAUSIBLE_FORCE, MAX_PLAUSIBLE_TORQUE
from tissue import FloatArray, Wrench

SixNumbers = tuple[float, float, float, float, float, float]


def about_centre_of_mass(wrench: Wrench, centre_of_mass: FloatArray) -> SixNumbers:
    """Return force [N] and torque [N m] about a body's centre of mass, world frame.

    The lever adds (point - centre of mass) x force to the torque.

    Args:
        wrench: About a point of its own, world frame.
        centre_of_mass: Of the body [m], shape (3,).

    Raises:
        ValueError: the wrench is not finite, or larger than `MAX_PLAUSIBLE_FORCE` or
            `MAX_PLAUSIBLE_TORQUE`.
    """
    # The last guard: MuJoCo accepts 1e3 N silently, and resets itself at 1e9 N or NaN.
    fx, fy, fz, tx, ty, tz, *_ = wrench.about(centre_of_mass).numbers
    force, torque = math.hypot(fx, fy, fz), math.hypot(tx, ty, tz)
    if not (force <= MAX_PLAUSIBLE_FORCE and torque <= MAX_PLAUSIBLE_TORQUE):  # catches NaN too
        raise ValueError(
            f"a wrench of {force:.3g} N and {torque:.3g} N m about its centre of mass acts on the "
            f"body; it must be finite and at most {MAX_PLAUSIBLE_FORCE:g} N and "
            f"{MAX_PLAUSIBLE_TORQUE:g} N m. Limit it first, as bridge.Bridge does"
        )
    return fx, fy, fz, tx, ty, tz
