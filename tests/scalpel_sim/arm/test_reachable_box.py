import numpy as np
import pytest

from scalpel_sim.arm.placement import PlacementError
from scalpel_sim.arm.reachable_box import (
    NEAR_ENOUGH,
    SMALLEST_SHARE,
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


def place_below(x):
    def place(box):
        if not below(x)(box):
            raise PlacementError("too far")
        return "placed"

    return place


def test_a_workspace_that_the_arm_reaches_stays_whole():
    placed, box = placed_within(WANTED, MIDDLE, place_below(0.2))
    assert placed == "placed"
    assert np.array_equal(box, WANTED)
    assert np.array_equal(grown_within(box, WANTED, below(0.2)), WANTED)


def test_a_workspace_that_the_arm_does_not_reach_is_halved_and_then_grows_to_where_it_does():
    _, box = placed_within(WANTED, MIDDLE, place_below(0.03))
    assert box == pytest.approx(0.25 * WANTED)
    grown = grown_within(box, WANTED, below(0.03))
    assert 0.03 - NEAR_ENOUGH <= grown[1, 0] <= 0.03
    others = np.ones((2, 3), bool)
    others[1, 0] = False
    assert np.array_equal(grown[others], WANTED[others])


def test_a_start_around_which_the_arm_reaches_nearly_nothing_is_refused():
    with pytest.raises(PlacementError, match="too far"):
        placed_within(WANTED, MIDDLE, place_below(0.09 * SMALLEST_SHARE))


def test_a_tour_goes_from_the_start_to_each_corner():
    tour = tour_of(WANTED, MIDDLE, START)
    tips = [tour.pose(t).tip for t in tour.times]
    assert tips[0] == pytest.approx(START.tip)
    corners = {tuple(np.round(tip - START.tip, 9)) for tip in tips[1:]}
    assert corners == {(x, y, z) for x in (-0.1, 0.1) for y in (-0.1, 0.1) for z in (0.0, 0.1)}
