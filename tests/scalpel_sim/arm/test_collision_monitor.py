import numpy as np
import pytest

from bridge import FixtureBox
from scalpel_sim import SCENES, StrokeTable, prepare
from scalpel_sim.arm.arm import Arm
from scalpel_sim.arm.collision_monitor import FLOOR_MARGIN, CollisionMonitor, floor_below
from scalpel_sim.scene.scene import changed


def lowered(arm, height):
    """Lower the blade's tip to a height with the hand, as a user would who aims too low."""
    before = arm.blade.segment()
    shift = np.array([0.0, 0.0, height - before.tip[2]])
    for fraction in np.linspace(0.0, 1.0, 300):
        offset = fraction * shift
        arm.hand.follow(before._replace(tip=before.tip + offset, heel=before.heel + offset))
        arm.step1()
        yield
        arm.step2()


def test_a_blade_that_is_led_into_the_table_is_counted_and_gets_one_warning(caplog):
    arm = Arm("touch")
    monitor = CollisionMonitor(arm)
    for _ in lowered(arm, -0.005):
        monitor.check()
    assert ("blade", "table") in monitor.now
    assert monitor.frames["blade, table"] > 5
    warnings = [
        record.message for record in caplog.records if "blade meets the table" in record.message
    ]
    assert len(warnings) == 1 and "they push each other" in warnings[0]


def test_an_instrument_that_is_folded_back_on_the_arm_is_found():
    arm = Arm("touch", blade_length=0.16)
    monitor = CollisionMonitor(arm)
    poses = np.random.default_rng(0).uniform(*arm.model.jnt_range.T, (300, 6))
    touched = set()
    for qpos in poses:
        arm.reset(qpos)
        monitor.check()
        touched |= set(monitor.now)
    assert {("blade", "upper_arm"), ("blade", "base")} <= touched
    assert not any(other in ("wrist", "gimbal", "stylus") for _, other in touched)


def test_a_blade_that_is_led_below_the_floor_meets_it_and_is_stopped(caplog):
    points = [[0.02, -0.005, 0.005], [0.02, -0.005, -0.006], [0.02, 0.02, -0.006]]
    drawn = StrokeTable(kind="points", points=points, length=0.06, forward=[0.0, 1.0, 0.0])
    simulation = prepare(changed(SCENES["grid2"], floor=-0.001, strokes=(drawn,)))
    simulation.run(simulation.duration)
    height = simulation.frame.points_to_world(np.array([0.0, 0.0, -0.001]))[2]
    assert simulation.touching.frames["blade, floor"] > 20
    assert simulation.recording.vector("tip")[:, 2].min() > height - 1e-3
    assert "the blade meets the floor: they push each other" in caplog.text


def test_the_floor_extends_below_the_body_and_a_margin_around_it():
    bounds = np.array([[0.0, 0.0, 0.0], [0.04, 0.02, 0.01]])
    floor = floor_below(bounds, -0.005)
    np.testing.assert_allclose(floor.centre[:2], [0.02, 0.01])
    assert floor.centre[2] + 0.5 * floor.size[2] == pytest.approx(-0.005)
    np.testing.assert_allclose(floor.size[:2], [0.04 + 2 * FLOOR_MARGIN, 0.02 + 2 * FLOOR_MARGIN])


def test_fixtures_are_given_in_the_frame_of_the_body():
    start = prepare(SCENES["grid2"]).stroke.pose(0.0)
    clamp = FixtureBox("clamp", np.full(3, 5e-3), 0.5 * (start.tip + start.heel))
    simulation = prepare(SCENES["grid2"], fixtures=[clamp])
    simulation.run(0.003)
    assert simulation.touching.now == (("blade", "clamp"),)
