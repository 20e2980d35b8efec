"""The test whether two edges pass through each other."""

import itertools

import numpy as np
import pytest

from tissue.contact.edge_edge import Edges, edge_edge
from tissue.core.vec3 import Vec3

pytestmark = pytest.mark.kernel

UPPER = np.array([[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
LOWER = np.array([[0.0, -1.0, 0.0], [0.0, 1.0, 0.0]])
DOWN, UP = Vec3(0.0, 0.2, -1.0), Vec3(0.1, 0.0, 2.0)


def edges(height, upper=UPPER):
    rows = [*(upper + np.array([0.0, 0.0, height])), *LOWER]
    return Edges(*(Vec3(*row.tolist()) for row in rows))


def crossing(height_t0, height_t1, outward=DOWN, other_outward=UP, residual=0.0, upper=UPPER):
    return edge_edge(
        edges(height_t0, upper), edges(height_t1, upper), outward, other_outward, residual, 1e-9
    )


def test_crossed_edges_that_move_towards_each_other_pass_through():
    found = crossing(0.1, -0.05)
    assert found.is_through
    assert np.allclose(found.normal, [0.0, 0.0, 1.0])
    assert (found.s, found.t) == pytest.approx((0.5, 0.5))


@pytest.mark.parametrize(
    "case",
    [
        {"height_t0": 0.1, "height_t1": 0.01},
        {"height_t0": -0.1, "height_t1": 0.1},
        {"height_t0": -0.1, "height_t1": -0.11},
        {"height_t0": 0.1, "height_t1": -0.1, "outward": UP},
        {"height_t0": 0.1, "height_t1": -0.1, "upper": UPPER + np.array([2.0, 0.0, 0.0])},
        {"height_t0": 0.1, "height_t1": -0.1, "upper": UPPER[:, [1, 0, 2]]},
    ],
    ids=["stay apart", "come out", "of one body", "face the same way", "pass beside", "parallel"],
)
def test_other_pairs_of_edges_do_not_pass_through(case):
    assert not crossing(**case).is_through


def test_neither_the_order_nor_the_direction_of_edges_matters():
    for flip, flip_other in itertools.product([False, True], repeat=2):
        upper, lower = UPPER[::-1] if flip else UPPER, LOWER[::-1] if flip_other else LOWER

        def at(height, upper=upper, lower=lower):
            return [
                Vec3(*row.tolist()) for row in [*(upper + np.array([0.0, 0.0, height])), *lower]
            ]

        t0, t1 = at(0.1), at(-0.05)
        found = edge_edge(Edges(*t0), Edges(*t1), DOWN, UP, 0.0, 1e-9)
        assert found.is_through and found.normal.z == pytest.approx(1.0)
        swapped = edge_edge(Edges(*t0[2:], *t0[:2]), Edges(*t1[2:], *t1[:2]), UP, DOWN, 0.0, 1e-9)
        assert swapped.is_through and swapped.normal.z == pytest.approx(-1.0)
