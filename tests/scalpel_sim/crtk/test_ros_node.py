"""A client of ROS 2, on a stand-in of rclpy, drives a real run by the topics of CRTK."""

import subprocess
import sys
import time
from functools import partial

import numpy as np
import pytest

from bridge import CartesianPose, DeviceClient, DeviceState
from scalpel_sim.cli.crtk_command import crtk
from scalpel_sim.crtk.crtk_arm import CrtkArm, Twist, twist_between
from scalpel_sim.crtk.ros_node import CrtkNode, load_ros
from scalpel_sim.errors import RunError
from tests.support.ros_stand_in import stand_in
from tissue import Wrench

RATE = 200.0
SPEED = 0.03
"""Speed of the stream of poses [m/s]."""
PATIENCE = 30.0
"""Longest wait for something that takes a fraction of a second [s]: the machine may be busy."""


def started(folder, seconds):
    """A run that waits for a device, in another process; and where."""
    options = f"run grid2 --hand device --listen 127.0.0.1:0 --seconds {seconds} --quiet"
    run = subprocess.Popen(
        [sys.executable, "-m", "scalpel_sim", *options.split(), "--out", str(folder)],
        stderr=subprocess.PIPE,
        text=True,
    )
    address = next(line for line in run.stderr if "waiting for a device" in line).split()[-1]
    return run, address


class Client:
    """A client of /PSM1, and the bridge that it talks to, in turn."""

    def __init__(self, address, monkeypatch):
        modules, self.graph = stand_in()
        for name, module in modules.items():
            monkeypatch.setitem(sys.modules, name, module)
        self.ros = load_ros()
        self.ros.rclpy.init(args=[])
        connect = partial(DeviceClient, address, period=1.0 / RATE)
        self.arm = CrtkArm(connect(), connect)
        self.node = self.ros.rclpy.create_node("test")
        CrtkNode(self.ros, self.node, self.arm, "PSM1", RATE)
        self._say = {
            topic: self.node.create_publisher(kind, f"/PSM1/{topic}", 10)
            for topic, kind in (
                ("state_command", self.ros.crtk.StringStamped),
                ("servo_cp", self.ros.geometry.PoseStamped),
                ("move_cp", self.ros.geometry.PoseStamped),
            )
        }
        self.until(lambda: self.heard("measured_cp"))

    def heard(self, topic):
        return self.graph.said[f"/PSM1/{topic}"]

    def last(self, topic):
        return self.heard(topic)[-1]

    def until(self, is_so):
        end = time.monotonic() + PATIENCE
        while not is_so():
            assert time.monotonic() < end, self.graph.warnings
            self.ros.rclpy.spin_once(self.node, timeout_sec=0.1)

    def spin(self, seconds):
        end = time.monotonic() + seconds
        self.until(lambda: time.monotonic() >= end)

    def command(self, word):
        message = self.ros.crtk.StringStamped()
        message.string = word
        self._say["state_command"].publish(message)
        self.until(lambda: not self.graph.waiting)

    def send(self, topic, position, orientation):
        message = self.ros.geometry.PoseStamped()
        place, turned = message.pose.position, message.pose.orientation
        place.x, place.y, place.z = position
        turned.w, turned.x, turned.y, turned.z = orientation
        self._say[topic].publish(message)
        self.until(lambda: not self.graph.waiting)

    def state(self):
        said = self.last("operating_state")
        return said.state, said.is_homed, said.is_busy

    def pose(self, topic="measured_cp"):
        place, turned = self.last(topic).pose.position, self.last(topic).pose.orientation
        return (
            np.array([place.x, place.y, place.z]),
            np.array([turned.w, turned.x, turned.y, turned.z]),
        )

    def wrench(self, topic):
        force, torque = self.last(topic).wrench.force, self.last(topic).wrench.torque
        return np.array([[part.x, part.y, part.z] for part in (force, torque)])

    def make_ready(self):
        self.command("enable")
        self.command("home")
        self.until(lambda: self.heard("setpoint_cp"))

    def lead(self, way):
        """Stream poses along a way [m] at SPEED, as a leader arm does; return the last."""
        start, orientation = self.pose("setpoint_cp")
        length, begun = float(np.linalg.norm(way)), time.monotonic()
        share = 0.0
        while share < 1.0:
            share = min(SPEED * (time.monotonic() - begun) / length, 1.0)
            self.send("servo_cp", start + share * np.asarray(way), orientation)
            self.spin(0.01)
        return start + way

    def close(self):
        self.arm.close()


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    process, address = started(tmp_path_factory.mktemp("run"), 60)
    yield address
    process.kill()
    process.communicate()


