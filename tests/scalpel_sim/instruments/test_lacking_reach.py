"""Arms of any hinges and slides reach what their joints allow; else a message says what lacks."""

import re

import mujoco
import numpy as np
import pytest
from msgspec import structs

from bridge import DeviceLimits, TissueFrame
from scalpel_sim import GrasperTable, WaypointTable, prepare, read_scene
from scalpel_sim.arm.placement import PlacementError
from scalpel_sim.instruments.own_arm import move_to_start, own_arm
from scalpel_sim.scene.scene import changed
from scalpel_sim.strokes.stroke import Stroke
from tests.scalpel_sim.instruments.test_own_arm import (
    EXAMPLES,
    FORWARD,
    changed_model,
    scene_with,
)
from tissue import BladeSegment

X, Y, Z = (1, 0, 0), (0, 1, 0), (0, 0, 1)
OBLIQUE = (0.6, 0.0, 0.8)
CHAINS = {
    "one slide": [("slide", OBLIQUE)],
    "one hinge": [("hinge", Z)],
    "two slides": [("slide", X), ("slide", OBLIQUE)],
    "gantry": [("slide", X), ("slide", Y), ("slide", Z)],
    "hinges about one axis": [("hinge", Z), ("hinge", Z), ("hinge", Z)],
    "scara": [("hinge", Z), ("hinge", Z), ("slide", Z), ("hinge", Z)],
    "five joints": [("slide", X), ("hinge", Z), ("hinge", X), ("hinge", X), ("slide", Y)],
    "six hinges": [("hinge", Z), *[("hinge", X)] * 2, ("hinge", Y), ("hinge", X), ("hinge", Y)],
    "seven joints": [("hinge", Z), ("slide", X), *[("hinge", X), ("hinge", Y)] * 2, ("slide", Z)],
}


def chain(folder, joints):
    """An arm of these joints, with a knife that points down."""
    bodies = ""
    for kind, axis in joints:
        ends = "-0.4 0.4" if kind == "slide" else "-2.8 2.8"
        bodies += f"""<body pos=".15 0 .05">
            <joint type="{kind}" axis="{axis[0]} {axis[1]} {axis[2]}" range="{ends}"
                armature=".1" damping="2"/><geom size=".02" mass=".5"/>"""
    path = folder / "chain.xml"
    path.write_text(
        f"""<mujoco><compiler angle="radian"/><option timestep=".001"/><worldbody>{bodies}
        <body pos=".1 0 0"><geom type="box" size=".0002 .003 .035" mass=".05"/>
        <site name="heel" pos="0 .003 .035"/><site name="tip" pos="0 .003 -.035"/></body>
        {"</body>" * len(joints)}</worldbody></mujoco>""",
        encoding="utf-8",
    )
    return own_arm(path, DeviceLimits(), forward=FORWARD)


def stroke_of(arm, seed=0):
    """A stroke that the arm can do: all joints move a bit, from somewhere in their ranges."""
    random, (low, high) = np.random.default_rng(seed), arm.ranges()
    begin = random.uniform(0.4 * low, 0.4 * high)
    end = begin + 0.05 * random.uniform(low, high)
    times, poses = np.linspace(0.0, 1.0, 33), []
    for t in times:
        arm.reset(begin + t * (end - begin))
        poses.append(arm.blade.segment())
    arm.reset(np.zeros(len(low)))
    return Stroke(times, poses)


def corrected(message, table="world"):
    """The `pos` that a message says."""
    found = re.search(rf"With \[{table}\].* pos = \[(.*)\] it is reached", message)
    return np.array([float(x) for x in found[1].split(",")])


@pytest.mark.parametrize("joints", CHAINS.values(), ids=CHAINS)
def test_a_chain_reaches_a_stroke_that_its_joints_can_do(joints, tmp_path):
    arm = chain(tmp_path, joints)
    stroke = stroke_of(arm)
    move_to_start(arm, stroke, TissueFrame())
    start, found = stroke.pose(0.0), arm.blade.segment()
    np.testing.assert_allclose([found.tip, found.heel], [start.tip, start.heel], atol=1e-3)


