"""Strokes that are given point by point, and several in turn."""

import numpy as np
import pytest

from scalpel_sim.strokes.csv_lines import StrokeError
from scalpel_sim.strokes.kinds import STROKES
from scalpel_sim.strokes.sequence import in_turn
from scalpel_sim.strokes.stroke import Stroke
from tests.support.planned_strokes import plan_stroke
from tissue import BladeSegment, block

SPEED = 0.05
CUBE = block((1, 1, 1), (0.04, 0.04, 0.04))
NO_RESTS = [(0.0, 0.0), (0.0, 0.0)]


def drawn(kind="points", **keys):
    keys = {"points": [(0.0, 0.0, 0.0), (0.0, 0.1, 0.0)], "length": 0.05} | keys
    return plan_stroke(kind, CUBE, **{"speed": SPEED} | keys)


def tips(stroke, n=401):
    return np.array([pose.tip for pose in stroke.poses(n)])


def moved_along(stroke, direction, n=401):
    """How far the middle of the edge has moved in a direction, from the start."""
    middles = np.array([(pose.tip + pose.heel) / 2 for pose in stroke.poses(n)])
    return (middles - middles[0]) @ np.array(direction)


# Points


def test_the_tip_goes_from_point_to_point_and_the_edge_stands_up():
    stroke = drawn(points=[(0.0, 0.0, 0.0), (0.0, 0.1, 0.0), (0.1, 0.1, 0.0)])
    for point in ([0.0, 0.0, 0.0], [0.0, 0.1, 0.0], [0.1, 0.1, 0.0]):
        assert np.linalg.norm(tips(stroke) - point, axis=1).min() < 1e-3
    for pose in stroke.poses(50):
        np.testing.assert_allclose(pose.heel - pose.tip, [0.0, 0.0, 0.05], atol=1e-12)


def test_the_edge_cuts_the_way_it_moves_and_turns_at_a_corner_at_rest():
    stroke = drawn(points=[(0.0, 0.0, 0.0), (0.0, 0.1, 0.0), (0.1, 0.1, 0.0)])
    np.testing.assert_allclose(stroke.pose(0.1).forward, [0.0, 1.0, 0.0], atol=1e-12)
    last = stroke.pose(stroke.duration).forward
    np.testing.assert_allclose(last, [1.0, 0.0, 0.0], atol=1e-12)
    for pose in stroke.poses(2001):
        is_between = 1e-6 < pose.forward[0] < 1.0 - 1e-6
        assert not is_between or np.linalg.norm(pose.tip - [0.0, 0.1, 0.0]) < 1e-9


def test_a_direction_of_the_cut_that_is_given_stays():
    stroke = drawn(forward=(1.0, 0.0, 0.0))
    for pose in stroke.poses(20):
        np.testing.assert_allclose(pose.forward, [1.0, 0.0, 0.0], atol=1e-12)


def test_the_speed_between_the_ramps_is_the_one_asked_for():
    stroke = drawn()
    t = 0.5 * stroke.duration
    way = np.linalg.norm(stroke.pose(t + 0.05).tip - stroke.pose(t - 0.05).tip)
    assert way / 0.1 == pytest.approx(SPEED)


@pytest.mark.parametrize(
    ("keys", "expected"),
    [
        ({"points": [(0, 0, 0), (0, 0, 0.1)]}, "from point 1 to point 2 .* give the direction"),
        ({"edge": (0.0, 0.0, 0.0)}, "is the direction tip to heel"),
        ({"kind": "spline", "points": [(0, 0, 0), (0, 0, 0), (0, 1, 0)]}, "are the same"),
    ],
)
def test_what_no_blade_can_do_is_refused(keys, expected):
    with pytest.raises(StrokeError, match=expected):
        drawn(**keys)


# Splines


