"""Arms that hold a grasper beside the first: presets, robots from MJCF, and those of a package."""

import importlib.util
import itertools
import math
import re
import warnings
from pathlib import Path

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from bridge import TissueFrame
from scalpel_sim.arm.arm import Arm
from scalpel_sim.arm.placement import Neighbours, PlacementError, covered, place
from scalpel_sim.errors import UsageError
from scalpel_sim.instruments.driven_grasper import DrivenGrasper
from scalpel_sim.instruments.scene_graspers import (
    model_with_grasper,
    path_of_grasper,
    place_of_grasper,
    preset_with_grasper,
)
from scalpel_sim.scene.arm_tables import GrasperTable
from scalpel_sim.strokes.grasp_motion import GraspMotion, Waypoint
from tests.support.planned_strokes import plan_stroke
from tissue import Tissue, block

ROBOT = Path(__file__).parents[3] / "docs" / "examples" / "robot.xml"
LEFTWARDS, UP, Y = (-1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, 1.0, 0.0)
MOTION = GraspMotion(
    [
        Waypoint(0.0, (0.1, 0.03, 0.02), LEFTWARDS, UP, 0.015),
        Waypoint(0.4, (0.08, 0.02, 0.04), (-0.9, 0.1, -0.3), Y, 0.005),
    ],
    "left",
)
FROM_LEFT = GraspMotion([Waypoint(0.0, (-0.01, 0.03, 0.02), (1.0, 0.0, 0.0), UP, 0.01)], "left")
BODY = block((2, 2, 2), (0.06, 0.06, 0.03))
BOUNDS = np.array([[0.0, 0.0, 0.0], [0.06, 0.06, 0.03]])
TIMES = np.linspace(0.0, 0.4, 9)
FRAME = TissueFrame(origin=np.array([0.1, 0.2, 0.3]))


def preset():
    placement, *_ = place_of_grasper(MOTION, "auto", Neighbours(BOUNDS, TIMES, -0.05))
    return preset_with_grasper(MOTION, placement, FRAME)


def robot(path=ROBOT, at="wrist_3", pos=(0.6, 0.03, -0.1), quat=None):
    return model_with_grasper(MOTION, table(path, at, pos, quat), FRAME)


def table(path=ROBOT, at="wrist_3", pos=(0.6, 0.03, -0.1), quat=None):
    return GrasperTable(model=str(path), at=at, pos=pos, quat=quat)


def misses_of(held, motion=MOTION):
    """Do a motion beside another arm; how far are the pads from where they are to be [m, rad]?"""
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # of MuJoCo, that parts of the model contradict each other
        arm = Arm("touch", base_position=(-1.0, 0.0, 0.0), others=[held])
    (grasper,) = arm.graspers
    led = DrivenGrasper(grasper, arm.data, motion, Tissue(BODY), FRAME, None)
    wanted = motion.stroke(0.0, 0.01)
    misses = []
    for _ in range(round((motion.duration + 0.05) / arm.model.opt.timestep)):
        now = arm.time
        led.lead(now)
        arm.step1()
        pose = FRAME.segment_to_world(wanted.pose(now))
        along = pose.tip - pose.heel
        cosine = grasper.pads.axes[:, 1] @ along / np.linalg.norm(along)
        off = np.linalg.norm(grasper.pads.centre - pose.heel)
        misses.append((off, np.arccos(min(cosine, 1.0)), grasper.opening - motion.opening(now)))
        arm.step2()
        arm.check()
    return np.abs(misses)


@pytest.mark.parametrize("make", [preset, robot])
def test_pads_follow_the_motion_from_its_start_to_its_end(make):
    misses = misses_of(make())
    assert (misses[0] < (1e-4, 1e-3, 1e-5)).all()
    assert (misses[:, 0] < 1e-3).all() and (misses[:, 1] < 0.01).all()
    assert (misses[-1] < (2e-4, 2e-3, 1e-4)).all()


@pytest.mark.parametrize(
    ("name", "pos"), [("panda", (0.55, 0.03, -0.4)), ("ur5e", (0.6, 0.03, -0.1))]
)
def test_robots_of_a_public_package_hold_the_grasper(name, pos):
    package = importlib.util.find_spec("robosuite")
    if package is None or package.origin is None:
        pytest.skip("its models come with robosuite: pip install --no-deps robosuite")
    folder = Path(package.origin).parent / "models" / "assets" / "robots"
    turned = (0.0, 0.0, 0.0, 1.0)  # it faces the tissue
    path = folder / name / "robot.xml"
    misses = misses_of(robot(path, "right_hand", pos, turned))
    assert (misses[:, 0] < 1e-3).all() and (misses[:, 1] < 0.03).all()
    assert (misses[-1] < (2e-4, 0.01, 1e-4)).all()