@pytest.fixture
def client(run, monkeypatch):
    found = Client(run, monkeypatch)
    yield found
    found.close()


class Enabler:
    """Enables and homes an arm from its first message on."""

    def __init__(self, graph):
        self._graph, self._words = graph, ["enable", "home"]

    def before(self, spin_once):
        def spin(node, timeout_sec):
            if self._words and self._graph.said["/PSM2/operating_state"]:
                message = sys.modules["crtk_msgs.msg"].StringStamped()
                message.string = self._words.pop(0)
                for read in self._graph.readers["/PSM2/state_command"]:
                    self._graph.waiting.append((read, message))
            return spin_once(node, timeout_sec)

        return spin


def axes(quaternion):
    w, *vector = quaternion
    x = np.array(vector)
    cross = np.cross(np.eye(3), x)
    return (np.eye(3) + 2.0 * (w * cross + cross @ cross)).T


def test_an_arm_is_disabled_at_first_and_refuses_motion_until_it_is_enabled_and_homed(client):
    assert client.state() == ("DISABLED", False, False)
    before, turned = client.pose()
    for command, reason in (("pause", "it is DISABLED"), ("enable", "it is not homed")):
        client.command(command)
        client.send("servo_cp", before + np.array([0.0, 0.01, 0.0]), turned)
        assert any(reason in text for text in client.graph.warnings), client.graph.warnings
    client.spin(0.1)
    assert not client.heard("setpoint_cp")
    np.testing.assert_allclose(client.pose()[0], before, atol=1e-4)
    client.command("home")
    assert client.state() == ("ENABLED", True, False)


def test_a_client_that_comes_later_learns_the_operating_state(client):
    client.make_ready()
    heard = []
    kind = client.ros.crtk.OperatingState
    client.node.create_subscription(kind, "/PSM1/operating_state", heard.append, 10)
    client.until(lambda: heard)
    assert (heard[0].state, heard[0].is_homed) == ("ENABLED", True)


def test_the_tool_points_out_of_the_tip_and_cuts_towards_its_y(client):
    """The blade of the scene stands, and cuts towards +y."""
    across, forward, out = axes(client.pose()[1]).T
    np.testing.assert_allclose(out, [0.0, 0.0, -1.0], atol=0.02)
    np.testing.assert_allclose(forward, [0.0, 1.0, 0.0], atol=0.02)
    np.testing.assert_allclose(across, np.cross(forward, out), atol=1e-9)


def test_a_stream_of_poses_leads_the_blade_and_it_exerts_a_force_where_it_cuts(client):
    client.make_ready()
    goal = client.lead([0.0, 0.03, 0.0])
    client.spin(0.5)
    np.testing.assert_allclose(client.pose("setpoint_cp")[0], goal, atol=1e-9)
    np.testing.assert_allclose(client.pose()[0], goal, atol=1e-3)
    along = [message.wrench.force.y for message in client.heard("measured_cf")]
    assert max(along) > 0.3  # toughness times width is 0.8 N


def test_a_bridge_that_falls_asleep_leads_to_the_very_pose_afterwards(client):
    """The run has released the blade meanwhile."""
    client.make_ready()
    start, turned = client.pose("setpoint_cp")
    goal = start + np.array([0.0, -0.01, 0.0])
    for share in (0.3, 0.6, 1.0):
        time.sleep(0.15)
        client.send("servo_cp", start + share * (goal - start), turned)
    client.spin(0.7)
    np.testing.assert_allclose(client.pose()[0], goal, atol=1e-3)


def test_a_pose_that_is_farther_ahead_than_the_run_remembers_is_reached(client):
    client.make_ready()
    start, turned = client.pose("setpoint_cp")
    goal = start + np.array([0.0, 0.0, 0.05])
    client.send("servo_cp", goal, turned)
    client.until(lambda: np.linalg.norm(client.pose()[0] - goal) < 1e-3)
    np.testing.assert_allclose(client.pose("setpoint_cp")[0], goal, atol=1e-9)
    client.send("servo_cp", start, turned)
    client.until(lambda: np.linalg.norm(client.pose()[0] - start) < 1e-3)
    np.testing.assert_allclose(client.pose("setpoint_cp")[0], start, atol=1e-9)