def test_a_spline_passes_its_points_without_a_stop():
    points = [(0.05 * np.cos(a), 0.05 * np.sin(a), 0.0) for a in np.linspace(0.0, np.pi, 7)]
    stroke = drawn("spline", points=points)
    found = tips(stroke, 2001)
    for point in points:
        assert np.linalg.norm(found - point, axis=1).min() < 1e-4
    # A half circle through seven points, as a cubic spline.
    np.testing.assert_allclose(np.linalg.norm(found, axis=1), 0.05, rtol=2e-2)
    t = np.linspace(0.2, stroke.duration - 0.2, 50)
    steps = [stroke.pose(at + 0.01).tip - stroke.pose(at).tip for at in t]
    np.testing.assert_allclose(np.linalg.norm(steps, axis=1) / 0.01, SPEED, rtol=1e-2)


def test_along_a_spline_the_edge_cuts_along_the_tangent():
    points = [(0.05 * np.cos(a), 0.05 * np.sin(a), 0.0) for a in np.linspace(0.0, np.pi, 7)]
    for pose in drawn("spline", points=points).poses(40)[4:-4]:
        tangent = np.array([-pose.tip[1], pose.tip[0], 0.0]) / np.linalg.norm(pose.tip)
        assert pose.forward @ tangent > 0.999


# Slices and saws


@pytest.mark.parametrize("ratio", [-1.0, 0.5, 2.0])
def test_a_slice_moves_along_the_edge_by_its_ratio_and_is_on_its_points_half_way(ratio):
    stroke = drawn(slicing_ratio=ratio)
    assert moved_along(stroke, [0, 0, 1])[-1] == pytest.approx(ratio * 0.1)
    assert moved_along(stroke, [0, 1, 0])[-1] == pytest.approx(0.1)
    half_way = stroke.pose(0.5 * stroke.duration).tip
    np.testing.assert_allclose(half_way, [0.0, 0.05, 0.0], atol=1e-6)


def test_a_saw_goes_back_and_forth_by_its_amplitude_as_often_as_asked():
    stroke = drawn(saw_amplitude=3e-3, saw_frequency=5.0)
    along = moved_along(stroke, [0, 0, 1], 4001)
    assert along.max() == pytest.approx(3e-3, rel=0.01)
    assert along.min() == pytest.approx(-3e-3, rel=0.01)
    n_crossings = np.count_nonzero(np.diff(np.signbit(along)))
    assert n_crossings == pytest.approx(2.0 * 5.0 * stroke.duration, abs=2)
    assert moved_along(stroke, [0, 1, 0])[-1] == pytest.approx(0.1)


def test_a_saw_starts_and_ends_at_rest():
    stroke = drawn(saw_amplitude=3e-3, saw_frequency=5.0)
    for t in (0.0, stroke.duration - 1e-4):
        way = np.linalg.norm(stroke.pose(t + 1e-4).tip - stroke.pose(t).tip)
        assert way / 1e-4 < 0.1 * SPEED


# Stabs


def test_a_stab_goes_in_along_the_edge_as_deep_as_asked_and_out_again():
    stroke = drawn("stab", points=[(0.0, 0.0, 0.1)], depth=0.02, forward=(0.0, 1.0, 0.0))
    found = tips(stroke)
    np.testing.assert_allclose(found[[0, -1]], [[0, 0, 0.1], [0, 0, 0.1]], atol=1e-12)
    assert found[:, 2].min() == pytest.approx(0.08, abs=1e-5)
    np.testing.assert_allclose(found[:, :2], 0.0, atol=1e-12)
    assert stroke.asked is None


def test_a_blade_that_rests_stays_where_it_is_and_may_be_away_from_the_body():
    at = {"points": [(0.0, -0.2, 0.1)], "length": 0.02, "forward": (0.0, 1.0, 0.0)}
    stroke = drawn("rest", **at)
    assert not np.ptp(tips(stroke), axis=0).any()
    assert stroke.asked is None
    assert STROKES["stab"].meets and not STROKES["rest"].meets


# Several in turn


