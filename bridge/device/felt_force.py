"""Force on a device between two frames: the last force, its stiffness, and a tank of energy.

A run that is slower than real time has a new force every few milliseconds, of a blade that is a
little behind the stylus. A device needs one each millisecond, which must not jump, and with which
no hand gains energy. Multi-rate haptics answers it from a local model (Adachi, Kumano and Ogino
1995; Cavusoglu and Tendick 2000).
"""

import math
from typing import NamedTuple

import numpy as np

from bridge.coupling.coupling import DECAY_AFTER, RAMP, ZERO_AFTER
from bridge.coupling.limits import DeviceLimits, factor_to_limit, magnitude
from bridge.device.messages import CartesianPose
from tissue import FloatArray

SLEW = 30.0
"""Rate at which the force changes while the hand rests [N/s], of a force up to 1 N; in proportion
of a larger one. In a millisecond it is 0.03 N, or 3 %. A hand notices a step of some 0.05 N: the
rest is for what it presses itself."""

LONGEST_RAMP = 0.05
"""Longest time in which the force of a frame is approached [s]: after longer ones it fades."""

STIFFEST_MODEL = 700.0
"""Stiffness [N/m] above which the model does not go between two frames, as that of
`VirtualCoupling`: a Touch renders it without vibrating."""

REMEMBERED = 0.05
"""Wall time over which the share of the stiffness is learned [s]: ten frames of a slow run."""

LEAST_CHANGE = 0.02
"""Change of force [N] from which it is learned: above the noise of nodes that the edge holds."""

PULL_SLACK = 0.01
"""Distance of stylus and blade up to which they do not pull at each other [m]. At 0.2 m/s, the
limit of the blade, it is 4 mm behind, and what a frame takes."""

PULL_STIFFNESS, LARGEST_PULL = 50.0, 1.0
"""Stiffness [N/m] of the spring between a stylus and a blade that have parted by more, and its
limit [N]: a hand feels that it is ahead, and is held by no wall that the tissue does not have."""

ENERGY_DEBT = 3e-3
"""Energy that a hand may gain [J]: 1 N over 3 mm. The force fades to zero on the way there, so that
a late force feeds no vibration."""

DEBT_EXPIRES = 1e-3
"""Rate at which a debt is forgiven [W]: a hand that is moved at 0.1 m/s dissipates twenty times as
much, and nothing else would bring back a force that has faded."""

ENERGY_CREDIT = 1e-2
"""Energy that can be given back at most [J], such as that of a body of 500 N/m that is pressed with
3 N. What was cut stays spent, and pays for no vibration."""

GAIN_SECONDS = 0.02
"""Shortest time in which the account of energy takes the whole force [s]: 5 % in a millisecond."""


class BladeReport(NamedTuple):
    """The blade after a frame, as a device needs it."""

    stamp: float
    """When it was made, by the monotonic clock of the machine [s]."""
    time: float
    """Simulated time [s]."""
    real_time_factor: float
    """Simulated time over wall time, lately."""
    is_engaged: bool
    """Whether the device leads the blade."""
    has_ended: bool
    """Whether the stroke has ended."""
    n_limited: int
    """Frames in which a limit held the blade back."""
    work: float
    """Work of the blade on the tissue so far [J]."""
    measured_cp: CartesianPose
    """Where the blade is."""
    wrench: FloatArray
    """Force [N] and torque about the tip [N m] of the tissue on it, world frame, shape (6,)."""
    stiffness: FloatArray
    """Decrease of that wrench per motion of the blade, shape (6, 6)."""
    led: CartesianPose
    """Where the hand leads it."""
    led_at_hold: CartesianPose
    """Where it was led when the device took hold."""
    stylus_at_hold: CartesianPose
    """Where the stylus was then."""


