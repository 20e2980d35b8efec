"""A linear model of the tissue between two of its answers: its last wrench and its stiffness.

Multi-rate haptics calls it an intermediate representation (Adachi, Kumano and Ogino 1995; Cavusoglu
and Tendick 2000).
"""

import numpy as np

from bridge.frames import wrench_about
from bridge.poses import motion
from tissue import BladeSegment, FloatArray, RigidContacts, StepResult, Wrench

MAX_FRAMES_PER_ANSWER = 100
"""Largest number of frames between two answers. With fewer answers the hand would move by
centimetres on a model of where it was."""

_NOTICEABLE_FORCE_CHANGE = 0.02
"""Change of force [N] from which the share of the stiffness is estimated: about what a hand can
notice, and above the changes by tissue that oscillates while the blade rests."""

_NO_STIFFNESS = np.zeros((6, 6))


class LocalModel:
    """The tissue at the blade until it answers again, as a linear function: `F0 - K d`.

    `F0` is the wrench at the end of the tissue's steps, `K` the stiffness there, and `d` the motion
    of the blade since. A wrench that is merely held is half a period older than the blade, which
    generates energy with each push and release: a blade that a hand presses against a stiff wall
    begins to oscillate. With the stiffness it stays at rest, as with an answer in each frame
    (`tests/test_passive_coupling.py`).

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
