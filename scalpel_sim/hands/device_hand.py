"""A hand that a device leads: it moves and turns as the device's stylus does."""

import math
import time
from collections.abc import Callable

import mujoco
import numpy as np

from bridge import CartesianPose, DeviceState
from scalpel_sim.hands.commands import FARTHEST_MOVE, FARTHEST_TURN, End
from scalpel_sim.hands.teleoperation import Teleoperation
from scalpel_sim.simulation import Simulation
from tissue import BladeSegment, FloatArray, Wrench

WATCHDOG = 0.04
"""Wall time without a pose after which the hand releases [s]: 40 periods of a haptic device. With
a frame of 10 ms, in which an organ is cut, the blade rests within 50 ms."""


class DeviceHand(Teleoperation):
    """A hand that moves as a stylus has moved since it was engaged; see `Teleoperation`.

    The tip of the blade stands for the stylus: where that only turns, the tip stays.

    Args:
        simulation: At its start; `controller` is left as it is.
        factor: Returns how fast the simulation runs, over real time.
        listen: Takes what the device has sent, and calls the methods of this hand; called before
            each frame, so that only the device's own silence counts as one.
        seconds: How long it leads at most [s]; then it has ended.
        watchdog: Wall time without a pose after which it releases [s].
        ends_with_client: Whether the stroke ends when a device that has led is silent for so long,
            or disconnects; otherwise the blade rests, and a device may come again.
        clock: Wall time [s].
    """

    def __init__(
        self,
        simulation: Simulation,
        factor: Callable[[], float],
        listen: Callable[[], None],
        *,
        seconds: float = math.inf,
        watchdog: float = WATCHDOG,
        ends_with_client: bool = False,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        super().__init__(simulation, seconds=seconds, clock=clock)
        self._simulation, self._factor, self._listen = simulation, factor, listen
        self._watchdog, self._ends_with_client = watchdog, ends_with_client
        self._stylus: CartesianPose | None = None

    @property
    def has_begun(self) -> bool:
        """Whether a device has taken hold of the blade, or has ended the stroke before."""
        return self.is_engaged or self.is_to_end

    def servo_cp(self, pose: CartesianPose, *, holds: bool) -> None:
        """Move and turn the wanted pose as the stylus has moved since the last call.

        Args:
            pose: Where the stylus is, world frame.
            holds: Whether it leads the blade; otherwise this releases it.

        Raises:
            ValueError: no stylus moves so far between two calls. The hand has released.
        """
        before = self._stylus
        if not holds or self.ended_at is not None:
            return self.release()
        self._heard_at = self._clock()
        if before is None:
            self._stylus, self.is_engaged = pose, True
            return None
        move, turn = pose.position - before.position, _turn_between(before, pose)
        distance, angle = math.hypot(*move.tolist()), math.hypot(*turn.tolist())
        if not (distance <= FARTHEST_MOVE and angle <= FARTHEST_TURN):
            self.release()
            raise ValueError(
                f"the stylus has jumped by {distance:.3g} m and {angle:.3g} rad; at most "
                f"{FARTHEST_MOVE:g} m and {FARTHEST_TURN:.3g} rad are allowed from one pose to the "
                "next, so the blade rests"
            )
        self._stylus = pose
        self._want(move, turn)
        return None

    def release(self) -> None:
        """Rest where it is; the next pose engages it again, from where both are then."""
        self._stylus = None
        super().release()

    def lose_client(self) -> None:
        """Release the blade, as the device has gone."""
        has_led = self._heard_at > -math.inf
        self.release()
        self.is_to_end |= self._ends_with_client and has_led

    def state(self) -> DeviceState:
        """Return how the blade is after the last frame."""
        simulation = self._simulation
        measured_cp = _pose_of_blade(simulation.arm.blade.segment())
        wrench = simulation.wrench
        return DeviceState(
            simulation.time,
            self._factor(),
            measured_cp,
            Wrench(wrench.force, wrench.torque, measured_cp.position),
            self.is_engaged,
            self.ended_at is not None,
            self.n_limited,
        )

    def _obey(self) -> bool:
        """Release the blade after a long silence; return whether the run is to end."""
        self._listen()
        self.is_to_end |= any(isinstance(command, End) for command in self.commands)
        self.commands.clear()  # a page may end the stroke, and leads nothing
        if self.is_engaged and self._clock() - self._heard_at > self._watchdog:
            self.release()
            self.is_to_end |= self._ends_with_client
        return self.is_to_end

    def _want(self, move: FloatArray, turn: FloatArray) -> None:
        """Move the tip, and turn the blade about it.

        Args:
            move: World frame [m].
            turn: Rotation vector, world frame [rad].
        """
        before = self._middle_to_tip()
        self.blade.pose.turn(self._frame.vectors_to_tissue(turn))
        lever = self._middle_to_tip() - before
        self.blade.pose.move(self._frame.vectors_to_tissue(move) - lever)

    def _middle_to_tip(self) -> FloatArray:
        """Return the way from the middle of the edge to the tip in the wanted pose [m]."""
        way = np.empty(3)
        mujoco.mju_rotVecQuat(
            way, np.array([0.0, self.blade.half, 0.0]), self.blade.pose.wanted_rotation
        )
        return way


def _pose_of_blade(segment: BladeSegment) -> CartesianPose:
    """Return the pose of a blade as `DeviceState` has it."""
    along, back, across = segment.tip - segment.heel, -segment.forward, np.empty(3)
    mujoco.mju_normalize3(along)
    mujoco.mju_cross(across, along, back)
    orientation = np.empty(4)
    mujoco.mju_mat2Quat(orientation, np.array([across, along, back]).T.ravel())
    return CartesianPose(np.array(segment.tip), orientation)


def _turn_between(before: CartesianPose, after: CartesianPose) -> FloatArray:
    """Return the rotation vector from one pose to another [rad], world frame, shape (3,)."""
    turn = np.empty(3)
    mujoco.mju_subQuat(turn, after.orientation, before.orientation)  # in the frame of `before`
    mujoco.mju_rotVecQuat(turn, turn.copy(), before.orientation)
    return turn