class FeltForce:
    """The wrench that a device exerts, answer by answer: continuous, limited, and passive.

    **Model.** `F0 - s K d`: `F0` is the wrench of the last frame, `d` how far the stylus is ahead
    of the blade, and `K` the stiffness of the contacts. Tissue yields behind them, and resists
    with a share `s` of it, by least squares over the last frames: the slope of the body where it
    is pressed, and nearly nothing where it is cut. The change is never larger than `F0`, so that
    tissue pushes and pulls only where it did. Where stylus and blade have parted, a weak spring
    pulls at the stylus.

    **Ramp.** Only the motion of the hand changes the wrench at once. What a new frame changes goes
    over within the length of that frame, and by at most `SLEW`, or as much of a larger force.

    **Tank.** The work of the hand is counted. Where the hand has gained energy, the wrench is
    scaled down, to zero at `ENERGY_DEBT`; what the tissue itself has given back, by its own account
    of work, is free.

    **Decay.** Without a frame for `DECAY_AFTER` the wrench fades, and is zero at `ZERO_AFTER`.

    Args:
        limits: Largest force and torque.
        lever: Half the length of the edge [m], at which a torque counts as a force.
    """

    def __init__(self, limits: DeviceLimits, lever: float) -> None:
        self._limits, self._lever = limits, lever
        self.report: BladeReport | None = None
        """The last frame that it knows."""
        self.energy = 0.0
        """Work that the hand has put in and not got back [J], at most `ENERGY_CREDIT`."""
        self._model: _Model | None = None
        self._ahead, self._felt, self._difference = np.zeros(6), np.zeros(6), np.zeros(6)
        self._ramp = self._product = self._square = self._work_at_start = 0.0
        self._gain, self._energy_gain, self._at = 0.0, 1.0, -math.inf

    def begin(self) -> None:
        """Make the wrench rise from zero: a device has come that exerts nothing yet."""
        self.energy, self._gain, self._energy_gain = 0.0, 0.0, 1.0
        self._felt, self._difference = np.zeros(6), np.zeros(6)
        self._work_at_start = 0.0 if self.report is None else self.report.work

    def take(self, report: BladeReport) -> None:
        """Take the report of a frame, if it is a new one."""
        before = self.report
        if before is not None and report.stamp == before.stamp:
            return
        self.report = report
        if before is None:
            self._work_at_start = report.work
            return
        self._learn(before, report)
        self._ramp = min(max(report.stamp - before.stamp, 0.0), LONGEST_RAMP)

    def passive(self, now: float) -> FloatArray:
        """Return the wrench on a blade that no device drives, shape (6,): as it was measured."""
        self._ahead, self._difference, self._model = np.zeros(6), np.zeros(6), None
        self._at = now
        self._felt = np.zeros(6) if self.report is None else self.report.wrench
        return self._felt

    def driven(
        self, ahead: FloatArray, step: FloatArray, now: float, period: float, *, holds: bool
    ) -> FloatArray:
        """Return the wrench to be exerted from now on, shape (6,).

        Args:
            ahead: Translation [m] and rotation [rad] from blade to stylus, shape (6,).
            step: Those of the stylus since the last answer, shape (6,).
            now: By the clock of the reports [s].
            period: How often the device asks [s]: for longer than that nothing changes at once.
            holds: Whether it drives; else the wrench fades to zero.
        """
        seconds = min(now - self._at, period)
        self._at = now
        if self.report is None:
            return self._felt
        model, before = self._model_now(self.report), self._model
        wanted = model.wrench(ahead)
        if before is not None:  # all but the motion of the hand goes over by the ramp
            self._difference += before.wrench(self._ahead + step) - wanted
        self._model, self._ahead = model, ahead
        self._reduce_difference(seconds)
        self._gain = self._next_gain(now - self.report.stamp, seconds, holds=holds)
        felt = self._gain * self._energy_gain * (wanted + self._difference)
        felt *= min(
            factor_to_limit(self._limits.force, magnitude(felt[:3])),
            factor_to_limit(self._limits.torque, magnitude(felt[3:])),
        )
        self._count(felt, step, seconds, self.report.work)
        self._felt = felt
        return felt

    def _model_now(self, report: BladeReport) -> "_Model":
        """Return the model by what is known of the tissue."""
        share = 0.0
        if self._square >= LEAST_CHANGE * LEAST_CHANGE:
            share = min(max(self._product / self._square, 0.0), 1.0)
        return _Model(report.wrench, share * report.stiffness, self._lever)

    def _reduce_difference(self, seconds: float) -> None:
        """Continue what is left of former models for so long [s]."""
        share = min(seconds / self._ramp, 1.0) if self._ramp > seconds else 1.0
        self._ramp = max(self._ramp - seconds, 0.0)
        most = SLEW * seconds * max(1.0, _size(self._felt, self._lever))
        size = share * _size(self._difference, self._lever)
        self._difference *= 1.0 - share * factor_to_limit(most, size)

    def _learn(self, before: BladeReport, after: BladeReport) -> None:
        """Compare how a force has changed with how the contacts alone would have changed it."""
        keep = math.exp(-max(after.stamp - before.stamp, 0.0) / REMEMBERED)
        motion = motion_between(before.measured_cp, after.measured_cp)
        whole = (before.stiffness @ motion)[:3]
        change = (before.wrench - after.wrench)[:3]
        self._product = keep * self._product + float(change @ whole)
        self._square = keep * self._square + float(whole @ whole)

    def _next_gain(self, silence: float, seconds: float, *, holds: bool) -> float:
        """Return the share of the wrench that is felt `seconds` [s] after the last answer.

        Args:
            silence: Time since the last frame [s].
            seconds: Time since the last answer [s].
            holds: Whether the device drives.
        """
        allowed = min(max((ZERO_AFTER - silence) / (ZERO_AFTER - DECAY_AFTER), 0.0), 1.0)
        step = seconds / RAMP
        return min(allowed, self._gain + step if holds else max(0.0, self._gain - step))

    def _count(self, felt: FloatArray, step: FloatArray, seconds: float, work: float) -> None:
        """Count the work of the hand on the last step, and what share of the wrench that allows.

        Args:
            felt: Wrench from now on, shape (6,).
            step: Motion since the last answer, shape (6,).
            seconds: Time since then [s].
            work: Work of the blade on the tissue so far [J].
        """
        if self.energy < 0.0:
            self.energy = min(self.energy + DEBT_EXPIRES * seconds, 0.0)
        self.energy -= 0.5 * float((self._felt + felt) @ step)
        self.energy = min(self.energy, ENERGY_CREDIT)
        given = min(work - self._work_at_start, 0.0)
        allowed = min(max(1.0 + (self.energy - given) / ENERGY_DEBT, 0.0), 1.0)
        change = seconds / GAIN_SECONDS
        self._energy_gain += min(max(allowed - self._energy_gain, -change), change)