def through(x, *, length=0.06):
    """A blade that passes the cube at x, with the tip down."""
    low, high = np.array([x, -0.02, -0.01]), np.array([x, 0.06, -0.01])
    up, forward = np.array([0.0, 0.0, length]), np.array([0.0, 1.0, 0.0])
    ends = [BladeSegment(tip, tip + up, forward) for tip in (low, high)]
    return Stroke([0.0, 1.0], ends, f"at {x}", asked=[(0.0, 1.0)])


def test_one_stroke_without_a_pause_is_itself():
    stroke = through(0.02)
    assert in_turn([stroke], [(0.0, 0.0)], CUBE) is stroke


def test_strokes_in_turn_are_each_done_at_their_pace_with_the_longest_blade():
    both = in_turn([through(0.01), through(0.03, length=0.08)], NO_RESTS, CUBE)
    assert both.name == "at 0.01, at 0.03"
    assert both.blade_length == pytest.approx(0.08)
    for (start, end), x in zip(both.asked, (0.01, 0.03), strict=True):
        assert end - start == pytest.approx(1.0)
        for t, y in ((start, -0.02), (end, 0.06)):
            np.testing.assert_allclose(both.pose(t).tip, [x, y, -0.01], atol=1e-9)


def inside(pose):
    """Whether some of the edge is in the cube."""
    points = pose.tip + np.linspace(0.0, 1.0, 60)[:, None] * (pose.heel - pose.tip)
    return bool(((points >= 0.0) & (points <= 0.04)).all(axis=1).any())


def test_between_strokes_the_blade_stays_outside_the_body():
    both = in_turn([through(0.01), through(0.03)], NO_RESTS, CUBE)
    (_, left), (back, _) = both.asked
    for t in np.linspace(left, back, 300):
        assert not inside(both.pose(t))


def test_a_blade_that_ends_in_the_body_is_drawn_out_along_its_edge():
    slit = through(0.01)
    poses = [slit.pose(0.0), slit.pose(0.6)]
    both = in_turn([Stroke([0.0, 1.0], poses, "slit"), through(0.03)], NO_RESTS, CUBE)
    outside_from = None
    for t in np.linspace(1.0, both.asked[0][0], 300):
        pose = both.pose(t)
        if inside(pose):
            np.testing.assert_allclose(pose.tip[:2], poses[1].tip[:2], atol=1e-9)
            assert outside_from is None  # it does not come back
        elif outside_from is None:
            outside_from = t
    assert outside_from is not None


def test_after_a_stroke_the_blade_rests_for_its_pause():
    one = in_turn([through(0.02)], [(0.0, 0.7)], CUBE)
    assert one.duration == pytest.approx(1.7)
    np.testing.assert_allclose(one.pose(1.0).tip, one.pose(1.7).tip, atol=1e-12)


def test_before_a_stroke_the_blade_waits_where_it_begins():
    stroke = through(0.02)
    one = in_turn([stroke], [(0.7, 0.0)], CUBE)
    assert one.duration == pytest.approx(1.7) and one.asked == [(0.7, 1.7)]
    for t in (0.0, 0.4, 0.7):
        np.testing.assert_allclose(one.pose(t).tip, stroke.pose(0.0).tip, atol=1e-12)
    np.testing.assert_allclose(one.pose(1.2).tip, stroke.pose(0.5).tip, atol=1e-12)


def test_between_strokes_a_wait_comes_after_the_way_to_the_next():
    without = in_turn([through(0.01), through(0.03)], NO_RESTS, CUBE)
    both = in_turn([through(0.01), through(0.03)], [(0.0, 0.0), (0.5, 0.0)], CUBE)
    assert both.duration == pytest.approx(without.duration + 0.5)
    begin = both.asked[1][0]
    assert begin == pytest.approx(without.asked[1][0] + 0.5)
    for t in (begin - 0.5, begin):
        np.testing.assert_allclose(both.pose(t).tip, through(0.03).pose(0.0).tip, atol=1e-9)
