import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from bridge.arithmetic import (
    LARGEST_COSINE,
    MAX_PLAUSIBLE_SPEED,
    MAX_PLAUSIBLE_TURN,
    SHORTEST_EDGE,
    UNIT_TOLERANCE,
    arrival,
    compiled_arithmetic,
)
from bridge.collision.swept_box import edge_axes
from bridge.coupling.coupling import expect_plausible_motion
from bridge.poses import expect_plane, half_length, motion, moved, pose_of
from tissue import BladeSegment

UPRIGHT = BladeSegment(np.zeros(3), np.array([0.0, 0.0, 0.04]), np.array([0.0, 1.0, 0.0]))

components = st.floats(-1.0, 1.0)
vectors = st.tuples(components, components, components).map(np.array)


def random_pose(rng):
    edge, forward = 0.04 * np.linalg.qr(rng.normal(size=(3, 3)))[0][:2]
    tip = rng.normal(size=3)
    tilted = forward + 0.3 * edge
    return BladeSegment(tip, tip + edge, tilted / np.linalg.norm(tilted))


@pytest.mark.parametrize("seed", range(5))
def test_a_motion_is_that_of_the_rotation_matrix(seed):
    rng = np.random.default_rng(seed)
    before, after = random_pose(rng), random_pose(rng)
    turn = Rotation.from_matrix(edge_axes(after) @ edge_axes(before).T).as_rotvec()
    expected = np.concatenate([after.tip - before.tip, turn])
    assert motion(before, after) == pytest.approx(expected, abs=1e-9)
    one = pose_of(before)
    arrived = after.numbers, (0.0, 0.0, 0.0), one.tip, one.axes, 1e-3
    again = compiled_arithmetic().arrival.call(*arrived)[3]
    assert again == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize("seed", range(5))
def test_what_is_clearly_plausible_passes_the_exact_tests(seed):
    """Poses and motions on both sides of each limit, none of them clearly plausible beyond it."""
    rng, n_plausible = np.random.default_rng(seed), 0
    origin, dt = (0.1, 0.2, 0.3), 1e-3
    for _ in range(200):
        before, size = random_pose(rng), float(rng.choice([0.5, 0.985, 1.0, 1.5]))
        kind = rng.integers(5)
        by = np.zeros(6)
        by[0] = size * MAX_PLAUSIBLE_SPEED * dt if kind == 0 else 1e-4
        by[3] = size * MAX_PLAUSIBLE_TURN if kind == 1 else 1e-3
        tip, heel, forward = moved(before, by)
        edge = heel - tip
        if kind == 2:
            edge *= size * SHORTEST_EDGE / np.linalg.norm(edge)
        elif kind == 3:
            forward *= 1.0 + size * UNIT_TOLERANCE
        elif kind == 4:
            along, across = edge_axes(before)[:, 1], edge_axes(before)[:, 2]
            cosine = min(size * LARGEST_COSINE, 1.0)
            edge, forward = 0.04 * along, cosine * along + np.sqrt(1.0 - cosine**2) * across
        after, one = BladeSegment(tip, tip + edge, forward), pose_of(before)
        given = BladeSegment(after.tip + origin, after.heel + origin, forward)
        is_plausible, numbers, _, by = arrival(given.numbers, origin, one.tip, one.axes, dt)
        if is_plausible:
            n_plausible += 1
            expect_plane(BladeSegment.of_numbers(numbers), after)
            expect_plausible_motion(by, dt)
    assert 20 < n_plausible < 180


@given(vectors, vectors)
def test_the_motion_to_a_moved_pose_is_the_one_that_moved_it(shift, turn):
    done = np.concatenate([shift, 1.5 * turn])
    assert motion(UPRIGHT, moved(UPRIGHT, done)) == pytest.approx(done, abs=1e-12)


@given(vectors, vectors)
def test_the_motion_between_two_poses_moves_the_first_to_the_second(shift, turn):
    there = moved(UPRIGHT, np.concatenate([shift, 1.5 * turn]))
    again = moved(UPRIGHT, motion(UPRIGHT, there))
    for wanted, found in zip(there, again, strict=True):
        assert found == pytest.approx(wanted, abs=1e-12)


@given(vectors)
def test_a_moved_blade_keeps_its_length_and_right_angle(turn):
    there = moved(UPRIGHT, np.concatenate([np.zeros(3), 2.0 * turn]))
    assert half_length(there) == pytest.approx(0.02)
    assert np.linalg.norm(there.forward) == pytest.approx(1.0, abs=1e-15)
    assert there.forward @ (there.heel - there.tip) == pytest.approx(0.0, abs=1e-15)