class _Model(NamedTuple):
    """The wrench on a stylus that is ahead of the blade."""

    at_blade: FloatArray
    """Wrench of the tissue on the blade, shape (6,)."""
    stiffness: FloatArray
    """Decrease of it per motion, shape (6, 6)."""
    lever: float
    """Half the length of the edge [m]."""

    def wrench(self, ahead: FloatArray) -> FloatArray:
        """Return the wrench so far ahead, shape (6,)."""
        change = self.stiffness @ ahead
        distance = magnitude(ahead[:3])
        reach = distance + self.lever * magnitude(ahead[3:])
        most = min(_size(self.at_blade, self.lever), STIFFEST_MODEL * reach)
        found = self.at_blade - change * factor_to_limit(most, _size(change, self.lever))
        if distance > PULL_SLACK:
            pull = min(PULL_STIFFNESS * (distance - PULL_SLACK), LARGEST_PULL)
            found[:3] -= (pull / distance) * ahead[:3]
        return found


def _size(wrench: FloatArray, lever: float) -> float:
    """Return the size of a wrench [N], with its torque as a force at a lever [m]."""
    return magnitude(wrench[:3]) + magnitude(wrench[3:]) / lever


def motion_between(before: CartesianPose, after: CartesianPose) -> FloatArray:
    """Return translation [m] and rotation vector [rad], world frame, from pose to pose, (6,)."""
    w, x, y, z = before.orientation.tolist()
    a, b, c, d = after.orientation.tolist()
    # After times the inverse of before.
    real = a * w + b * x + c * y + d * z
    vector = (
        b * w - a * x - c * z + d * y,
        c * w - a * y - d * x + b * z,
        d * w - a * z - b * y + c * x,
    )
    sine = math.hypot(*vector)
    angle = 2.0 * math.atan2(sine, abs(real))
    scale = math.copysign(angle / sine if sine > 0.0 else 0.0, real)
    return np.concatenate([after.position - before.position, np.multiply(scale, vector)])
