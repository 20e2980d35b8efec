"""The blade as the process that answers a device knows it: what is wanted, and what is felt."""

import math
import time
from collections.abc import Callable

import numpy as np

from bridge.coupling.limits import DeviceLimits, magnitude
from bridge.device.exchange import NOTHING_WANTED, Exchange
from bridge.device.felt_force import BladeReport, FeltForce, motion_between
from bridge.device.messages import CartesianPose, DeviceState
from tissue import FloatArray, Wrench

FARTHEST_STEP = 0.1
"""Largest displacement from one pose of a stylus to the next [m]: more is no hand's."""

LARGEST_STEP_TURN = 0.5 * math.pi
"""Largest turn from one pose to the next [rad]."""

_NO_MOTION = np.zeros(6)


class RemoteBlade:
    """Answers a device from the last report of the run, and tells the run what it wants.

    It never waits for the run.

    Args:
        exchange: Memory that it shares with the run.
        limits: Largest force and torque that a device gets.
        lever: Half the length of the edge [m].
        watchdog: Time without a pose after which the device does not drive [s].
        clock: The monotonic clock of the machine [s].
    """

    def __init__(
        self,
        exchange: Exchange,
        limits: DeviceLimits,
        lever: float,
        watchdog: float,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._exchange, self._watchdog, self._clock = exchange, watchdog, clock
        self._felt = FeltForce(limits, lever)
        self._command = NOTHING_WANTED
        self._n_holds = 0
        self._stylus: CartesianPose | None = None
        self._wrench = np.zeros(6)
        self._ahead = _NO_MOTION
        self._is_new = True

    def servo_cp(self, pose: CartesianPose, *, holds: bool, period: float) -> None:
        """Drive the blade as the device has moved to a pose; without `holds` it rests.

        Args:
            pose: Where the stylus is.
            holds: Whether it drives the blade.
            period: How often a pose is to come [s].

        Raises:
            ValueError: no stylus moves so far between two poses. The blade is released.
        """
        now = self._clock()
        step = self._step_to(pose, now)
        if not self._is_driven(now):
            if self._is_new:
                self._felt.begin()
            self._is_new = False
            self._command = self._command._replace(hold=0)
        self._command = self._command._replace(heard_at=now, period=period, stylus=pose)
        if not holds:
            self._command = self._command._replace(hold=0)
        elif self._command.hold == 0:
            self._n_holds += 1
            self._command = self._command._replace(hold=self._n_holds, first=pose)
        self._stylus = pose
        self._exchange.command = self._command
        report = self._look()
        self._ahead = self._way_ahead(report) if holds else _NO_MOTION
        self._wrench = self._felt.driven(self._ahead, step, now, period, holds=holds)

    def release(self) -> None:
        """Release the blade, which rests where it is."""
        self._stylus, self._ahead = None, _NO_MOTION
        self._command = self._command._replace(hold=0)
        self._exchange.command = self._command

    def lose_client(self) -> None:
        """Release the blade: the device has gone."""
        self._is_new = True
        self._command = self._command._replace(n_lost=self._command.n_lost + 1, heard_at=-math.inf)
        self.release()

    def end(self) -> None:
        """End the stroke."""
        self._command = self._command._replace(has_ended=True)
        self._exchange.command = self._command

    def count(self, n_missed: int, n_dropped: int) -> None:
        """Report what was counted of its devices to the run."""
        if (n_missed, n_dropped) != (self._command.n_missed, self._command.n_dropped):
            self._command = self._command._replace(n_missed=n_missed, n_dropped=n_dropped)
            self._exchange.command = self._command

    def state(self) -> DeviceState:
        """Return how the blade is, and what is to be felt."""
        now = self._clock()
        report = self._look()
        if not self._is_driven(now):
            self._wrench, self._ahead = self._felt.passive(now), _NO_MOTION
        tip = report.measured_cp.position
        return DeviceState(
            report.time,
            report.real_time_factor,
            report.measured_cp,
            Wrench(self._wrench[:3], self._wrench[3:], tip),
            report.is_engaged,
            report.has_ended,
            report.n_limited,
            stylus_distance=magnitude(self._ahead[:3]),
            stylus_angle=magnitude(self._ahead[3:]),
        )

    def _is_driven(self, now: float) -> bool:
        """Return whether a device sends poses, with which it holds the blade or not."""
        return now - self._command.heard_at <= self._watchdog

    def _look(self) -> BladeReport:
        """Return the last report of the run."""
        report = self._exchange.report
        assert report is not None  # the run makes one before it begins this process
        self._felt.take(report)
        return report

    def _step_to(self, pose: CartesianPose, now: float) -> FloatArray:
        """Return the motion of the stylus since its last pose, shape (6,).

        Raises:
            ValueError: no stylus moves so far. The blade is released.
        """
        if self._stylus is None or not self._is_driven(now):
            return _NO_MOTION
        step = motion_between(self._stylus, pose)
        distance, angle = magnitude(step[:3]), magnitude(step[3:])
        if distance <= FARTHEST_STEP and angle <= LARGEST_STEP_TURN:
            return step
        if self._command.hold == 0:
            return _NO_MOTION  # it looks for a better place
        self.release()
        raise ValueError(
            f"the stylus has jumped by {distance:.3g} m and {angle:.3g} rad; at most "
            f"{FARTHEST_STEP:g} m and {LARGEST_STEP_TURN:.3g} rad are allowed from one pose to the "
            "next, so the blade rests"
        )

    def _way_ahead(self, report: BladeReport) -> FloatArray:
        """Return how far the stylus is ahead of the blade, shape (6,).

        Nothing, until the run has seen that the device has taken hold.
        """
        if not report.is_engaged or self._stylus is None:
            return _NO_MOTION
        stylus = motion_between(report.stylus_at_hold, self._stylus)
        return stylus - motion_between(report.led_at_hold, report.led)
