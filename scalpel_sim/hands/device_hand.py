"""A hand that a device leads: it moves and turns as the device's stylus does."""

import math
import time
from collections.abc import Callable
from typing import Protocol

import mujoco
import numpy as np

from bridge import BladeReport, CartesianPose, DeviceCommand, motion_between
from scalpel_sim.hands.commands import End
from scalpel_sim.hands.limited_pose import FOLLOWING_TIME
from scalpel_sim.hands.teleoperation import Teleoperation
from scalpel_sim.simulation import Simulation
from tissue import BladeSegment, FloatArray

WATCHDOG = 0.04
"""Wall time without a pose after which the hand releases [s]: 40 periods of a haptic device. With
a frame of 10 ms, in which an organ is cut, the blade rests within 50 ms."""

FOLLOWING_PERIODS = 4.0
"""Time constant with which the blade follows a stylus, in periods of the device: between two poses
it should not stop, and what is late feeds vibrations. Never longer than `FOLLOWING_TIME`."""

MOST_HURRY = 5.0
"""Most by which the blade is faster in simulated time than its limits, where the run is slower: at
1 m/s it goes a millimetre in a frame, a fifth of an element."""


class DeviceAnswers(Protocol):
    """Process that answers the device, beside the run."""

    def command(self) -> DeviceCommand:
        """Return what the device wants.

        Raises:
            LinkError: it answers no more.
        """

    def tell(self, report: BladeReport) -> None:
        """Take how the blade is."""


