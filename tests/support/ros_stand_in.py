"""A stand-in of ROS 2: what of rclpy and of the messages the bridge uses, in one process.

Names and fields are those of rclpy, geometry_msgs, std_msgs and crtk_msgs. It delivers messages in
order, and drops none; it knows no network and no quality of service but that a latched topic keeps
its last message for who comes later.
"""

import copy
import time
from types import ModuleType, SimpleNamespace


def _message(**fields):
    """A kind of message with a header; fields are lists of names, or texts."""

    class Message:
        def __init__(self):
            self.header = SimpleNamespace(stamp=None, frame_id="")
            for name, parts in copy.deepcopy(fields).items():
                setattr(self, name, parts)

    return Message


def _vector():
    return SimpleNamespace(x=0.0, y=0.0, z=0.0)


class Time:
    """An instant."""

    def __init__(self, nanoseconds):
        self.nanoseconds = nanoseconds

    def to_msg(self):
        return SimpleNamespace(sec=self.nanoseconds // 10**9, nanosec=self.nanoseconds % 10**9)


class Graph:
    """The topics, and who publishes and reads them."""

    def __init__(self):
        self.said = {}
        """All messages of each topic."""
        self.readers = {}
        self.latched = set()
        self.warnings = []
        self.waiting = []


class Node:
    """A node, as `rclpy.create_node` returns it."""

    def __init__(self, graph, name):
        assert name.isidentifier()
        self._graph = graph
        self.timers = []

    def create_publisher(self, kind, topic, qos):
        assert topic.startswith("/")
        if getattr(qos, "durability", None) == "transient local":
            self._graph.latched.add(topic)
        self._graph.said.setdefault(topic, [])

        def publish(message):
            assert isinstance(message, kind)
            message = copy.deepcopy(message)
            self._graph.said[topic].append(message)
            for read in self._graph.readers.get(topic, []):
                self._graph.waiting.append((read, message))

        return SimpleNamespace(publish=publish)

    def create_subscription(self, kind, topic, callback, qos):
        self._graph.readers.setdefault(topic, []).append(callback)
        if topic in self._graph.latched and self._graph.said[topic]:
            self._graph.waiting.append((callback, self._graph.said[topic][-1]))

    def create_timer(self, period, callback):
        self.timers.append([time.monotonic(), period, callback])

    def get_clock(self):
        return SimpleNamespace(now=lambda: Time(time.time_ns()))

    def get_logger(self):
        return SimpleNamespace(warning=self._graph.warnings.append)

    def destroy_node(self):
        self.timers.clear()


def stand_in():
    """Return modules by their names, and the graph that they share."""
    graph = Graph()
    rclpy, qos, geometry, std, crtk = (
        ModuleType(name)
        for name in ("rclpy", "rclpy.qos", "geometry_msgs.msg", "std_msgs.msg", "crtk_msgs.msg")
    )
    is_up = []

    def spin_once(node, timeout_sec):
        """Do what is due next: one message, or one timer."""
        if graph.waiting:
            read, message = graph.waiting.pop(0)
            return read(message)
        until = time.monotonic() + timeout_sec
        due = min(node.timers, key=lambda timer: timer[0], default=None)
        if due is None or due[0] > until:
            time.sleep(timeout_sec)
            return None
        time.sleep(max(0.0, due[0] - time.monotonic()))
        due[0] = max(due[0] + due[1], time.monotonic())
        return due[2]()

    rclpy.init = lambda args: is_up.append(True)
    rclpy.ok = lambda: bool(is_up)
    rclpy.shutdown = is_up.clear
    rclpy.create_node = lambda name: Node(graph, name)
    rclpy.spin_once = spin_once
    qos.DurabilityPolicy = SimpleNamespace(TRANSIENT_LOCAL="transient local")
    qos.QoSProfile = lambda depth, durability: SimpleNamespace(depth=depth, durability=durability)
    turned = SimpleNamespace(w=1.0, x=0.0, y=0.0, z=0.0)
    geometry.PoseStamped = _message(pose=SimpleNamespace(position=_vector(), orientation=turned))
    geometry.TwistStamped = _message(twist=SimpleNamespace(linear=_vector(), angular=_vector()))
    geometry.WrenchStamped = _message(wrench=SimpleNamespace(force=_vector(), torque=_vector()))
    std.Empty = _message()
    crtk.StringStamped = _message(string="")
    crtk.OperatingState = _message(state="", is_homed=False, is_busy=False)
    return {module.__name__: module for module in (rclpy, qos, geometry, std, crtk)}, graph
