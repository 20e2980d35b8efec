"""Node placement: nodes at the intersections, and the guard of the central tetrahedron."""

import numpy as np
import pytest

from tests.support import bodies
from tests.tissue.cutting.bielser_1998.splits import splits_of
from tissue.cutting.bielser_1998.case_table import TABLE
from tissue.cutting.bielser_1998.node_placement import (
    EDGE_MARGIN,
    LEAST_CENTRE,
    LIFT,
    centre_volume,
    place_nodes,
)
from tissue.cutting.bielser_1998.template_1_to_17 import (
    CENTRE_CHILD,
    EDGE_NODE,
    EDGES,
    FACE_NODE,
    FACES,
    PRESPLIT,
    code_of,
    generic_weights,
)

pytestmark = pytest.mark.kernel

POINTS = bodies.unit_tetrahedron().positions


def placed(crossings, tips=None, neighbours=None):
    """Return the placed nodes, and whether the guard moved any.

    Args:
        crossings: Fraction at which each crossed edge is crossed.
        tips: Weights of the point where the tip passed a face, by face.
        neighbours: Weights of face nodes that a neighbour has placed, by face.
    """
    splits = splits_of(bodies.unit_tetrahedron())
    scheme, records = splits.scheme, splits.scheme._records
    for (a, b), at in crossings.items():
        splits.cross(a, b, at)
    for k, weights in (tips or {}).items():
        records.tip_weights[records.faces_of[0, k]] = weights
    for k, weights in (neighbours or {}).items():
        records.face_weights[records.faces_of[0, k]] = weights
        records.face_nodes[records.faces_of[0, k]] = 0
    code = code_of(*("".join("ABCD"[i] for i in ends) for ends in crossings))
    moved = place_nodes(records, scheme._table, scheme._placing, 0, code)
    return scheme._placing, moved


def volumes(weights):
    """Return the volumes of the children as shares of the tetrahedron's."""
    return np.linalg.det(weights[PRESPLIT.children])


def crossed_by(normal, offset):
    """Return the fractions at which a plane crosses the edges of the unit tetrahedron."""
    height = POINTS @ normal - offset
    return {
        (a, b): height[a] / (height[a] - height[b])
        for a, b in EDGES
        if (height[a] < 0.0) != (height[b] < 0.0)
    }


def random_weights(random):
    """Return the weights of nodes at random on their edges and in their faces."""
    weights = generic_weights()
    for e, (i, j) in enumerate(EDGES):
        at = random.uniform(0.05, 0.95)
        weights[EDGE_NODE + e, [i, j]] = 1.0 - at, at
    for k, corners in enumerate(FACES):
        weights[FACE_NODE + k, list(corners)] = random.dirichlet([2.0, 2.0, 2.0])
    return weights


def test_nodes_on_cut_edges_are_where_the_blade_crossed_them():
    placing, _ = placed({(0, 1): 0.3, (0, 2): 0.4, (0, 3): 0.8})
    for e, at in ((0, 0.3), (3, 0.4), (5, 0.8)):
        assert placing.weights[EDGE_NODE + e, list(EDGES[e])] == pytest.approx([1.0 - at, at])


def test_nodes_on_edges_and_faces_that_are_not_cut_are_midpoints_and_centroids():
    placing, _ = placed({(0, 1): 0.3})
    others = [n for n in range(14) if n != EDGE_NODE]
    np.testing.assert_allclose(placing.weights[others], generic_weights()[others])


def test_the_node_of_a_face_cut_across_is_the_middle_of_the_cut_plus_the_lift():
    placing, _ = placed({(0, 1): 0.4, (0, 2): 0.6, (0, 3): 0.5})
    middle = np.array([0.5, 0.2, 0.3, 0.0])
    away = np.array([0.0, 0.5, 0.5, 0.0])
    assert placing.weights[FACE_NODE + 3] == pytest.approx((1 - LIFT) * middle + LIFT * away)


