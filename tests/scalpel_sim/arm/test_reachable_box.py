import numpy as np
import pytest

from scalpel_sim.arm.arm import CHOSEN_BY_SIZE
from scalpel_sim.arm.placement import AUTO, PlacementError
from scalpel_sim.arm.reachable_box import (
    NEAR_ENOUGH,
    SMALLEST_SHARE,
    arm_for,
    grown_within,
    placed_within,
    tour_of,
)
from tissue import BladeSegment

WANTED = np.array([[-0.1, -0.1, 0.0], [0.1, 0.1, 0.1]])
"""A workspace [m] around the start, which is the origin of the frame."""

START = BladeSegment(np.array([0.0, 0.0, -0.02]), np.array([0.0, 0.0, 0.02]), np.array([0, 1.0, 0]))
MIDDLE = np.zeros(3)


def below(x):
    """Return what says whether a box lies below `x` [m] along the first axis."""
    return lambda box: bool(box[1, 0] <= x)


def placed_if(reaches):
    """Return the box around the start for which there is a place, and the boxes that were tried."""
    tried = []

    def place(shares):
        tried.append(MIDDLE + shares * (WANTED - MIDDLE))
        if not reaches(tried[-1]):
            raise PlacementError("too far")
        return tried[-1]

    return placed_within(place), tried


def test_a_workspace_that_the_arm_reaches_stays_whole():
    box, tried = placed_if(below(0.2))
    assert len(tried) == 1
    assert np.array_equal(box, WANTED)
    assert np.array_equal(grown_within(box, WANTED, below(0.2)), WANTED)


def test_a_workspace_that_the_arm_does_not_reach_is_halved_and_then_grows_to_where_it_does():
    box, _ = placed_if(below(0.03))
    assert box[:, :2] == pytest.approx(0.25 * WANTED[:, :2])
    grown = grown_within(box, WANTED, below(0.03))
    assert 0.03 - NEAR_ENOUGH <= grown[1, 0] <= 0.03
    others = np.ones((2, 3), bool)
    others[1, 0] = False
    assert np.array_equal(grown[others], WANTED[others])


def test_height_is_halved_before_the_rest():
    box, _ = placed_if(lambda box: bool(box[1, 2] <= 0.06))
    assert box == pytest.approx(WANTED * [1.0, 1.0, 0.5])


def test_a_start_around_which_the_arm_reaches_nearly_nothing_is_refused():
    with pytest.raises(PlacementError, match="too far"):
        placed_if(below(0.09 * SMALLEST_SHARE))


def test_the_largest_arm_reaches_where_not_all_is_reached_unless_another_was_asked_for():
    assert [arm_for(AUTO, share * np.ones(3)) for share in (1.0, 0.5)] == [AUTO, CHOSEN_BY_SIZE[-1]]
    assert arm_for("touch", 0.5 * np.ones(3)) == "touch"


def test_a_tour_goes_from_the_start_to_each_corner():
    tour = tour_of(WANTED, MIDDLE, START)
    tips = [tour.pose(t).tip for t in tour.times]
    assert tips[0] == pytest.approx(START.tip)
    corners = {tuple(np.round(tip - START.tip, 9)) for tip in tips[1:]}
    assert corners == {(x, y, z) for x in (-0.1, 0.1) for y in (-0.1, 0.1) for z in (0.0, 0.1)}