def test_the_three_wrenches_are_one_seen_from_the_tip_in_two_frames_and_from_the_origin(client):
    client.make_ready()
    client.lead([0.0, -0.01, 0.0])
    turned, tip = axes(client.pose()[1]), client.pose()[0]
    force, torque = client.wrench("measured_cf")
    np.testing.assert_allclose(
        turned @ client.wrench("body/measured_cf").T, np.array([force, torque]).T
    )
    about_origin = torque + np.cross(tip, force)
    np.testing.assert_allclose(client.wrench("spatial/measured_cf"), [force, about_origin])
    frames = [client.last(f"{of}measured_cf").header.frame_id for of in ("", "body/", "spatial/")]
    assert frames == ["world", "PSM1", "world"]


def test_a_paused_arm_rests_and_goes_on_from_where_it_is(client):
    client.make_ready()
    client.command("pause")
    client.spin(0.2)
    before, turned = client.pose()
    client.send("servo_cp", before + np.array([0.0, 0.005, 0.0]), turned)
    client.spin(0.2)
    np.testing.assert_allclose(client.pose()[0], before, atol=1e-4)
    client.command("resume")
    client.until(lambda: client.state() == ("ENABLED", True, False))
    goal = client.lead([0.0, 0.005, 0.0])
    client.spin(0.5)
    np.testing.assert_allclose(client.pose()[0], goal, atol=1e-3)


def test_the_velocity_is_how_the_pose_changes_by_simulated_time():
    turned = np.array([np.cos(5e-3), 0.0, 0.0, np.sin(5e-3)])
    nothing = Wrench(np.zeros(3), np.zeros(3), np.zeros(3))
    before, after = (
        DeviceState(*each, nothing, is_engaged=True, has_ended=False, n_limited=0)
        for each in (
            (1.0, 0.5, CartesianPose(np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]))),
            (1.01, 0.5, CartesianPose(np.array([0.0, 1e-3, 0.0]), turned)),
        )
    )
    rest = Twist(np.zeros(3), np.zeros(3))
    found = twist_between(before, after, rest)
    np.testing.assert_allclose(found.linear, [0.0, 0.1, 0.0], atol=1e-9)
    np.testing.assert_allclose(found.angular, [0.0, 0.0, 1.0], atol=1e-6)
    assert twist_between(before, before, found) is found


def test_a_move_is_busy_until_it_is_there(client):
    client.make_ready()
    start, turned = client.pose("setpoint_cp")
    goal = start + np.array([0.0, -0.004, 0.003])
    client.send("move_cp", goal, turned)
    assert client.state() == ("ENABLED", True, True)
    client.until(lambda: not client.state()[2])
    client.spin(0.5)
    np.testing.assert_allclose(client.pose("setpoint_cp")[0], goal, atol=1e-9)
    np.testing.assert_allclose(client.pose()[0], goal, atol=1e-3)


def test_a_pose_that_is_far_away_or_none_is_refused(client):
    client.make_ready()
    start, turned = client.pose("setpoint_cp")
    client.send("servo_cp", start + np.array([0.0, 0.5, 0.0]), turned)
    client.send("servo_cp", start * np.nan, turned)
    client.spin(0.1)
    told = " ".join(client.graph.warnings)
    assert "it is 0.5 m" in told and "use move_cp" in told and "a finite place" in told
    np.testing.assert_allclose(client.pose("setpoint_cp")[0], start)


def test_an_arm_whose_run_is_gone_is_in_fault_and_says_so(tmp_path, monkeypatch):
    process, address = started(tmp_path, 60)
    client = Client(address, monkeypatch)
    client.make_ready()
    process.kill()
    process.communicate()
    client.until(lambda: client.state()[0] == "FAULT")
    assert any("the run is lost" in text for text in client.graph.warnings)
    n_poses = len(client.heard("measured_cp"))
    client.command("enable")
    client.spin(0.1)
    assert client.state()[0] == "FAULT" and len(client.heard("measured_cp")) == n_poses


def test_the_command_serves_a_run_until_it_ends(tmp_path, monkeypatch):
    process, address = started(tmp_path, 0.3)
    modules, graph = stand_in()
    for name, module in modules.items():
        monkeypatch.setitem(sys.modules, name, module)
    at_rest = Enabler(graph)
    monkeypatch.setattr(modules["rclpy"], "spin_once", at_rest.before(modules["rclpy"].spin_once))
    crtk(address, name="PSM2")
    process.communicate(timeout=PATIENCE)
    states = [message.state for message in graph.said["/PSM2/operating_state"]]
    assert states[0] == "DISABLED" and "ENABLED" in states and states[-1] == "FAULT"


def test_without_ros_the_command_says_what_it_needs(monkeypatch):
    monkeypatch.setitem(sys.modules, "rclpy", None)
    with pytest.raises(RunError, match="Source its setup file"):
        load_ros()
