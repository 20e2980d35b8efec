"""The generic 1:17 split, at midpoints and centroids."""

import itertools
from collections import Counter

import numpy as np
import pytest

from tissue.cutting.bielser_1998.template_1_to_17 import (
    CENTRE,
    EDGE_NODE,
    FACE_NODE,
    FIRST_J,
    N_CHILDREN,
    N_LOCAL_NODES,
    PRESPLIT,
    generic_weights,
)

pytestmark = pytest.mark.kernel

VOLUMES = np.linalg.det(generic_weights()[PRESPLIT.children])
"""Volumes of the children, as shares of that of the tetrahedron."""


def parts_at(node):
    return {int(PRESPLIT.part[c]) for c in range(N_CHILDREN) if node in PRESPLIT.children[c]}


def test_the_template_has_17_tetrahedra_of_14_nodes():
    assert PRESPLIT.children.shape == (17, 4)
    assert set(PRESPLIT.children.ravel()) == set(range(N_LOCAL_NODES)) == set(range(14))


def test_there_are_22_triangles_inside_and_6_in_each_of_the_four_faces():
    assert (PRESPLIT.inner >= 0).sum() == 2 * 22
    assert (PRESPLIT.inner < 0).sum() == 24
    assert ((PRESPLIT.outer >= 0).sum(axis=0) == 6).all()


def test_cores_are_2_27ths_parts_along_edges_an_18th_and_the_centre_a_27th():
    assert Counter(VOLUMES.round(12)) == {
        round(2 / 27, 12): 4,
        round(1 / 18, 12): 12,
        round(1 / 27, 12): 1,
    }
    assert VOLUMES.sum() == pytest.approx(1.0, abs=1e-12)


def test_edge_nodes_are_referenced_by_two_corners_and_face_nodes_by_three_and_the_centre():
    for node in range(EDGE_NODE, FACE_NODE):
        assert len(parts_at(node)) == 2
    for node in range(FACE_NODE, N_LOCAL_NODES):
        assert len(parts_at(node) - {CENTRE}) == 3
        assert CENTRE in parts_at(node)


def test_inner_links_are_symmetric_and_share_a_triangle():
    for c, f in itertools.product(range(N_CHILDREN), range(4)):
        if PRESPLIT.inner[c, f] >= 0:
            other, g = divmod(int(PRESPLIT.inner[c, f]), 4)
            assert PRESPLIT.inner[other, g] == 4 * c + f
            mine = set(np.delete(PRESPLIT.children[c], f))
            assert mine == set(np.delete(PRESPLIT.children[other], g))


def test_the_five_parts_touch_in_six_triangles_between_corners_and_four_at_the_centre():
    between = Counter(PRESPLIT.triangle[PRESPLIT.triangle >= 0].tolist())
    assert between == {i: 2 for i in range(10)}
    at_centre = PRESPLIT.triangle[PRESPLIT.part == CENTRE]
    assert sorted(at_centre.ravel()) == [FIRST_J + v for v in range(4)]
