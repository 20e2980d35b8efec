"""An arm of the user's own in a scene: a robot with the kinematics of a UR5e, from MJCF alone."""

import re
import sys
from pathlib import Path

import mujoco
import numpy as np
import pytest

from bridge import DeviceLimits, TissueFrame
from scalpel_sim import prepare, read_scene
from scalpel_sim.errors import UsageError
from scalpel_sim.instruments.own_arm import move_to_start, own_arm
from scalpel_sim.scene.scene import changed
from scalpel_sim.scene.write import scene_text
from scalpel_sim.strokes.csv_lines import StrokeError
from scalpel_sim.strokes.stroke import Stroke
from tissue import BladeSegment, pieces_of

EXAMPLES = Path(__file__).parents[3] / "docs" / "examples"
ROBOT = EXAMPLES / "robot.xml"
FORWARD = (0.0, 1.0, 0.0)


def robot():
    return own_arm(ROBOT, DeviceLimits(), forward=FORWARD)


def stroke_to(x, y, z):
    """A stroke of 50 mm towards +y, with the tip down."""
    tips = np.array([[x, y, z], [x, y + 0.05, z]])
    up, ahead = np.array([0.0, 0.0, 0.07]), np.array([0.0, 1.0, 0.0])
    return Stroke([0.0, 1.0], [BladeSegment(tip, tip + up, ahead) for tip in tips])


def changed_model(tmp_path, *changes):
    text = ROBOT.read_text(encoding="utf-8")
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path = tmp_path / "robot.xml"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def done():
    scene = read_scene(EXAMPLES / "robot.toml")
    simulation = prepare(changed(scene, toughness=20.0, toughness_exponent=0.0))
    simulation.run(simulation.stroke.duration)
    return simulation


def test_the_model_opens_by_itself():
    model = mujoco.MjModel.from_xml_path(str(ROBOT))
    assert {"heel", "tip"} <= {model.site(i).name for i in range(model.nsite)}
    assert (model.nv, model.nkey) == (6, 1)


def test_the_scene_has_thirty_lines_at_most():
    lines = (EXAMPLES / "robot.toml").read_text(encoding="utf-8").splitlines()
    assert len(lines) <= 30


def test_the_robot_cuts_the_block_in_two_and_feels_toughness_times_width(done):
    pieces = pieces_of(done.link.snapshot())
    assert len(pieces) == 2 and all(piece.is_held for piece in pieces)
    force = np.linalg.norm(done.recording.vector("force"), axis=1)
    assert np.median(force[force > 0.1]) == pytest.approx(20.0 * 0.04, rel=0.1)


def test_the_edge_follows_the_stroke_within_what_the_hand_yields(done):
    pose = done.frame.segment_to_world(done.stroke.pose(done.stroke.duration))
    assert np.linalg.norm(done.arm.blade.segment().tip - pose.tip) < 1e-3


def test_the_wrench_on_the_tissue_is_that_on_the_robot(done):
    applied = done.arm.data.xfrc_applied[done.arm.blade.body_id]
    np.testing.assert_allclose(applied[:3], done.wrench.force, atol=1e-12)


@pytest.mark.parametrize("place", [(0.0, 0.4, 0.1), (0.3, 0.3, 0.2), (-0.4, 0.1, 0.3)])
def test_inverse_kinematics_has_the_edge_at_the_start_of_the_stroke(place):
    arm, stroke = robot(), stroke_to(*place)
    frame = TissueFrame(origin=np.array([0.01, 0.02, 0.03]))
    move_to_start(arm, stroke, frame)
    wanted, found = frame.segment_to_world(stroke.pose(0.0)), arm.blade.segment()
    np.testing.assert_allclose(found.tip, wanted.tip, atol=1e-3)
    np.testing.assert_allclose(found.heel, wanted.heel, atol=1e-3)
    assert found.forward @ wanted.forward > 0.9999


def test_without_mink_one_sentence_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "mink", None)  # as if it were not there
    with pytest.raises(UsageError, match=r"needs mink .*: pip install 'scalpel-sim\[arms\]'"):
        move_to_start(robot(), stroke_to(0.0, 0.4, 0.1), TissueFrame())


