"""A linear model of the tissue between two of its answers: its last wrench and its stiffness.

Multi-rate haptics calls it an intermediate representation (Adachi, Kumano and Ogino 1995; Cavusoglu
and Tendick 2000).
"""

import numpy as np

from bridge.arithmetic import Six
from bridge.coupling.limits import factor_to_limit, magnitude
from bridge.coupling.query import TissueAnswer
from bridge.coupling.virtual_coupling import Proxy, VirtualCoupling
from bridge.frames import wrench_about
from bridge.poses import Pose, half_length, motion, pose_of, six
from tissue import BladeSegment, FloatArray, RigidContacts, StepResult, Wrench

MAX_FRAMES_PER_ANSWER = 100
"""Largest number of frames between two answers. With fewer answers the hand would move by
centimetres on a model of where it was."""

_NOTICEABLE_FORCE_CHANGE = 0.02
"""Change of force [N] from which the share of the stiffness is estimated: about what a hand can
notice, and above the changes by tissue that oscillates while the blade rests."""

_ORIGIN = np.zeros(3)

_NO_STIFFNESS = np.zeros((6, 6))


class Prediction:
    """The tissue's wrench between two of its answers, and what it makes good of the last one.

    Args:
        coupling: Coupling between the arm's blade and the one that cuts; None where they are one.
    """

    def __init__(self, coupling: VirtualCoupling | None) -> None:
        self._model = LocalModel(tissue_yields=coupling is None)
        self._impulse = ImpulseCompensation()
        self._correction = np.zeros(6)
        self._coupling = coupling
        self._proxy: Proxy | None = None

    @property
    def impulse_written_off(self) -> float:
        """Sum of the impulses that were missing when contacts ended [N s]."""
        return self._impulse.written_off

    def follow(self, arm: Pose, dt: float) -> tuple[Pose, Six | None]:
        """Move the proxy after the arm for `dt` [s], where there is one.

        Returns:
            Pose of the blade that cuts, and the tissue's wrench on it and on the arm's blade; None
            where they are one.
        """
        if self._coupling is None:
            return arm, None
        if self._proxy is None:
            self._proxy = Proxy(self._coupling, dt, arm.segment)
        wrench = self._corrected(self._proxy.pose, dt)
        balanced = self._proxy.follow(arm.segment, wrench, self._model.stiffness, dt)
        return pose_of(self._proxy.pose), six(balanced)

    def wrench_on(self, blade: BladeSegment, dt: float) -> Six:
        """Return force [N] and torque about the tip [N m] on a blade for the next `dt` [s]."""
        return six(self._corrected(blade, dt))

    def record_felt(self, felt: Six, blade: BladeSegment, dt: float) -> None:
        """Count what the arm feels for `dt` [s], correction included."""
        self._impulse.record_felt(np.array(felt) - self._correction, blade, dt)

    def end_period(self) -> None:
        """Begin a new period. The tissue is queried about the one that ends."""
        self._impulse.end_period()

    def update(self, answer: TissueAnswer) -> None:
        """Take an answer of the tissue."""
        self._model.update(answer.result, answer.last_wrench, answer.middle_pose)
        in_contact = self._model.in_contact
        self._impulse.compare(answer.result.wrench, answer.seconds, in_contact=in_contact)

    def _corrected(self, blade: BladeSegment, dt: float) -> FloatArray:
        """Return the wrench by the model on a blade with the correction, shape (6,)."""
        wrench = self._model.wrench(blade)
        self._correction = self._impulse.correction(wrench, blade, dt)
        return wrench + self._correction


