"""No energy is generated at the arm: an observer counts it, a controller dissipates the excess.

After Hannaford and Ryu, Time-domain passivity control of haptic interfaces (2002), in six degrees
of freedom.
"""

from collections.abc import Sequence
from operator import add, sub
from typing import NamedTuple

import numpy as np

from bridge.arithmetic import PLAIN, Arithmetic, Six
from bridge.coupling.limits import DeviceLimits
from bridge.poses import six
from tissue import FloatArray

_ZERO_WRENCH: Six = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


class Travel(NamedTuple):
    """Motion and work of the blade since the last frame."""

    motion: Six
    """Translation of the tip of the arm's blade [m] and rotation vector [rad]."""
    lever: float
    """Half the length of the edge [m]: the lever at which a damper acts against rotation."""
    work_on_tissue: float
    """Work of the blade on the tissue since the start, as the tissue reports it [J]."""


class PassivityCounters(NamedTuple):
    """Energy seen by the observer and actions of the controller since the start."""

    energy: float
    """Energy that the arm has put into the present contact and not got back [J]."""
    least_energy: float
    """Lowest value of that energy so far [J]. Below zero the coupling has generated energy."""
    injected_away: float
    """Energy dissipated by the controller [J]."""
    frames: int
    """Frames in which the controller acted."""