def test_a_robot_that_is_turned_in_the_frame_of_the_tissue_stands_so_in_the_world():
    turn = Rotation.from_rotvec([0.0, 0.0, 0.5]).as_matrix()
    held = robot(pos=(0.55, 0.1, -0.1), quat=(math.cos(0.25), 0.0, 0.0, math.sin(0.25)))
    arm = Arm("touch", base_position=(-1.0, 0.0, 0.0), others=[held])
    model, shoulder = arm.model, arm.model.body("left_shoulder").id
    assert model.body_pos[shoulder] == pytest.approx([0.65, 0.3, 0.2 + 0.1625])
    matrix = np.empty(9)
    mujoco.mju_quat2Mat(matrix, model.body_quat[shoulder])
    assert matrix.reshape(3, 3) == pytest.approx(turn, abs=1e-9)


def test_a_second_arm_stands_on_the_table_of_the_first_and_clear_of_it():
    stroke = plan_stroke("straight", BODY, speed=0.06)
    first = place(stroke, BOUNDS)
    times = np.linspace(0.0, stroke.duration, 9)
    height, there = -float(first.tissue_origin[2]), covered(first, stroke, BOUNDS, times)
    beside = Neighbours(BOUNDS, times, height, [there])
    second, spheres, _ = place_of_grasper(FROM_LEFT, "auto", beside)
    assert second.base_position[2] >= 0.0
    assert second.tissue_origin == pytest.approx(first.tissue_origin)
    apart = np.linalg.norm(spheres.centres[:, :, None] - there.centres[:, None], axis=3)
    assert (apart > spheres.radii[:, None] + there.radii).all()


def test_an_arm_that_reaches_only_where_the_other_is_says_so():
    placement, *_ = place_of_grasper(MOTION, "touch", Neighbours(BOUNDS, TIMES))
    there = covered(placement, path_of_grasper(MOTION), BOUNDS, TIMES)
    everywhere = there._replace(radii=there.radii + 1.0)
    with pytest.raises(PlacementError, match="not clear of the other arm"):
        place_of_grasper(MOTION, "touch", Neighbours(BOUNDS, TIMES, None, [everywhere]))


ROOM = np.array([[-0.06, -0.06, 0.0], [0.3, 0.12, 0.09]])
"""Where a hand is to lead the grasper [m], farther than any arm reaches."""


def led_preset():
    rest = MOTION.at_rest()
    place, _, room = place_of_grasper(rest, "auto", Neighbours(BOUNDS, TIMES, -0.05), ROOM)
    return preset_with_grasper(rest, place, FRAME, workspace=room)


def led_robot():
    return model_with_grasper(MOTION.at_rest(), table(), FRAME, ROOM)


@pytest.mark.parametrize("make", [led_preset, led_robot])
def test_an_arm_reaches_all_corners_of_the_room_in_which_a_hand_leads_its_grasper(make):
    held = make()
    room = held.workspace
    assert (room[0] >= ROOM[0]).all() and (room[1] <= ROOM[1]).all()
    assert (room[0] < MOTION.start.at).all() and (room[1] > MOTION.start.at).all()
    corners = [np.choose(sides, room) for sides in itertools.product((0, 1), repeat=3)]
    # It rests at each: a wrist that comes out of a singular configuration settles in 0.3 s.
    ways = [MOTION.start]
    for corner in corners:
        there = ways[-1]._replace(at=corner, time=ways[-1].time + 0.8)
        ways += [there, there._replace(time=there.time + 0.8)]
    misses = misses_of(held, GraspMotion(ways, "left"))
    at_corners = misses[[1600 * i for i in range(1, len(corners) + 1)]]
    assert (at_corners < (1e-3, 0.01, 1e-4)).all()


def test_an_arm_whose_grasper_a_hand_leads_is_clear_of_the_other_at_the_start():
    stroke = plan_stroke("straight", BODY, speed=0.06)
    first = place(stroke, BOUNDS)
    at_start = np.zeros(1)
    there = covered(first, stroke, BOUNDS, at_start)
    beside = Neighbours(BOUNDS, at_start, -float(first.tissue_origin[2]), [there])
    _, spheres, _ = place_of_grasper(FROM_LEFT.at_rest(), "auto", beside, ROOM)
    apart = np.linalg.norm(spheres.centres[:, :, None] - there.centres[:, None], axis=3)
    assert (apart > spheres.radii[:, None] + there.radii).all()


@pytest.mark.parametrize(
    ("given", "error", "expected"),
    [
        ({"at": "flange"}, UsageError, "[[grasper]] 'left' model"),
        ({"path": Path("no.xml")}, UsageError, "no.xml"),
        ({"pos": (5.0, 0.0, 0.0)}, PlacementError, "does not reach the stroke"),
    ],
)
def test_a_model_that_cannot_hold_it_there_is_refused(given, error, expected):
    with pytest.raises(error, match=re.escape(expected)):
        robot(**given)
