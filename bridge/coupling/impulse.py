"""The impulse that acted on the blade in the tissue but was not felt yet, and its compensation."""

import numpy as np

from bridge.coupling.limits import factor_to_limit, magnitude
from bridge.frames import wrench_about
from bridge.poses import half_length
from tissue import BladeSegment, FloatArray, Wrench

_ORIGIN = np.zeros(3)


class ImpulseCompensation:
    """Compares what the arm felt with what acted in the tissue, period by period, and corrects it.

    Between two answers of the tissue the arm feels the prediction of a model; only afterwards is
    the true impulse of that time known. The difference, of force and of torque, is returned to the
    arm over a period of the same length. So momentum is conserved over a contact as far as
    possible: the correction is never larger than the force of the tissue, and zero in free air. The
    impulse that is still missing when a contact ends is written off, and counted. What the device's
    limits take from the arm is not counted as missing.

    Impulses are about the origin, [N s] and [N m s], shape (6,), because torques about a moving tip
    cannot be added.
    """

    def __init__(self) -> None:
        self.missing = np.zeros(6)
        """Impulse of the tissue, in the periods that it has answered for, that was not felt."""
        self.written_off = 0.0
        """Sum of the impulses that were missing when contacts ended [N s]."""
        self._felt = np.zeros(6)
        self._felt_until_asked = np.zeros(6)
        self._rate = np.zeros(6)
        self._seconds = 0.0

    def end_period(self) -> None:
        """Begin a new period. The tissue is asked about the one that ends."""
        self._felt_until_asked, self._felt = self._felt, np.zeros(6)

    def compare(self, wrench: Wrench, seconds: float, *, in_contact: bool) -> None:
        """Compare the tissue's answer for the last period with what was felt in it.

        Args:
            wrench: Mean wrench of the tissue on the blade over the period.
            seconds: Length of the period [s].
            in_contact: Whether the tissue touches the blade at its end.
        """
        self.missing = self.missing + seconds * wrench_about(wrench, _ORIGIN)
        self.missing = self.missing - self._felt_until_asked
        if not in_contact:
            self.written_off += magnitude(self.missing[:3])
            self.missing = np.zeros(6)
        self._rate, self._seconds = self.missing / seconds, seconds

    def correction(self, wrench: FloatArray, pose: BladeSegment, dt: float) -> FloatArray:
        """Return the correction to be felt in the next `dt` [s] on top of a wrench, shape (6,).

        Args:
            wrench: Wrench on the blade by the model, about the tip, shape (6,).
            pose: Pose of the blade.
            dt: Length of the frame [s].
        """
        share = min(dt, self._seconds) / dt
        if share <= 0.0:
            return np.zeros(6)
        self._seconds -= share * dt
        lever = half_length(pose)
        added = share * wrench_about(Wrench(self._rate[:3], self._rate[3:], _ORIGIN), pose.tip)
        added *= factor_to_limit(_size(wrench, lever), _size(added, lever))
        felt = Wrench(added[:3], added[3:], pose.tip)
        self.missing = self.missing - dt * wrench_about(felt, _ORIGIN)
        return added

    def record_felt(self, wrench: FloatArray, pose: BladeSegment, dt: float) -> None:
        """Count a wrench, shape (6,), that the arm feels for `dt` [s] beside the correction."""
        felt = Wrench(wrench[:3], wrench[3:], pose.tip)
        self._felt = self._felt + dt * wrench_about(felt, _ORIGIN)


def _size(wrench: FloatArray, lever: float) -> float:
    """Return the size of a wrench [N], with its torque as a force at a lever [m]."""
    return magnitude(wrench[:3]) + magnitude(wrench[3:]) / lever
