"""Arms stop at each other and at what stands in their world; both sides feel it alike."""

import logging

import numpy as np
import pytest

from bridge import FixtureBox, FixtureMesh
from scalpel_sim import SCENES, prepare
from scalpel_sim.arm.arm import Arm
from scalpel_sim.arm.collision_monitor import CollisionMonitor
from scalpel_sim.arm.hand import Impedance
from scalpel_sim.arm.standing import StandingFixture

SIZE = np.array([0.06, 0.2, 0.01])


def lead(arm, start, shift, n_frames, every_frame=lambda: None):
    """Lead the edge by a shift [m] from a pose, evenly, and let it come to rest there."""
    for fraction in np.minimum(np.linspace(0.0, 1.5, n_frames), 1.0):
        offset = fraction * shift
        arm.hand.follow(start._replace(tip=start.tip + offset, heel=start.heel + offset))
        arm.step1()
        every_frame()
        arm.step2()
    end = arm.blade.segment()
    return 0.5 * (end.tip + end.heel) - 0.5 * (start.tip + start.heel)


def block_below(arm, gap):
    """A block whose upper side is that far below the tip [m]."""
    tip = arm.blade.segment().tip
    return FixtureBox("block", SIZE, tip - np.array([0.0, 0.0, gap + 0.5 * SIZE[2]]))


def sheet_below(arm, gap):
    """A sheet of two triangles that far below the tip [m]."""
    x, y = 0.5 * SIZE[:2]
    corners = np.array([[-x, -y, 0.0], [x, -y, 0.0], [x, y, 0.0], [-x, y, 0.0]])
    at = arm.blade.segment().tip - np.array([0.0, 0.0, gap])
    return FixtureMesh("sheet", at + corners, np.array([[0, 1, 2], [0, 2, 3]]))


@pytest.mark.parametrize("below", [block_below, sheet_below])
def test_a_fixture_stops_the_blade(below):
    usual = Arm("touch")
    fixture = below(usual, gap=0.01)
    arm = Arm("touch", others=[StandingFixture(fixture)])
    start = arm.blade.segment()
    lead(arm, start, np.array([0.0, 0.0, -0.015]), 600)
    assert start.tip[2] - arm.blade.segment().tip[2] == pytest.approx(0.01, abs=5e-4)


def test_a_fixture_that_does_not_stand_in_the_model_is_told_to_let_the_blade_through(caplog):
    arm = Arm("touch")
    monitor = CollisionMonitor(arm, [block_below(arm, gap=0.005)])
    start = arm.blade.segment()
    moved = lead(arm, start, np.array([0.0, 0.0, -0.01]), 600, monitor.check)
    assert moved[2] == pytest.approx(-0.01, abs=5e-4)
    assert "pass through each other" in caplog.text


def test_fixtures_of_one_name_are_refused_by_it():
    box = StandingFixture(FixtureBox("block", SIZE, np.array([0.5, 0.0, 0.0])))
    with pytest.raises(ValueError, match="two fixtures have the name 'block'"):
        Arm("touch", others=[box, box])


def test_two_instruments_stop_each_other_and_action_is_reaction(caplog):
    simulation = prepare(SCENES["retract"])
    arm, grasper = simulation.arm, simulation.arm.graspers[0]
    monitor, shaft = CollisionMonitor(arm), arm.data.geom("left_grasper_shaft")
    arm.step1()
    arm.step2()
    rest, start, before = grasper.pads.centre, arm.blade.segment(), np.array(shaft.xpos)
    to = before - 0.5 * (start.tip + start.heel)
    lead(arm, start, to - np.array([0.0, 0.0, 0.01]), 1500)
    with caplog.at_level(logging.WARNING, "scalpel_sim"):
        below = arm.blade.segment()
        asked = np.array([0.0, 0.0, 0.011])
        moved = lead(arm, below, asked, 3000, monitor.check)
    radius, stiffness = arm.model.geom("left_grasper_shaft").size[0], Impedance().stiffness
    on_blade = stiffness * (moved - asked)[2]
    on_grasper = stiffness * (grasper.pads.centre - rest)[2]
    assert arm.blade.segment().tip[2] < shaft.xpos[2] - radius + 5e-4
    assert on_blade < -3.0
    # The joints of both arms are not free of friction: 0.26 N at the gimbal of a Touch.
    assert on_grasper == pytest.approx(-on_blade, abs=0.6)
    assert "the blade meets the left_grasper_shaft: they push each other" in caplog.text


def test_parts_of_two_arms_that_carry_no_blade_meet_too():
    simulation = prepare(SCENES["retract"])
    model = simulation.arm.model
    one, other = model.geom("forearm"), model.geom("left_forearm")
    own = model.geom("upper_arm")
    assert one.contype & other.conaffinity and other.contype & one.conaffinity
    assert not (one.contype & own.conaffinity or own.contype & one.conaffinity)