@pytest.mark.parametrize("name", ["two slides", "scara", "six hinges"])
def test_a_tissue_out_of_reach_is_reached_at_the_pos_that_the_message_says(name, tmp_path):
    arm = chain(tmp_path, CHAINS[name])
    stroke, away = stroke_of(arm), np.array([2.0, -0.7, 1.1])
    with pytest.raises(PlacementError, match=r"it lies .* mm out of reach, in the dir") as refused:
        move_to_start(arm, stroke, TissueFrame(origin=away))
    message = str(refused.value)
    assert not re.search(r"\b(inf|nan)\b", message)
    pos = corrected(message)
    move_to_start(arm, stroke, TissueFrame(origin=pos))
    distance, *direction = map(
        float, re.search(r"lies (\S+) mm .* \((.*), (.*), (.*)\) of the world", message).groups()
    )
    np.testing.assert_allclose(distance * np.array(direction), 1e3 * (away - pos), atol=30.0)


def test_a_scene_out_of_reach_runs_after_its_pos_was_corrected_by_no_more_than_it_must(tmp_path):
    origin = (5.0, 0.4, 0.02)
    path = scene_with(tmp_path, ("pos = [-0.03, 0.4, 0.02]", f"pos = {list(origin)}"))
    scene = read_scene(path)
    with pytest.raises(PlacementError) as refused:
        prepare(scene)
    pos = corrected(str(refused.value))
    nearer = pos + 0.05 * (origin - pos) / np.linalg.norm(origin - pos)
    prepare(changed(scene, pos=tuple(pos)))
    with pytest.raises(PlacementError):
        prepare(changed(scene, pos=tuple(nearer)))
    with pytest.raises(PlacementError) as refused:
        prepare(scene, is_led=True)
    assert np.isfinite(corrected(str(refused.value))).all()


def test_a_robot_with_a_grasper_is_told_its_own_pos(tmp_path):
    bare = changed_model(tmp_path)
    rest = [WaypointTable(time=0.0, at=(0.03, 0.02, 0.15), opening=0.01), WaypointTable(time=0.1)]
    turned = (0.6, 0.0, 0.0, 0.8)
    held = GrasperTable(model=str(bare), at="wrist_3", pos=(-3, 0, 0), quat=turned, motion=rest)
    scene = changed(read_scene(EXAMPLES / "robot.toml"), graspers=(held,))
    with pytest.raises(PlacementError, match="of the tissue's frame") as refused:
        prepare(scene)
    pos = tuple(corrected(str(refused.value), r"\[grasper\]"))
    prepare(changed(scene, graspers=(structs.replace(held, pos=pos),)))


GANTRY = CHAINS["gantry"]


@pytest.mark.parametrize(
    ("joints", "turn", "end", "lacks"),
    [
        (
            GANTRY,
            X,
            (0.0, 0.05, 0.0),
            "None of its joints turns it by 30 degrees about (1.00, 0.00, 0.00)",
        ),
        (
            GANTRY[:2],
            None,
            (0.0, 0.05, 0.02),
            "None of its joints moves it by 20 mm in the direction (0.00, 0.00, 1.00)",
        ),
        (
            CHAINS["scara"],
            Y,
            (0.0, 0.05, 0.0),
            "None of its joints turns it by 30 degrees about (0.00, 1.00, 0.00)",
        ),
    ],
)
def test_a_motion_that_an_arm_lacks_is_named_with_its_axis_and_amount(
    joints, turn, end, lacks, tmp_path
):
    arm = chain(tmp_path, joints)
    edge = arm.blade.segment()
    poses = [
        BladeSegment(
            edge.tip + share * np.array(end), edge.heel + share * np.array(end), edge.forward
        )
        for share in (0.0, 1.0)
    ]
    axes = np.eye(3).ravel()
    if turn is not None:
        quaternion = np.array([np.cos(np.pi / 12), *np.sin(np.pi / 12) * np.array(turn)])
        mujoco.mju_quat2Mat(axes, quaternion)
    with pytest.raises(PlacementError, match=re.escape(lacks)):
        move_to_start(arm, Stroke([0.0, 1.0], poses), TissueFrame(axes.reshape(3, 3)))


@pytest.mark.parametrize(
    ("name", "bent"), [("gantry", (0.0, 0.0, 0.0)), ("hinges about one axis", (0.5, -1.0, 0.5))]
)
def test_an_arm_that_cannot_turn_every_way_cuts_the_block_in_two(name, bent, tmp_path):
    arm = chain(tmp_path, CHAINS[name])
    arm.reset(bent)
    scene = read_scene(EXAMPLES / "robot.toml")
    (stroke,) = scene.strokes
    pos = tuple(arm.blade.segment().tip - np.array(stroke.points[0]))
    simulation = prepare(changed(scene, model=str(tmp_path / "chain.xml"), pos=pos))
    simulation.run(simulation.stroke.duration)
    assert simulation.link.n_pieces() == 2
