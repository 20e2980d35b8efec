"""Topics of ROS 2 by which clients of CRTK and of the research kit see and drive an arm."""

import importlib
from collections.abc import Callable
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np

from bridge import CartesianPose
from scalpel_sim.crtk.crtk_arm import CrtkArm
from scalpel_sim.crtk.operating_state import CommandError
from scalpel_sim.errors import RunError
from tissue import FloatArray

REFERENCE = "world"
"""Name of the frame in which poses are given: that of the run's world, z up."""

_STATE_PERIOD = 0.1
"""Interval at which the operating state is published without a change [s]."""

_QUIET_PERIOD = 2.0
"""Shortest interval at which a refusal is logged [s]: a stream of 1 kHz may be refused, as by the
research kit."""

_SAME = 30
"""Characters at the beginning of refusals by which they count as the same: numbers follow."""

_DEPTH = 10
"""Messages that a topic keeps for a slow reader."""


class RosModules(NamedTuple):
    """The modules of ROS 2 that a node needs."""

    rclpy: ModuleType
    qos: ModuleType
    geometry: ModuleType
    std: ModuleType
    crtk: ModuleType


def load_ros() -> RosModules:
    """Return the modules of ROS 2.

    Raises:
        RunError: they cannot be loaded.
    """
    names = ("rclpy", "rclpy.qos", "geometry_msgs.msg", "std_msgs.msg", "crtk_msgs.msg")
    try:
        return RosModules(*(importlib.import_module(name) for name in names))
    except ImportError as cause:
        raise RunError(
            f"ROS 2 cannot be loaded ({cause}). Source its setup file and that of the workspace "
            "with crtk_msgs before, and use an environment of the same Python that sees both: "
            "python -m venv --system-site-packages"
        ) from cause


