from pathlib import Path

import numpy as np
import pytest

from scalpel_sim import SCENES, StrokeTable, prepare, read_scene
from scalpel_sim.hands.commands import LONGEST_SILENCE, Aim, Engage, Release, StillThere
from scalpel_sim.hands.limited_pose import (
    ARRIVED,
    FARTHEST_AHEAD,
    MOST_SPEED,
    MOST_TURN_RATE,
    MOST_WAY_AHEAD,
    PASSES_AT,
)
from scalpel_sim.hands.teleoperation import LiveHand
from scalpel_sim.instruments.scene_arms import ROOM
from scalpel_sim.output.plot_process import Plotter
from scalpel_sim.runs.file_names import STROKE
from scalpel_sim.runs.run_folder import Outputs
from scalpel_sim.scene.scene import changed
from scalpel_sim.strokes.stroke import FASTEST, LED_COLUMNS
from tests.scalpel_sim.hands.driven_runs import (
    DT,
    ROUNDING,
    Clock,
    led,
    move,
    poses,
    turn,
)
from tests.support.run_files import assert_same_rows

ROBOT = read_scene(Path(__file__).parents[3] / "docs" / "examples" / "robot.toml")
"""A scene with an arm of its own."""

LEAST_ROOM = 0.01
"""Room in each direction in which a hand can do something in a body of some 30 mm [m]."""


@pytest.fixture(scope="module")
def at_start():
    return led()


@pytest.fixture
def hand(at_start):
    """A hand at the start of the scene, that leads the arm of `at_start`."""
    return LiveHand(at_start[0], clock=Clock())


def middles(found):
    return 0.5 * (found[:, :3] + found[:, 3:6])


def test_the_blade_rests_until_the_hand_is_engaged(hand):
    hand.commands.append(move(y=0.01))
    found = poses(hand, 100)
    assert (found == found[0]).all()


def test_an_engaged_hand_arrives_where_it_was_moved_to(hand):
    hand.commands += [Engage(), move(x=0.002, y=0.01), turn(z=0.1)]
    found = poses(hand, 400)
    way = middles(found)[-1] - middles(found)[0]
    assert way == pytest.approx([0.002, 0.01, 0.0], abs=1e-6)
    forward, turned = found[0, 6:], found[-1, 6:]
    assert np.arccos(forward @ turned) == pytest.approx(0.1, abs=1e-5)
    assert (found[-1] == found[-50]).all(), "it rests there"


def test_an_engaged_hand_goes_to_a_place_however_far_it_is_and_stops_there(hand, at_start):
    simulation = at_start[0]
    to = hand.tip + np.array([0.002, 1.5 * FARTHEST_AHEAD, 0.0])
    beyond = to + np.array([0.0, 10.0, 0.0])
    hand.commands += [Engage(), Aim(to.tolist(), 1.0)]
    found = poses(hand, 900)
    assert simulation.frame.points_to_world(found[-1, :3]) == pytest.approx(to, abs=1e-6)
    assert np.linalg.norm(np.diff(found[:, :3], axis=0), axis=1).max() <= MOST_SPEED * DT + ROUNDING
    assert hand.stamp == 1.0
    assert hand.n_limited > 0, "its speed is that of a hand"
    hand.commands.append(Aim(beyond.tolist(), 2.0))
    middle = middles(poses(hand, 900))[-1]
    assert middle[1] == pytest.approx(simulation.workspace[1, 1], abs=1e-6)


def test_a_hand_that_is_behind_goes_by_way_of_all_places_it_was_sent_to(hand, at_start):
    corner = hand.tip + np.array([0.0, 0.02, 0.01])
    end = corner + np.array([0.0, 0.02, -0.01])
    hand.commands += [Engage(), Aim(corner.tolist(), 1.0), Aim(end.tolist(), 2.0)]
    found = at_start[0].frame.points_to_world(poses(hand, 900)[:, :3])
    assert np.linalg.norm(found - corner, axis=1).min() < PASSES_AT
    assert found[-1] == pytest.approx(end, abs=1e-6)


def test_of_a_way_of_more_than_a_second_the_oldest_places_are_left_out(hand, at_start):
    near, far = hand.tip.tolist(), (hand.tip + np.array([0.0, 0.02, 0.0])).tolist()
    hand.commands += [Engage(), *[Aim(far, 1.0), Aim(near, 1.0)] * 30]
    way = np.abs(np.diff(poses(hand, 3000)[:, :3], axis=0)).sum()
    assert 0.5 * MOST_WAY_AHEAD < way <= MOST_WAY_AHEAD, "it cuts corners by some millimetres"


def test_a_released_hand_goes_to_no_place(hand):
    hand.commands.append(Aim((hand.tip + 0.01).tolist(), 1.0))
    found = poses(hand, 50)
    assert (found == found[0]).all()


def test_no_move_is_faster_than_the_limits(hand):
    hand.commands.append(Engage())
    found = []
    for k in range(300):
        hand.commands += [move(y=0.001), turn(z=0.05)]
        found.append(poses(hand, 1, k)[0])
    found = np.array(found)
    speeds = np.linalg.norm(np.diff(middles(found), axis=0), axis=1) / DT
    turns = np.linalg.norm(np.diff(found[:, 6:], axis=0), axis=1) / DT
    assert speeds.max() == pytest.approx(MOST_SPEED)
    assert turns.max() == pytest.approx(MOST_TURN_RATE, rel=1e-3)
    assert MOST_SPEED < FASTEST / 5.0