class DeviceHand(Teleoperation):
    """A hand that moves as a stylus has moved since it was engaged; see `Teleoperation`.

    The tip of the blade stands for the stylus: where that only turns, the tip stays. Where a limit
    holds the blade back, it follows later. Nothing of the way is lost, so that the two meet again
    where the stylus slows down, or comes back into the room.

    The limits of speed and turn rate, and the time in which the hand follows, are those of real
    time: in a slow run the blade goes as much farther in each frame, up to `MOST_HURRY` times.

    Args:
        simulation: At its start; `controller` is left as it is.
        factor: Returns how fast the simulation runs, over real time.
        seconds: How long it leads at most [s]; then it has ended.
        watchdog: Wall time without a pose after which it releases [s].
        ends_with_client: Whether the stroke ends when a device that has led is silent for so long,
            or disconnects; otherwise the blade rests, and a device may come again.
        clock: Wall time [s], by the monotonic clock of the machine.
    """

    def __init__(
        self,
        simulation: Simulation,
        factor: Callable[[], float],
        *,
        seconds: float = math.inf,
        watchdog: float = WATCHDOG,
        ends_with_client: bool = False,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        super().__init__(simulation, seconds=seconds, clock=clock)
        self.answers: DeviceAnswers | None = None
        """Process that answers the device; None: there is no device."""
        self._simulation, self._factor = simulation, factor
        self._watchdog, self._ends_with_client = watchdog, ends_with_client
        self._hold = self._n_lost = 0
        self._stylus_at_hold = self._led_at_hold = self._led()
        self._pose_at_hold = self._pose()
        self._middle_asked = self.blade.pose.middle
        self._looked_at = clock()

    @property
    def has_begun(self) -> bool:
        """Whether a device has taken hold of the blade, or has ended the stroke before."""
        return self.is_engaged or self.is_to_end

    @property
    def stylus_distance(self) -> float:
        """Distance of the stylus from where the blade is led, since it took hold [m]."""
        if not self.is_engaged:
            return 0.0
        return math.dist(self._middle_asked.tolist(), self.blade.pose.middle.tolist())

    def listen(self) -> None:
        """Do what the device wants by now.

        Raises:
            LinkError: nothing answers it any more.
        """
        if self.answers is None:
            return
        command, is_new = self.answers.command(), False
        self.is_to_end |= command.has_ended
        if command.n_lost != self._n_lost:
            self._n_lost = command.n_lost
            self.is_to_end |= self._ends_with_client and self._heard_at > -math.inf
            self.release()
        is_silent = self._clock() - command.heard_at > self._watchdog
        if command.hold == 0 or is_silent or self.ended_at is not None:
            self.is_to_end |= self.is_engaged and is_silent and self._ends_with_client
            self.release()
            return
        self._heard_at = command.heard_at
        self.blade.pose.following_time = min(
            max(FOLLOWING_PERIODS * command.period, self._dt), FOLLOWING_TIME
        )
        if command.hold != self._hold:
            self.release()
            is_new, self._hold = True, command.hold
        if not self.is_engaged:
            # What it did until the frame that notices it counts, but not what it did in a pause.
            self._stylus_at_hold = command.first if is_new else command.stylus
            self._led_at_hold, self._pose_at_hold = self._led(), self._pose()
            self.is_engaged = True
        self._want(command.stylus)

    def tell(self) -> None:
        """Report how the blade is after the last frame to what answers the device."""
        if self.answers is not None:
            self.answers.tell(self.report())

    def report(self) -> BladeReport:
        """Return how the blade is after the last frame."""
        simulation, result = self._simulation, self._simulation.bridge.result
        force, torque, _ = simulation.wrench
        stiffness, work = np.zeros((6, 6)), 0.0
        if result is not None:
            work = result.work_of_blade
            for rows in (slice(3), slice(3, 6)):
                for columns in (slice(3), slice(3, 6)):
                    part = result.stiffness[rows, columns]
                    stiffness[rows, columns] = self._frame.matrix_to_world(part)
        return BladeReport(
            self._clock(),
            simulation.time,
            self._factor(),
            self.is_engaged,
            self.ended_at is not None,
            self.n_limited,
            work,
            _pose_of_blade(simulation.arm.blade.segment()),
            np.concatenate([force, torque]),
            stiffness,
            self._led(),
            self._led_at_hold,
            self._stylus_at_hold,
        )

    def _obey(self) -> bool:
        """Do what the device wants; return whether the run is to end."""
        now = self._clock()
        wall, self._looked_at = now - self._looked_at, now
        self.blade.pose.dt = min(max(wall, self._dt), MOST_HURRY * self._dt)
        self.listen()
        self.is_to_end |= any(isinstance(command, End) for command in self.commands)
        self.commands.clear()  # a page may end the stroke, and leads nothing
        return self.is_to_end

    def _want(self, stylus: CartesianPose) -> None:
        """Want the blade where the stylus is, from where both were when that took hold."""
        motion = motion_between(self._stylus_at_hold, stylus)
        turn, rotation = np.array([1.0, 0.0, 0.0, 0.0]), np.empty(4)
        mujoco.mju_quatIntegrate(turn, self._frame.vectors_to_tissue(motion[3:]), 1.0)
        middle_then, rotation_then = self._pose_at_hold
        mujoco.mju_mulQuat(rotation, turn, rotation_then)
        tip = middle_then + self._to_tip(rotation_then)
        tip += self._frame.vectors_to_tissue(motion[:3])
        self._middle_asked = tip - self._to_tip(rotation)
        self.blade.pose.want(self._middle_asked, rotation)

    def _to_tip(self, rotation: FloatArray) -> FloatArray:
        """Return the way from the middle of the edge to the tip where it is turned so [m]."""
        way = np.empty(3)
        mujoco.mju_rotVecQuat(way, np.array([0.0, self.blade.half, 0.0]), rotation)
        return way

    def _pose(self) -> tuple[FloatArray, FloatArray]:
        """Return where the blade is led, tissue frame: its middle, and how it is turned."""
        return self.blade.pose.middle.copy(), self.blade.pose.rotation.copy()

    def _led(self) -> CartesianPose:
        """Return where the blade is led, in the world."""
        numbers = np.array(self.blade.numbers).reshape(3, 3)
        return _pose_of_blade(self._frame.segment_to_world(BladeSegment(*numbers)))


def _pose_of_blade(segment: BladeSegment) -> CartesianPose:
    """Return the pose of a blade as `BladeReport` has it."""
    along, back, across = segment.tip - segment.heel, -segment.forward, np.empty(3)
    mujoco.mju_normalize3(along)
    mujoco.mju_cross(across, along, back)
    orientation = np.empty(4)
    mujoco.mju_mat2Quat(orientation, np.array([across, along, back]).T.ravel())
    return CartesianPose(np.array(segment.tip), orientation)