class Passivity:
    """Counts the energy at the arm's blade, and dissipates what would make it negative.

    **Observer.** The arm feels wrench `w_n` from frame n to frame n + 1, and its blade moves
    by `d_n` between frames n - 1 and n. The energy that the arm has put in is

        E_n = E_(n-1) - (w_(n-1) + w_n) . d_n / 2

    the work of the mean of the wrenches at both ends of each displacement. It equals, to rounding,
    the kinetic energy lost by an arm that MuJoCo moves by x_(n+1) = x_n + h v_(n+1):
    M (v_(n+1) - v_n) = h w_n, times the mean of both velocities. All of it is known when w_n is
    chosen, so the controller needs no prediction.

    **Bound.** Tissue that was stretched or lifted before may return energy, which the coupling has
    not generated. The tissue reports the work of the blade on it: E may fall as far below zero as
    that work did. In a contact that begins with a body at rest the bound is zero. Where no wrench
    is felt and none is wanted, E starts at zero again, so that the work of a cut cannot pay for a
    later contact.

    **Controller.** Where w . d_n would exceed what is left after the first half of the frame, a
    damper takes the excess: w - a (d, lever^2 rotation), as if a damper acted at each end of the
    edge. Only what is left is spent, though half of it counts later, so that a force runs out
    instead of reversing. Where that would break a limit, the whole wrench is scaled down instead,
    or moves towards the opposite of the last one, which is within all limits and generates no
    energy.

    Args:
        limits: Limits of the device. The result is within those of force and torque if the input
            is. The slew limit cannot be kept here: where it prevents a force from falling as fast
            as the energy runs out, it takes precedence, and `least_energy` shows by how much.
        acts: Whether the controller acts. The observer always counts.
        arithmetic: What computes energies.
    """

    def __init__(
        self,
        limits: DeviceLimits = DeviceLimits(),
        acts: bool = True,
        arithmetic: Arithmetic = PLAIN,
    ) -> None:
        self._limits = limits
        self._balance = arithmetic.balance
        self._acts = acts
        self._felt = _ZERO_WRENCH
        self._taken: Sequence[float] = _ZERO_WRENCH
        self._energy = 0.0
        self._energy_after = 0.0
        self._given = 0.0
        self._work_at_start = 0.0
        self._least = 0.0
        self._injected = 0.0
        self._n_acted = 0

    def pass_on(self, wanted: Six, motion: Six, work: float, limits: tuple[float, float]) -> bool:
        """Do `correct` and `record` where that changes nothing; else return False, and do nothing.

        Args:
            wanted: Force [N] and torque about the tip [N m].
            motion: See `Travel`.
            work: Work of the blade on the tissue [J]; see `Travel`.
            limits: Force [N] and torque [N m] up to which no limit acts.
        """
        force, torque = limits
        _, at_start, given, _, power, most, after, force_size, torque_size = self._balance.call(
            self._felt, wanted, motion, self._energy, self._work_at_start, work
        )
        # What is not finite passes no comparison.
        if not (
            force_size <= force
            and torque_size <= torque
            and (power <= most or not self._acts)
            and self._taken is _ZERO_WRENCH
        ):
            return False
        self._energy, self._work_at_start, self._given = after, at_start, given
        if after - given < self._least:
            self._least = after - given
        self._felt = wanted
        return True

    def correct(self, wanted: Six, travel: Travel) -> Six:
        """Return the wrench that may be felt from now on. Call `record` afterwards.

        Args:
            wanted: Force [N] and torque about the tip [N m], within the device's limits.
            travel: Motion and work of the blade since the last frame.
        """
        balance = self._balance.call(
            self._felt,
            wanted,
            travel.motion,
            self._energy,
            self._work_at_start,
            travel.work_on_tissue,
        )
        self._energy, self._work_at_start, self._given, spent, power, most, after = balance[:7]
        self._energy_after = after
        if power <= most or not self._acts:
            return wanted
        self._n_acted += 1
        return six(self._damped(np.array(wanted), power, most, spent, travel))

    def _damped(
        self, wanted: FloatArray, power: float, most: float, spent: float, travel: Travel
    ) -> FloatArray:
        """Return a wrench of less power, shape (6,).

        Args:
            wanted: Wrench without the controller, shape (6,).
            power: Its work on the motion of the last frame [J].
            most: Work that is allowed [J].
            spent: Work of the wrench that was felt before [J].
            travel: Motion of the last frame.
        """
        damped = wanted - (power - most) * _unit_damper(travel)
        if self._limits.allow(damped):
            return damped
        if most >= 0.0:
            return wanted * (most / power)
        felt = np.array(self._felt)
        share = (power - most) / (power + abs(spent))
        return (1.0 - share) * wanted + share * (felt if spent < 0.0 else -felt)

    def record(self, wrench: Six, wanted: Six, travel: Travel) -> None:
        """Count the energy of the wrench that is felt from now on.

        Args:
            wrench: Force [N] and torque about the tip [N m].
            wanted: Wrench without the controller.
            travel: Motion and work of the blade as given to `correct`.
        """
        if wrench is wanted:
            self._energy = self._energy_after
        else:
            both = tuple(map(add, self._felt, wrench))
            self._energy -= 0.5 * _work(both, travel.motion)
        self._least = min(self._least, self._energy - self._given)
        taken = _ZERO_WRENCH if wrench is wanted else tuple(map(sub, wanted, wrench))
        if taken is not self._taken:
            self._injected += 0.5 * _work(tuple(map(add, self._taken, taken)), travel.motion)
        self._felt, self._taken = wrench, taken

    @property
    def counters(self) -> PassivityCounters:
        """Energy seen and actions taken since the start."""
        return PassivityCounters(
            self._energy - self._given, self._least, self._injected, self._n_acted
        )


def _work(wrench: Sequence[float], motion: Six) -> float:
    """Return the work of a wrench on a motion [J]."""
    (fx, fy, fz, tx, ty, tz), (x, y, z, u, v, w) = wrench, motion
    return fx * x + fy * y + fz * z + tx * u + ty * v + tz * w


def _unit_damper(travel: Travel) -> FloatArray:
    """Return the wrench, shape (6,), of dampers at the ends of the edge that do 1 J on `travel`."""
    motion, squared = np.array(travel.motion), travel.lever * travel.lever
    wrench = np.concatenate([motion[:3], squared * motion[3:]])
    return wrench / float(wrench @ motion)