class CrtkNode:
    """Publishes an arm, and takes what clients command.

    Args:
        ros: The modules of ROS 2.
        node: A node of rclpy.
        arm: The arm.
        name: Namespace of the topics, such as PSM1.
        rate: How often the arm is led and published [1/s].
    """

    def __init__(self, ros: RosModules, node: Any, arm: CrtkArm, name: str, rate: float) -> None:
        self._ros, self._node, self._arm, self._name = ros, node, arm, name
        self._published_at = -np.inf
        self._warned_at: dict[str, float] = {}
        self._published: tuple[str, bool, bool] | None = None
        geometry, crtk = ros.geometry, ros.crtk
        latched = ros.qos.QoSProfile(depth=1, durability=ros.qos.DurabilityPolicy.TRANSIENT_LOCAL)
        self._operating_state = self._publisher("operating_state", crtk.OperatingState, latched)
        self._measured_cp = self._publisher("measured_cp", geometry.PoseStamped)
        self._setpoint_cp = self._publisher("setpoint_cp", geometry.PoseStamped)
        self._measured_cv = self._publisher("measured_cv", geometry.TwistStamped)
        self._measured_cf = self._publisher("measured_cf", geometry.WrenchStamped)
        self._body_cf = self._publisher("body/measured_cf", geometry.WrenchStamped)
        self._spatial_cf = self._publisher("spatial/measured_cf", geometry.WrenchStamped)
        self._listen("state_command", crtk.StringStamped, lambda each: arm.command(each.string))
        self._listen("servo_cp", geometry.PoseStamped, lambda each: arm.servo_cp(_pose_in(each)))
        self._listen("move_cp", geometry.PoseStamped, lambda each: arm.move_cp(_pose_in(each)))
        self._listen("hold", ros.std.Empty, lambda _: arm.hold())
        node.create_timer(1.0 / rate, self._tick)

    def _publisher(self, topic: str, kind: type, qos: Any = _DEPTH) -> Any:
        return self._node.create_publisher(kind, f"/{self._name}/{topic}", qos)

    def _listen(self, topic: str, kind: type, act: Callable[[Any], None]) -> None:
        """Do something with each message of a topic; what is refused is logged."""

        def guarded(message: Any) -> None:
            try:
                act(message)
            except CommandError as error:
                self._warn(error)
            self._publish_state()

        self._node.create_subscription(kind, f"/{self._name}/{topic}", guarded, _DEPTH)

    def _tick(self) -> None:
        try:
            self._arm.tick()
        except CommandError as error:
            self._warn(error)
        self._publish_state()
        if self._arm.operating.state != "FAULT":  # what is not valid is not published
            self._publish_motion()

    def _publish_motion(self) -> None:
        measured, setpoint = self._arm.measured, self._arm.setpoint_cp
        self._measured_cp.publish(self._pose_message(measured.cp))
        if setpoint is not None:
            self._setpoint_cp.publish(self._pose_message(setpoint))
        velocity = self._stamped(self._ros.geometry.TwistStamped)
        _fill(velocity.twist.linear, measured.cv.linear)
        _fill(velocity.twist.angular, measured.cv.angular)
        self._measured_cv.publish(velocity)
        force, torque = measured.force, measured.torque
        axes = _axes(measured.cp.orientation)
        about_origin = torque + np.cross(measured.cp.position, force)
        self._measured_cf.publish(self._wrench_message(force, torque))
        self._spatial_cf.publish(self._wrench_message(force, about_origin))
        self._body_cf.publish(self._wrench_message(axes.T @ force, axes.T @ torque, self._name))

    def _publish_state(self) -> None:
        """Publish the operating state where it has changed, and from time to time."""
        arm = self._arm
        state = arm.operating.state, arm.operating.is_homed, arm.is_busy
        if state == self._published and self._now() - self._published_at < _STATE_PERIOD:
            return
        message = self._stamped(self._ros.crtk.OperatingState)
        message.state, message.is_homed, message.is_busy = state
        self._operating_state.publish(message)
        self._published, self._published_at = state, self._now()

    def _warn(self, error: CommandError) -> None:
        """Log that something was refused, and why; the same of a stream from time to time."""
        reason = str(error)[:_SAME]
        if self._now() - self._warned_at.get(reason, -np.inf) >= _QUIET_PERIOD:
            self._warned_at[reason] = self._now()
            self._node.get_logger().warning(f"{self._name}: {error}")

    def _now(self) -> float:
        return float(self._node.get_clock().now().nanoseconds) * 1e-9

    def _stamped(self, kind: type, frame: str = REFERENCE) -> Any:
        """Return an empty message of now."""
        message: Any = kind()
        message.header.stamp = self._node.get_clock().now().to_msg()
        message.header.frame_id = frame
        return message

    def _pose_message(self, pose: CartesianPose) -> Any:
        message = self._stamped(self._ros.geometry.PoseStamped)
        _fill(message.pose.position, pose.position)
        turned = message.pose.orientation
        turned.w, turned.x, turned.y, turned.z = pose.orientation.tolist()
        return message

    def _wrench_message(self, force: FloatArray, torque: FloatArray, frame: str = REFERENCE) -> Any:
        message = self._stamped(self._ros.geometry.WrenchStamped, frame)
        _fill(message.wrench.force, force)
        _fill(message.wrench.torque, torque)
        return message


def spin(ros: RosModules, arm: CrtkArm, name: str, rate: float) -> None:
    """Serve the topics of an arm until the run ends, or ROS shuts down.

    Args:
        ros: The modules of ROS 2.
        arm: The arm.
        name: Namespace of its topics.
        rate: How often it is led and published [1/s].
    """
    ros.rclpy.init(args=[])
    try:
        node = ros.rclpy.create_node(f"scalpel_sim_{name}".lower())
        CrtkNode(ros, node, arm, name, rate)
        while ros.rclpy.ok() and not arm.has_ended:
            ros.rclpy.spin_once(node, timeout_sec=_STATE_PERIOD)
        node.destroy_node()
    finally:
        if ros.rclpy.ok():
            ros.rclpy.shutdown()


def _pose_in(message: Any) -> CartesianPose:
    """Return the pose of a message."""
    place, turned = message.pose.position, message.pose.orientation
    return CartesianPose(
        np.array([place.x, place.y, place.z]),
        np.array([turned.w, turned.x, turned.y, turned.z]),
    )


def _fill(part: Any, values: FloatArray) -> None:
    """Write x, y and z of a part of a message."""
    part.x, part.y, part.z = values.tolist()


def _axes(quaternion: FloatArray) -> FloatArray:
    """Return the axes of a rotation as columns, shape (3, 3)."""
    w, x, y, z = quaternion.tolist()
    return np.array(
        [
            [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
            [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
            [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
        ]
    )