def test_sensors_and_states_of_actuators_go_with_them(tmp_path):
    path = changed_model(
        tmp_path,
        (
            '<position joint="elbow" kp="2000"/>',
            '<general name="of_elbow" joint="elbow" dyntype="filter"/>',
        ),
        ('<key name="home"', '<key name="home" act="0" ctrl="0 0 0 0 0 0"'),
        (
            "</actuator>",
            """</actuator><sensor><actuatorfrc name="gone" actuator="of_elbow"/>
            <jointpos name="kept" joint="elbow"/></sensor>""",
        ),
    )
    model = own_arm(path, DeviceLimits(), forward=FORWARD).model
    assert [model.sensor(i).name for i in range(model.nsensor)] == ["kept"]
    assert (model.na, model.key("home").id) == (0, 0)


def test_gravity_is_compensated_and_actuators_are_taken_out():
    arm = robot()
    with pytest.raises(KeyError):
        arm.model.actuator("elbow")
    before = arm.blade.segment().tip
    for _ in range(200):
        arm.step1()
        arm.step2()
        arm.check()
    assert np.linalg.norm(arm.blade.segment().tip - before) < 1e-5


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        (('name="tip"', 'name="end"'), "has no site 'tip'. It has: 'heel', 'end'"),
        (
            ('<joint name="wrist_3"/>', '<joint name="wrist_3" type="ball" range="0 1"/>'),
            "other joints than hinges and slides: 'wrist_3' of body 'wrist_3' (ball)",
        ),
        (("<mujoco ", "<mujoko "), "robot.xml"),
    ],
)
def test_a_model_that_is_no_arm_is_refused(change, expected, tmp_path):
    path = changed_model(tmp_path, change)
    with pytest.raises(UsageError, match=re.escape(expected)):
        own_arm(path, DeviceLimits(), forward=FORWARD)


def scene_with(tmp_path, *changes):
    text = (EXAMPLES / "robot.toml").read_text(encoding="utf-8")
    text = text.replace('"robot.xml"', f"'{ROBOT}'")
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path = tmp_path / "scene.toml"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("changes", "error", "expected"),
    [
        ([("length = 0.06", "length = 0.09")], StrokeError, "is 70 mm long, and the stroke"),
        ([(f"'{ROBOT}'", "'nothing.xml'")], UsageError, "nothing.xml"),
        ([(f"model = '{ROBOT}'", "")], UsageError, "forward is for an arm of your own"),
        ([("model =", 'preset = "touch"\nmodel =')], UsageError, "a preset and a model"),
        ([("pos =", "quat = [0, 0, 0, 0]\npos =")], UsageError, "it is a rotation"),
        ([("force = 100.0", "force = -1.0")], UsageError, "must be a number above 0"),
    ],
)
def test_a_scene_that_no_arm_can_do_is_refused(changes, error, expected, tmp_path):
    with pytest.raises(error, match=expected):
        prepare(read_scene(scene_with(tmp_path, *changes)))


def test_a_scene_with_an_arm_of_its_own_reads_back_the_same(tmp_path):
    scene = read_scene(scene_with(tmp_path))
    path = tmp_path / "again.toml"
    path.write_text(scene_text(scene, path), encoding="utf-8")
    found = read_scene(path)
    assert Path(found.arm.model).resolve() == ROBOT.resolve()
    assert changed(found, model=scene.arm.model).settings() == scene.settings()


def test_the_world_of_the_arm_has_the_gravity_of_the_tissue_turned(tmp_path):
    angle = np.radians(10.0)
    quat = [float(np.cos(angle / 2.0)), 0.0, 0.0, float(np.sin(angle / 2.0))]
    turned = scene_with(tmp_path, ("[world]", f"[world]\ngravity = [1, 2, -9]\nquat = {quat}"))
    gravity = prepare(read_scene(turned)).arm.model.opt.gravity
    cosine, sine = np.cos(angle), np.sin(angle)
    expected = [cosine - 2.0 * sine, sine + 2.0 * cosine, -9.0]
    np.testing.assert_allclose(gravity, expected, atol=1e-12)
