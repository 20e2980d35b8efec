"""Paths add up, and a node is out of its ball where NumPy says so."""

import numpy as np
import pytest

from tissue import block
from tissue.contact.search.node_motion import (
    BALL,
    DIVERGED,
    IN_BALL,
    LARGEST_BALL,
    OUT_OF_BALL,
    begin_ball,
    has_left_middle,
    measure_motion,
    new_node_motion,
    note_places,
)
from tissue.mesh.body import build_body

pytestmark = pytest.mark.kernel

SIZE = 0.01


def a_body():
    """Return a body, its motion with balls around all nodes, and the numbers of its nodes."""
    body = build_body(block((2, 2, 1), (0.02, 0.02, 0.01)), None, None)
    motion, nodes = new_node_motion(body.n_nodes, SIZE), np.arange(body.n_nodes)
    for node in nodes:
        begin_ball(motion, body, node)
    return body, motion, nodes


def test_paths_displacements_and_balls_are_those_of_numpy():
    body, motion, nodes = a_body()
    random, start = np.random.default_rng(0), body.positions.copy()
    measure_motion(motion, body, nodes, len(nodes))
    path, largest, results = np.zeros(len(nodes)), 0.0, set()
    motion.largest_path = 0.0
    for _ in range(12):
        step = random.normal(scale=4e-4, size=start.shape)
        step *= random.random((len(nodes), 1)) < 0.5
        body.positions += step
        result = measure_motion(motion, body, nodes, len(nodes))
        note_places(motion, body)
        path += np.linalg.norm(step, axis=1)
        largest += np.linalg.norm(step, axis=1).max()
        moved = np.linalg.norm(body.positions - start, axis=1)
        assert result == (OUT_OF_BALL if (moved > BALL * SIZE).any() else IN_BALL)
        left = [has_left_middle(motion, body, node) for node in nodes]
        np.testing.assert_array_equal(left, moved > 0.6 * BALL * SIZE)
        results.add(result)
    assert results == {IN_BALL, OUT_OF_BALL}
    np.testing.assert_allclose(motion.path, path, rtol=1e-12)
    np.testing.assert_allclose(motion.displacement, body.positions - start, atol=1e-15)
    assert motion.largest_path == pytest.approx(largest)


def test_two_sides_of_quiet_nodes_come_no_nearer_than_the_quiet_path():
    body, motion, nodes = a_body()
    measure_motion(motion, body, nodes, len(nodes))
    for _ in range(5):
        body.positions[:, 2] += 2e-6
        measure_motion(motion, body, nodes, len(nodes))
        note_places(motion, body)
        assert motion.n_moving == 0
    assert motion.quiet_path == pytest.approx(5 * 4 * 2e-6)
    body.positions[3] += 1e-3
    measure_motion(motion, body, nodes, len(nodes))
    assert motion.n_moving == 1 and motion.moved_at[3] == motion.frame


@pytest.mark.parametrize("broken", [2.0, np.nan])
def test_a_node_that_moves_by_a_metre_or_to_nowhere_has_diverged(broken):
    body, motion, nodes = a_body()
    measure_motion(motion, body, nodes, len(nodes))
    body.positions[5, 1] += broken
    assert measure_motion(motion, body, nodes, len(nodes)) == DIVERGED


def test_the_ball_of_a_fast_node_is_larger_up_to_a_node_size():
    body, motion, _ = a_body()
    radii = []
    for speed in (0.0, 0.05, 0.5, 50.0):
        body.velocities[0] = [0.0, 0.0, speed]
        begin_ball(motion, body, 0)
        radii.append(motion.radius[0] / SIZE)
    assert radii[:2] == [BALL, BALL]
    assert BALL < radii[2] < radii[3] == LARGEST_BALL