class LocalModel:
    """The tissue at the blade until it answers again, as a linear function: `F0 - K d`.

    `F0` is the wrench at the end of the tissue's steps, `K` the stiffness there, and `d` the motion
    of the blade since. A wrench that is merely held is half a period older than the blade, which
    generates energy with each push and release: a blade that a hand presses against a stiff wall
    begins to oscillate. With the stiffness it stays at rest, as with an answer in each frame
    (`tests/system/forces/test_passive_coupling.py`).

    `K` is the stiffness of the contacts, as if the tissue behind them were fixed. Soft tissue
    yields, and resists a slow hand with a fraction of it. So a blade that presses on meets only the
    share of `K` that the tissue showed between its last two answers, and none in a new contact. A
    blade that retreats meets all of it, because a contact that is released goes slack at once.
    Force that is larger on the way in than on the way out generates no energy.

    Args:
        tissue_yields: Whether to use only that share. False with a virtual coupling: its proxy
            yields itself, and is in balance with the full stiffness.
    """

    def __init__(self, *, tissue_yields: bool = True) -> None:
        self._tissue_yields = tissue_yields
        self._pose: BladeSegment | None = None
        self._wrench = np.zeros(6)
        self._stiffness = _NO_STIFFNESS
        self._push = np.zeros(3)
        self._has_left = False
        self._share = 0.0 if tissue_yields else 1.0

    @property
    def in_contact(self) -> bool:
        """Whether the tissue touched the blade when it answered."""
        return bool(self._wrench.any() or self._stiffness.any())

    @property
    def stiffness(self) -> FloatArray:
        """Stiffness where `wrench` was last called, shape (6, 6) [N/m], [N], [N m/rad]."""
        return _NO_STIFFNESS if self._has_left else self._stiffness

    def update(self, result: StepResult, last: Wrench, pose: BladeSegment) -> None:
        """Linearise about a new answer of the tissue.

        Args:
            result: Answer with the stiffness and the contacts.
            last: Mean wrench over the last frame. The wrench at one instant is noise: the nodes
                that the edge holds oscillate at some kilohertz.
            pose: Pose of the blade in the middle of that frame.
        """
        wrench = wrench_about(last, pose.tip)
        if self._tissue_yields:
            self._share = self._share_of(wrench, result.stiffness, pose)
        self._pose = pose
        self._wrench = wrench
        self._stiffness = result.stiffness.copy()  # a view, valid until the next step
        self._push = _one_sided_push(result.contacts.of_blade)
        self._has_left = False

    def wrench(self, pose: BladeSegment) -> FloatArray:
        """Return force [N] and torque about the tip [N m] on a blade at this pose, shape (6,).

        Contacts that all push to the same side cannot pull: where they would, the blade has left
        them and the wrench is zero.
        """
        if self._pose is None or not self._stiffness.any():
            return self._wrench
        change = self._stiffness @ motion(self._pose, pose)
        wrench = self._wrench - self._share * change
        square = float(self._wrench[:3] @ self._wrench[:3])
        back = float(change[:3] @ self._wrench[:3])
        if back > 0.0:  # released by this share of the wrench
            wrench -= (1.0 - self._share) * min(back / square, 1.0) * self._wrench
        self._has_left = bool(self._push.any() and wrench[:3] @ self._push <= 0.0)
        return np.zeros(6) if self._has_left else wrench

    def _share_of(self, wrench: FloatArray, stiffness: FloatArray, pose: BladeSegment) -> float:
        """Return the share of the contacts' stiffness by which the tissue resisted since then."""
        if self._pose is None or not self._stiffness.any():
            return 0.0
        whole = (stiffness @ motion(self._pose, pose))[:3]
        square = float(whole @ whole)
        if square < _NOTICEABLE_FORCE_CHANGE * _NOTICEABLE_FORCE_CHANGE:
            return self._share
        return min(max(float((self._wrench - wrench)[:3] @ whole) / square, 0.0), 1.0)


def _one_sided_push(contacts: RigidContacts) -> FloatArray:
    """Return the sum of the normal forces on the blade [N], shape (3,), if they push to one side.

    Zero without contacts, and where they push from more than one side: such contacts hold the blade
    and also pull it back.
    """
    push = -contacts.normal_force @ contacts.normal
    if (contacts.normal[contacts.normal_force > 0.0] @ push < 0.0).all():
        return push
    return np.zeros(3)


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
        self._felt_until_query = np.zeros(6)
        self._rate = np.zeros(6)
        self._seconds = 0.0

    def end_period(self) -> None:
        """Begin a new period. The tissue is queried about the one that ends."""
        self._felt_until_query, self._felt = self._felt, np.zeros(6)

    def compare(self, wrench: Wrench, seconds: float, *, in_contact: bool) -> None:
        """Compare the tissue's answer for the last period with what was felt in it.

        Args:
            wrench: Mean wrench of the tissue on the blade over the period.
            seconds: Length of the period [s].
            in_contact: Whether the tissue touches the blade at its end.
        """
        self.missing = self.missing + seconds * wrench_about(wrench, _ORIGIN)
        self.missing = self.missing - self._felt_until_query
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
        """Count a wrench, shape (6,), that the arm feels for `dt` [s] besides the correction."""
        felt = Wrench(wrench[:3], wrench[3:], pose.tip)
        self._felt = self._felt + dt * wrench_about(felt, _ORIGIN)


def _size(wrench: FloatArray, lever: float) -> float:
    """Return the size of a wrench [N], with its torque as a force at a lever [m]."""
    return magnitude(wrench[:3]) + magnitude(wrench[3:]) / lever
