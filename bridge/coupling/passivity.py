"""The arm gets no energy out of a coupling: an observer that counts it, a controller that acts.

After Hannaford and Ryu, Time-domain passivity control of haptic interfaces (2002), in six degrees
of freedom.
"""

from typing import NamedTuple

import numpy as np

from bridge.coupling.limits import DeviceLimits
from tissue import FloatArray

TRIFLE = 5e-7
"""[J]. What may be missing before the controller acts. At 1 kHz a wrench is half a frame late, and
a blade that moves at 50 mm/s through tissue of 400 N/m gains this much by it in a frame or two;
the work of a cut is ten thousand times as much. At zero the controller would correct rounding."""


NOTHING = np.zeros(6)


class Travel(NamedTuple):
    """What happened at the blade since the last frame."""

    motion: FloatArray
    """Of the arm's blade: translation of the tip [m], rotation vector [rad], shape (6,)."""
    lever: float
    """Half the length of the edge [m]: at which a damper of the tip acts against turning."""
    work_on_tissue: float
    """What the blade has done on the tissue since the start, as the tissue counts it [J]."""


class PassivityCounters(NamedTuple):
    """What the observer saw and the controller did, since the start."""

    energy: float
    """What the arm has put in and not got back, in the contact that it is in [J]."""
    least_energy: float
    """The least that this ever was [J]. Below zero the coupling has made energy."""
    injected_away: float
    """What the controller took out, by damping [J]."""
    frames: int
    """In how many frames it acted."""


class Passivity:
    """Counts the energy at the arm's blade, and damps what would make it negative.

    **What is counted.** The arm feels wrench `w_n` from frame n to frame n + 1, and its blade moves
    by `d_n` between frames n - 1 and n. What the arm has put in is

        E_n = E_(n-1) - (w_(n-1) + w_n) . d_n / 2

    the work by the mean of the wrenches at both ends of each way. That is, to rounding, the kinetic
    energy that an arm loses which MuJoCo moves by x_(n+1) = x_n + h v_(n+1): M (v_(n+1) - v_n) =
    h w_n, times the mean of both velocities. And all of it is known when w_n is chosen, so that the
    controller needs no guess.

    **What is allowed.** Tissue that was stretched or lifted before may give energy back, which is
    no fault of the coupling. It counts that itself: E may fall as far below zero as the tissue says
    that the blade's work on it did. In a contact that begins with a body at rest that is not at
    all. Where nothing is felt and nothing is to be felt the account starts anew, so that what a cut
    used up cannot pay for a later contact.

    **What is done.** Where w . d_n would be more than what is left after the first half of the
    frame, a damper takes the rest: w - a (d, lever^2 turn), as if one sat at each end of the edge.
    Only what is left is spent, though half of it counts later, so that a force runs out instead of
    turning round. Where a limit would be broken by that, the whole wrench becomes smaller instead,
    or turns towards the opposite of the last one, which is within all limits and makes no energy.

    Args:
        limits: Of the device; what comes out is within those of force and torque if what goes in
            is. One of slew cannot be kept here: where it forbids to let go of a force as fast as
            the energy runs out, the device has its way, and `least_energy` tells.
        acts: Whether it does anything, or only counts.
    """

    def __init__(self, limits: DeviceLimits = DeviceLimits(), acts: bool = True) -> None:
        self._limits = limits
        self._acts = acts
        self._felt = np.zeros(6)
        self._feels = False
        self._taken = NOTHING
        self._energy = 0.0
        self._given = 0.0
        self._work_at_start = 0.0
        self._least = 0.0
        self._injected = 0.0
        self._n_acted = 0

    def passive(self, wanted: FloatArray, travel: Travel) -> FloatArray:
        """Return the wrench that may be felt from now on, shape (6,). `feel` must follow.

        Args:
            wanted: Force [N] and torque about the tip [N m], within the device's limits.
            travel: What happened since the last frame.
        """
        if not (self._feels or any(wanted.tolist())):
            self._energy, self._work_at_start = 0.0, travel.work_on_tissue
        self._given = min(0.0, travel.work_on_tissue - self._work_at_start)
        if not self._acts:
            return wanted
        spent = float(self._felt @ travel.motion)
        power = float(wanted @ travel.motion)
        left = self._energy - 0.5 * spent - self._given + TRIFLE
        # While something is left, both halves of the work are reserved. What is missing already
        # must come from the half that is being decided; it never takes more than turning the last
        # wrench round, unless the tissue has taken back what it gave.
        most = left if left >= 0.0 else max(2.0 * left, -abs(spent))
        if power <= most:
            return wanted
        self._n_acted += 1
        damped = wanted - (power - most) * _unit_damper(travel)
        if self._limits.allow(damped):
            return damped
        if most >= 0.0:
            return wanted * (most / power)
        opposite = self._felt if spent < 0.0 else -self._felt
        share = (power - most) / (power + abs(spent))
        return (1.0 - share) * wanted + share * opposite

    def feel(self, wrench: FloatArray, wanted: FloatArray, travel: Travel) -> None:
        """Count that this wrench is felt from now on.

        Args:
            wrench: Force [N] and torque about the tip [N m], shape (6,).
            wanted: What it would have been without the controller.
            travel: The same as for `passive`.
        """
        self._energy -= 0.5 * float((self._felt + wrench) @ travel.motion)
        self._least = min(self._least, self._energy - self._given)
        taken = NOTHING if wrench is wanted else wanted - wrench
        if taken is not self._taken:
            self._injected += 0.5 * float((self._taken + taken) @ travel.motion)
        self._feels = any(wrench.tolist())
        self._felt, self._taken = wrench, taken

    @property
    def counters(self) -> PassivityCounters:
        """What was seen and done since the start."""
        return PassivityCounters(
            self._energy - self._given, self._least, self._injected, self._n_acted
        )


def _unit_damper(travel: Travel) -> FloatArray:
    """Return the wrench of dampers at the ends of the edge whose work on `travel` is 1 J."""
    way, squared = travel.motion, travel.lever * travel.lever
    wrench = np.concatenate([way[:3], squared * way[3:]])
    return wrench / float(wrench @ way)
