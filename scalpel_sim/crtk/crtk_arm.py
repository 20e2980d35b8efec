"""An arm whose blade a client of CRTK drives over the device link of a run."""

import math
import time
from collections.abc import Callable
from typing import NamedTuple

import mujoco
import numpy as np

from bridge import CartesianPose, DeviceClient, DeviceState, LinkError
from scalpel_sim.crtk.operating_state import CommandError, OperatingState
from scalpel_sim.hands.commands import FARTHEST_MOVE, FARTHEST_TURN
from tissue import FloatArray

MOVE_SPEED = 0.05
"""Highest speed of the tip on the way of a `move_cp` [m/s]: that of an unhurried incision."""

MOVE_TURN_RATE = 0.5
"""Highest turn rate on it [rad/s]."""

MOST_LEAD, MOST_LEAD_ANGLE = 0.03, 0.3
"""Lead of the link over the blade, at most [m, rad]: of what is farther than 40 mm or 0.4 rad
ahead the run forgets the rest, and where the blade is would no longer be where it is led."""

_PAUSE = 0.5
"""Share of the time after which the run releases a silent hand, from which on it is taken to have
done so."""

_PEAK = 1.875
"""Highest speed over mean speed of the polynomial of least jerk."""

_TO_TOOL = np.array([math.sqrt(0.5), -math.sqrt(0.5), 0.0, 0.0])
"""Rotation from the axes of a blade (+y from heel to tip, -z cuts) to those of a tool of the
research kit, whose +z points out of the tip; +y is where the blade cuts."""

_FROM_TOOL = np.array([math.sqrt(0.5), math.sqrt(0.5), 0.0, 0.0])


class Twist(NamedTuple):
    """Velocity of the tip, world frame."""

    linear: FloatArray
    """[m/s], shape (3,)."""
    angular: FloatArray
    """[rad/s], shape (3,)."""


class MeasuredTool(NamedTuple):
    """Measurements of an arm: the tip and what it exerts. World frame, axes of a tool."""

    cp: CartesianPose
    """Pose of the tool: the origin is the tip, +z points out of it, +y is where the blade cuts."""
    cv: Twist
    """Velocity, by simulated time."""
    force: FloatArray
    """Force that the arm exerts on the tissue [N], shape (3,): opposite to that on the blade."""
    torque: FloatArray
    """Torque that it exerts, about the tip [N m], shape (3,)."""


class _Move(NamedTuple):
    """A motion with a trajectory."""

    start: CartesianPose
    goal: CartesianPose
    begun: float
    """When it began, by the clock [s]."""
    duration: float
    """[s]."""

    def pose(self, now: float) -> CartesianPose:
        """Return where it is to be at a time [s]."""
        t = min(max((now - self.begun) / self.duration, 0.0), 1.0)
        share = t**3 * (10.0 + t * (6.0 * t - 15.0))
        turn, orientation = _turn(self.start, self.goal), self.start.orientation.copy()
        mujoco.mju_quatIntegrate(orientation, turn, share)
        way = self.goal.position - self.start.position
        return CartesianPose(self.start.position + share * way, orientation)


