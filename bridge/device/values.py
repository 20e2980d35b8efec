"""What a device and the run that it leads tell each other, by the names of CRTK."""

from typing import NamedTuple

import msgspec

from tissue import FloatArray, Wrench


class CartesianPose(NamedTuple):
    """A pose in the world."""

    position: FloatArray
    """[m], shape (3,)."""
    orientation: FloatArray
    """Unit quaternion (w, x, y, z), shape (4,)."""


class DeviceState(NamedTuple):
    """How the blade is that a device leads, after the last frame."""

    time: float
    """Simulated time [s]."""
    real_time_factor: float
    """Simulated time over wall time, over the last half second."""
    measured_cp: CartesianPose
    """Where the blade is: the origin is its tip, +y points from heel to tip, -z cuts."""
    measured_cf: Wrench
    """What the tissue does to the blade, as the simulated arm feels it within its limits: force and
    torque about the tip, world frame."""
    is_engaged: bool
    """Whether the device leads the blade now."""
    has_ended: bool
    """Whether the stroke has ended; the blade rests from then on."""
    n_limited: int
    """Frames in which a limit of speed, turn rate or room held the blade back."""
    n_missed: int = 0
    """Periods in which a device was to send a pose, and sent none."""
    n_dropped: int = 0
    """Messages that were refused, such as a pose that is not finite."""


class DeviceDescription(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What a device should know of the run that it leads."""

    scene: str
    """Name of the scene."""
    watchdog: float
    """Wall time without a pose after which the blade rests [s]."""
    most_speed: float
    """Highest speed of the middle of the edge [m/s]."""
    most_turn_rate: float
    """Highest rate at which the blade turns [rad/s]."""
