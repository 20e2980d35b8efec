"""What the tissue would say between two of its answers: its last wrench, and its stiffness there.

The intermediate representation of multi-rate haptics (Adachi, Kumano and Ogino 1995; Cavusoglu and
Tendick 2000).
"""

import numpy as np

from bridge.poses import motion
from bridge.wrenches import about
from tissue import BladeContacts, BladeSegment, FloatArray, StepResult, Wrench

MOST_FRAMES_PER_ANSWER = 100
"""A tissue that is asked less often is not felt but remembered: the hand has moved by centimetres
since."""

NOTICEABLE = 0.02
"""[N]. A change of force from which the share of the stiffness is learnt: about what a hand can
notice, and above what tissue that swings changes a force by while the blade rests."""

NO_STIFFNESS = np.zeros((6, 6))


class LocalModel:
    """The tissue at the blade, linear, until it answers again: `F0 - K d`.

    `F0` is the wrench at the end of the tissue's steps, `K` its stiffness there, and `d` how the
    blade moved since. A wrench that is only held is older than the blade by half a period, which
    makes energy with each push and release: a blade that a hand of 1 kN/m holds against a wall
    shakes from 3 kN/m on with an answer every 33 ms. With the stiffness it rests up to 25 kN/m and
    more, as with an answer in each frame.

    `K` is the stiffness of the contacts, as if the tissue behind them stood still: five to ten
    times what soft tissue resists a slow hand with, for it gives way. So a blade that presses on
    meets only the share of it that the tissue showed between its last two answers; none in a new
    contact, of which nothing is known. One that goes back meets all of it: a contact that is let go
    of goes slack at once. More force in than out makes no energy.

    Args:
        gives_way: Whether that is so. A proxy on a virtual coupling gives way itself, and is in
            balance with the whole stiffness.
    """

    def __init__(self, *, gives_way: bool = True) -> None:
        self._gives_way = gives_way
        self._pose: BladeSegment | None = None
        self._wrench = np.zeros(6)
        self._stiffness = NO_STIFFNESS
        self._push = np.zeros(3)
        self._has_left = False
        self._share = 0.0 if gives_way else 1.0

    @property
    def in_contact(self) -> bool:
        """Whether the tissue touched the blade when it answered."""
        return bool(self._wrench.any() or self._stiffness.any())

    @property
    def stiffness(self) -> FloatArray:
        """Of the tissue where `wrench` was last asked for [N/m], [N], [N m/rad], shape (6, 6)."""
        return NO_STIFFNESS if self._has_left else self._stiffness

    def answered(self, result: StepResult, last: Wrench, pose: BladeSegment) -> None:
        """Take what the tissue says.

        Args:
            result: Has the stiffness and the contacts.
            last: The wrench on the mean over the last frame. At one instant it is noise: the nodes
                that the edge holds swing at some kilohertz.
            pose: Of the blade in the middle of that frame.
        """
        wrench = about(last, pose.tip)
        if self._gives_way:
            self._share = self._share_of(wrench, result.stiffness, pose)
        self._pose = pose
        self._wrench = wrench
        self._stiffness = result.stiffness.copy()  # a view, valid until the next step
        self._push = _one_way(result.contacts)
        self._has_left = False

    def wrench(self, pose: BladeSegment) -> FloatArray:
        """Return what the tissue does to a blade that is here, shape (6,).

        Force [N] and torque about the blade's tip [N m]. Contacts that all push to the same side do
        not pull: where they would, the blade has left them.
        """
        if self._pose is None or not self._stiffness.any():
            return self._wrench
        change = self._stiffness @ motion(self._pose, pose)
        wrench = self._wrench - self._share * change
        square = float(self._wrench[:3] @ self._wrench[:3])
        back = float(change[:3] @ self._wrench[:3])
        if back > 0.0:  # let go of by so much of what there is
            wrench -= (1.0 - self._share) * min(back / square, 1.0) * self._wrench
        self._has_left = bool(self._push.any() and wrench[:3] @ self._push <= 0.0)
        return np.zeros(6) if self._has_left else wrench

    def _share_of(self, wrench: FloatArray, stiffness: FloatArray, pose: BladeSegment) -> float:
        """Return the share of its contacts' stiffness that a tissue shows which now says this."""
        if self._pose is None or not self._stiffness.any():
            return 0.0
        whole = (stiffness @ motion(self._pose, pose))[:3]
        square = float(whole @ whole)
        if square < NOTICEABLE * NOTICEABLE:
            return self._share
        return min(max(float((self._wrench - wrench)[:3] @ whole) / square, 0.0), 1.0)


def _one_way(contacts: BladeContacts) -> FloatArray:
    """Return the sum of the normal forces on the blade [N], shape (3,); zero for none.

    Zero also where they push from more than one side: those hold the blade, and pull it back too.
    """
    push = -contacts.normal_force @ contacts.normal
    if (contacts.normal[contacts.normal_force > 0.0] @ push < 0.0).all():
        return push
    return np.zeros(3)