class CrtkArm:
    """The blade of a run as the tip of an arm that follows the conventions of CRTK.

    Call `tick` at the rate of the arm: it sends the setpoint and reads what is measured. What a
    client commands in between takes part in the next one.

    Args:
        client: Link to the run.
        connect: Connects again after a fault, without long waits.
        clock: Wall time [s].

    Raises:
        LinkError: the run does not answer.
    """

    def __init__(
        self,
        client: DeviceClient,
        connect: Callable[[], DeviceClient],
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.operating = OperatingState()
        """Its operating state."""
        self.has_ended = False
        """Whether the run has ended."""
        self._connect, self._clock = connect, clock
        self._client = client
        self._state = client.measured()
        self._twist = Twist(np.zeros(3), np.zeros(3))
        self._setpoint: CartesianPose | None = None
        self._move: _Move | None = None
        self._is_held, self._sent_at = False, -math.inf

    @property
    def is_busy(self) -> bool:
        """Whether it is on the way of a `move_cp`."""
        return self._move is not None

    @property
    def measured(self) -> MeasuredTool:
        """Measurements at the last tick."""
        wrench = self._state.measured_cf
        return MeasuredTool(
            _tool(self._state.measured_cp), self._twist, -wrench.force, -wrench.torque
        )

    @property
    def setpoint_cp(self) -> CartesianPose | None:
        """Pose to which it is led now; None where it is led to none."""
        return self._setpoint

    def command(self, word: str) -> None:
        """Obey a state command.

        Raises:
            CommandError: it is refused in this state, or the run that was lost is still away.
        """
        was_ready = self.operating.is_ready
        if self.operating.state == "FAULT" and word in ("enable", "disable"):
            self._come_back()
        self.operating.obey(word)
        if was_ready and not self.operating.is_ready:
            self._let_go()

    def servo_cp(self, pose: CartesianPose) -> None:
        """Lead the tool to a pose at once; the client sends a stream of near ones.

        Raises:
            CommandError: it is not ready, or the pose is too far away.
        """
        before = self._ready_for("servo_cp", pose)
        distance = float(np.linalg.norm(pose.position - before.position))
        angle = float(np.linalg.norm(_turn(before, pose)))
        if distance > FARTHEST_MOVE or angle > FARTHEST_TURN:
            raise CommandError(
                f"servo_cp is refused: it is {distance:.3g} m and {angle:.3g} rad from the "
                f"setpoint; at most {FARTHEST_MOVE:g} m and {FARTHEST_TURN:.3g} rad are allowed. "
                "Start from setpoint_cp or measured_cp, or use move_cp"
            )
        self._move, self._setpoint = None, pose

    def move_cp(self, pose: CartesianPose) -> None:
        """Move the tool to a pose, along a straight line, and stop there.

        Raises:
            CommandError: it is not ready.
        """
        before = self._ready_for("move_cp", pose)
        distance = float(np.linalg.norm(pose.position - before.position))
        angle = float(np.linalg.norm(_turn(before, pose)))
        duration = _PEAK * max(distance / MOVE_SPEED, angle / MOVE_TURN_RATE)
        self._move = _Move(before, pose, self._clock(), max(duration, 1e-3))

    def hold(self) -> None:
        """Stop where it is on its way.

        Raises:
            CommandError: it is not ready.
        """
        self.operating.expect_ready("hold")
        self._move = None

    def tick(self) -> None:
        """Send the setpoint, and read what is measured.

        Raises:
            CommandError: the run was lost; the arm is in FAULT.
        """
        if self.operating.state == "FAULT":
            return
        before = self._state
        try:
            self._state = self._exchange()
        except LinkError as error:
            self.operating.fail()
            self._let_go()
            self._is_held = False
            raise CommandError(f"the run is lost: {error}") from error
        self._twist = twist_between(before, self._state, self._twist)
        if self._state.has_ended:
            self.has_ended = True
            self.operating.fail()
            self._let_go()

    def close(self) -> None:
        """Close the link: the blade rests."""
        self._client.close()

    def _exchange(self) -> DeviceState:
        """Send what is wanted of the blade, and return how it is."""
        if not self.operating.is_ready:
            if not self._is_held:
                return self._client.measured()
            self._is_held = False
            return self._client.servo_cp(*self._state.measured_cp, holds=False)
        now = self._clock()
        if self._move is not None:
            self._setpoint = self._move.pose(now)
            if now >= self._move.begun + self._move.duration:
                self._move = None
        if not self._is_held or now - self._sent_at > _PAUSE * self._client.description.watchdog:
            # Only motion counts from where the link takes hold: so it does where the blade is.
            self._state = self._client.servo_cp(*self._client.measured().measured_cp)
        if self._setpoint is None:
            self._setpoint = _tool(self._state.measured_cp)
        self._is_held, self._sent_at = True, now
        return self._client.servo_cp(*_ahead(self._state.measured_cp, _blade(self._setpoint)))

    def _ready_for(self, motion: str, pose: CartesianPose) -> CartesianPose:
        """Return from where a motion begins.

        Raises:
            CommandError: it is not ready, or the pose is none.
        """
        self.operating.expect_ready(motion)
        length = float(np.linalg.norm(pose.orientation))
        # The comparison is false for NaN.
        if not (np.isfinite(pose.position).all() and abs(length - 1.0) < 1e-3):
            raise CommandError(
                f"{motion} is refused: it needs a finite place and a unit quaternion"
            )
        return self._setpoint or self.measured.cp

    def _let_go(self) -> None:
        """Forget where it was led to: the next time it starts from where it is."""
        self._setpoint = self._move = None

    def _come_back(self) -> None:
        """Connect again after a fault.

        Raises:
            CommandError: there is no run.
        """
        if self.has_ended:
            raise CommandError("the run has ended: start another")
        self._client.close()
        try:
            self._client = self._connect()
            self._state = self._client.measured()
        except LinkError as error:
            raise CommandError(f"the run is still away: {error}") from error


def _tool(blade: CartesianPose) -> CartesianPose:
    """Return the pose of the tool whose blade has a pose."""
    return CartesianPose(blade.position, _product(blade.orientation, _TO_TOOL))


def _blade(tool: CartesianPose) -> CartesianPose:
    """Return the pose of the blade of a tool."""
    return CartesianPose(tool.position, _product(tool.orientation, _FROM_TOOL))


def _ahead(blade: CartesianPose, goal: CartesianPose) -> CartesianPose:
    """Return the pose on the way to a goal to which the link leads a blade now."""
    way, turn = goal.position - blade.position, _turn(blade, goal)
    distance, angle = float(np.linalg.norm(way)), float(np.linalg.norm(turn))
    share = min(1.0, MOST_LEAD / max(distance, 1e-9), MOST_LEAD_ANGLE / max(angle, 1e-9))
    if share == 1.0:
        return goal
    orientation = blade.orientation.copy()
    mujoco.mju_quatIntegrate(orientation, turn, share)
    return CartesianPose(blade.position + share * way, orientation)


def _product(one: FloatArray, other: FloatArray) -> FloatArray:
    """Return the product of two quaternions."""
    found = np.empty(4)
    mujoco.mju_mulQuat(found, one, other)
    return found


def _turn(before: CartesianPose, after: CartesianPose) -> FloatArray:
    """Return the rotation vector between two poses, in the axes of the first [rad]."""
    turn = np.empty(3)
    mujoco.mju_subQuat(turn, after.orientation, before.orientation)
    return turn


def twist_between(before: DeviceState, after: DeviceState, last: Twist) -> Twist:
    """Return the velocity between two states, by simulated time.

    Args:
        before: The one.
        after: The other.
        last: What is returned where no frame was done between them.
    """
    seconds = after.time - before.time
    if seconds <= 0.0:
        return last
    one, other = before.measured_cp, after.measured_cp
    turn = np.empty(3)
    mujoco.mju_rotVecQuat(turn, _turn(one, other), one.orientation)
    return Twist((other.position - one.position) / seconds, turn / seconds)