def test_the_node_of_a_face_with_the_tip_in_it_is_where_the_tip_passed():
    placing, _ = placed({(0, 1): 0.5}, tips={3: (0.5, 0.2, 0.3)})
    off_the_sides = 0.5 * EDGE_MARGIN + (1.0 - 1.5 * EDGE_MARGIN) * np.array([0.5, 0.2, 0.3])
    assert placing.weights[FACE_NODE + 3] == pytest.approx([*off_the_sides, 0.0])


def test_no_node_comes_near_an_end_of_its_edge():
    placing, _ = placed({(0, 1): 1e-9, (0, 2): 1.0 - 1e-9, (0, 3): 0.5})
    assert placing.weights[EDGE_NODE, :2] == pytest.approx([1.0 - EDGE_MARGIN, EDGE_MARGIN])
    assert placing.weights[EDGE_NODE + 3, [0, 2]] == pytest.approx([EDGE_MARGIN, 1.0 - EDGE_MARGIN])
    assert volumes(placing.weights).min() > 1e-3


def test_the_centre_of_a_planar_cut_is_not_flat():
    """Without the lift it is flat where the plane has two corners on either side."""
    random = np.random.default_rng(0)
    seen = set()
    for _ in range(200):
        crossings = crossed_by(random.normal(size=3), random.uniform(-0.5, 1.0))
        if not crossings:
            continue
        placing, moved = placed(crossings)
        seen.add(len(crossings))
        assert not moved
        assert volumes(placing.weights)[CENTRE_CHILD] > 4.0 * LEAST_CENTRE
        assert volumes(placing.weights).min() > 0.0
        assert volumes(placing.weights).sum() == pytest.approx(1.0, abs=1e-12)
    assert seen == {3, 4}


def test_the_volume_of_the_centre_is_that_of_its_four_nodes():
    table = splits_of(bodies.unit_tetrahedron()).scheme._table
    random = np.random.default_rng(2)
    for _ in range(20):
        weights = random_weights(random)
        expected = volumes(weights)[CENTRE_CHILD]
        assert centre_volume(table, weights) == pytest.approx(expected, abs=1e-15)


INVERTED = {0: (0.1, 0.1, 0.8), 1: (0.1, 0.8, 0.1), 2: (0.1, 0.8, 0.1), 3: (0.8, 0.1, 0.1)}
"""Weights in the faces opposite A to D that invert the centre."""


def test_free_face_nodes_are_moved_to_the_centroids_until_the_centre_is_not_flat():
    inner = {k: INVERTED[k] for k in (0, 1)}
    tips = {2: (0.0, 1.0, 0.0), 3: (1.0, 0.0, 0.0)}
    placing, moved = placed({(0, 1): 0.5}, tips=tips, neighbours=inner)
    assert moved
    assert volumes(placing.weights).min() >= LEAST_CENTRE
    assert not placing.is_own.any()


def test_a_tetrahedron_whose_face_nodes_are_all_placed_gets_own_copies():
    placing, moved = placed({(0, 1): 0.5}, neighbours=INVERTED)
    assert moved
    assert volumes(placing.weights).min() >= LEAST_CENTRE
    assert 1 <= placing.is_own.sum() <= 2
    for k in np.flatnonzero(placing.is_own == 0):
        assert placing.weights[FACE_NODE + k, list(FACES[k])] == pytest.approx(INVERTED[k])


def test_whatever_the_neighbours_placed_no_part_is_flat():
    random = np.random.default_rng(3)
    for _ in range(200):
        code = random.choice(list(TABLE))
        crossings = {EDGES[e]: random.uniform() for e in range(6) if code >> (5 - e) & 1}
        faces = [k for k in range(4) if random.uniform() < 0.7]
        neighbours = {k: random.dirichlet([1.0, 1.0, 1.0]) for k in faces}
        placing, _ = placed(crossings, neighbours=neighbours)
        v = volumes(placing.weights)
        assert v[CENTRE_CHILD] >= LEAST_CENTRE
        assert v.min() > 0.0