def test_the_blade_stops_soon_after_the_person_does_however_far_was_asked(hand):
    poses(hand, 1)
    hand.commands.append(Engage())
    hand.commands += [move(y=0.05)] * 10
    way = np.ptp(middles(poses(hand, 2000, 1)), axis=0)
    assert way[1] <= FARTHEST_AHEAD + ROUNDING


def test_nothing_jumps_when_a_released_hand_is_engaged_again(hand):
    hand.commands += [Engage(), move(y=0.02)]
    before = poses(hand, 30)
    hand.commands.append(Release())
    released = poses(hand, 50, 30)
    hand.commands += [move(y=0.02), Engage()]
    engaged = poses(hand, 50, 80)
    assert 0.0 < before[-1, 1] - before[0, 1] < 0.01, "it was on its way"
    assert (released == before[-1]).all() and (engaged == before[-1]).all()


def test_a_hand_that_hears_nothing_stops_where_it_is(hand):
    hand.commands += [Engage(), move(y=0.03)]
    before = poses(hand, 20)
    hand._clock.now = LONGEST_SILENCE + 0.01
    after = poses(hand, 50, 20)
    assert (after == before[-1]).all()
    assert not hand.is_engaged


def test_a_hand_that_hears_its_page_again_continues_unless_it_was_released(hand):
    hand.commands.append(Engage())
    poses(hand, 1)
    for last, goes_on in [(StillThere(), True), (move(y=0.01), True), (Release(), False)]:
        hand._clock.now += LONGEST_SILENCE + 0.01
        poses(hand, 1, 1)
        assert not hand.is_engaged
        hand.commands.append(last)
        poses(hand, 1, 2)
        assert hand.is_engaged == goes_on
    hand.commands.append(StillThere())
    poses(hand, 1, 3)
    assert not hand.is_engaged


def test_a_page_that_says_that_it_is_there_keeps_the_hand_engaged(hand):
    hand.commands.append(Engage())
    for k in range(20):
        hand._clock.now += 0.9 * LONGEST_SILENCE
        hand.commands.append(StillThere())
        poses(hand, 1, k)
    assert hand.is_engaged


def test_the_tip_stays_in_the_room_around_the_body(hand, at_start):
    high = at_start[0].link.describe().bounds[1]
    hand.commands.append(Engage())
    for k in range(1000):
        hand.commands += [StillThere()] if k % 100 else [move(0.05, 0.05, 0.05)]
        tip = poses(hand, 1, k)[0, :3]
    assert tip == pytest.approx(high + ROOM, abs=2.0 * ARRIVED)


def test_the_stamp_is_that_of_the_newest_command(hand):
    assert hand.stamp is None
    hand.commands += [Engage(), move(stamp=5.0), move(stamp=7.5)]
    poses(hand, 1)
    assert hand.stamp == 7.5


def test_poses_at_rest_take_no_rows(hand):
    poses(hand, 1000)
    hand.commands += [Engage(), move(y=1e-3)]
    poses(hand, 1000, 1000)
    assert 10 < len(hand.blade.take_rows()) < 400


@pytest.mark.parametrize("scene", [SCENES["incision"], ROBOT], ids=lambda scene: scene.name)
def test_the_arm_of_what_was_recorded_stands_where_that_of_the_hand_stood(tmp_path, scene):
    simulation, hand = led(scene)
    hand.commands += [Engage(), move(y=2e-3, z=-1e-3), turn(x=0.01)]
    simulation.run(0.05)
    hand.finish(simulation.time)
    with Plotter() as plotter:
        outputs = Outputs(tmp_path, plotter)
        outputs.write_driven(STROKE, LED_COLUMNS, hand.blade.take_rows())
        outputs.close()

    recorded = StrokeTable(kind="recorded", file=str(tmp_path / STROKE))
    repeated = prepare(changed(scene, strokes=(recorded,), task=None))
    repeated.run(0.05)
    assert np.ptp(simulation.recording.vector("tip")[:, 1]) > 1e-3
    assert_same_rows(simulation.recording, repeated.recording)


@pytest.mark.parametrize("name", ["excise", "taut_incision"])
def test_scenes_of_two_hands_have_room_for_both_from_their_start_on(name):
    simulation = prepare(SCENES[name], is_led=True)
    start, (grasper,) = simulation.stroke.start, simulation.graspers
    for middle, workspace in (
        (0.5 * (start.tip + start.heel), simulation.workspace),
        (np.array(grasper.motion.start.at), grasper.workspace),
    ):
        assert (workspace[0] <= middle).all() and (middle <= workspace[1]).all()
        assert (np.ptp(workspace, axis=0) > LEAST_ROOM).all()


def test_what_was_recorded_says_when_the_hand_was_engaged(tmp_path, hand):
    poses(hand, 10)
    hand.commands += [Engage(), move(y=1e-3)]
    poses(hand, 200, 10)
    hand.commands.append(Release())
    poses(hand, 10, 210)
    hand.finish(0.22)
    rows = np.array(hand.blade.take_rows())
    engaged = rows[:, LED_COLUMNS.index("engaged")]
    assert rows[engaged == 1.0, 0].min() == pytest.approx(0.010)
    assert rows[engaged == 1.0, 0].max() == pytest.approx(0.209)
    assert rows[-1, 0] == 0.22


def test_a_hand_ends_after_the_time_that_was_asked_for():
    simulation, hand = led(seconds=0.05)
    simulation.run(0.1)
    assert hand.ended_at == pytest.approx(0.05)
