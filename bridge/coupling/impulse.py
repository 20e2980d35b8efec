"""The impulse that the tissue felt and the arm has not felt yet, and how it is given back."""

import numpy as np

from bridge.coupling.limits import factor_within, size_of
from bridge.poses import half_length
from bridge.wrenches import ORIGIN, about
from tissue import BladeSegment, FloatArray, Wrench


class ImpulseDebt:
    """Compares what the arm felt with what the tissue felt, period by period, and makes it up.

    Between two answers of the tissue the arm feels what a model says, and only afterwards is it
    known what the tissue felt in that time. The difference, of force and of torque, is given back
    over a period as long. So momentum is kept over a contact, as far as the contact goes: no more
    is given back than the tissue pushes with, and nothing in free air. What is owed when a contact
    ends is written off, and counted. What the device's limits take from the arm is not owed.

    Impulses are about the origin, [N s] and [N m s], shape (6,): torques about a tip that moves do
    not add up.
    """

    def __init__(self) -> None:
        self.owed = np.zeros(6)
        """What the tissue felt in the periods that it has answered for, and the arm did not."""
        self.written_off = 0.0
        """Sum of the impulses that were owed when contacts ended [N s]."""
        self._felt = np.zeros(6)
        self._felt_until_asked = np.zeros(6)
        self._rate = np.zeros(6)
        self._seconds = 0.0

    def asked(self) -> None:
        """A period ends, and the tissue is asked about it."""
        self._felt_until_asked, self._felt = self._felt, np.zeros(6)

    def answered(self, wrench: Wrench, seconds: float, *, in_contact: bool) -> None:
        """Take what the tissue did to the blade in that period [s], on the mean."""
        self.owed = self.owed + seconds * about(wrench, ORIGIN) - self._felt_until_asked
        if not in_contact:
            self.written_off += size_of(self.owed[:3])
            self.owed = np.zeros(6)
        self._rate, self._seconds = self.owed / seconds, seconds

    def back(self, wrench: FloatArray, pose: BladeSegment, dt: float) -> FloatArray:
        """Return what is given back in the next `dt` [s] beside this wrench, shape (6,).

        Args:
            wrench: What the tissue does to the blade by the model, about the tip, shape (6,).
            pose: Of the blade.
            dt: Length of the frame [s].
        """
        share = min(dt, self._seconds) / dt
        if share <= 0.0:
            return np.zeros(6)
        self._seconds -= share * dt
        lever = half_length(pose)
        back = share * about(Wrench(self._rate[:3], self._rate[3:], ORIGIN), pose.tip)
        back *= factor_within(_size(wrench, lever), _size(back, lever))
        self.owed = self.owed - dt * about(Wrench(back[:3], back[3:], pose.tip), ORIGIN)
        return back

    def felt(self, wrench: FloatArray, pose: BladeSegment, dt: float) -> None:
        """Count that the arm feels this for `dt` [s], beside what is given back."""
        self._felt = self._felt + dt * about(Wrench(wrench[:3], wrench[3:], pose.tip), ORIGIN)


def _size(wrench: FloatArray, lever: float) -> float:
    """Return how large a wrench is [N], with its torque as a force at this lever [m]."""
    return size_of(wrench[:3]) + size_of(wrench[3:]) / lever
