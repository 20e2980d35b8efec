import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.collision.collision_objects import MovableBox, are_colliding
from bridge.collision.swept_box import SweptBox, gap_between

numbers = st.floats(-1.0, 1.0)
vectors = st.tuples(numbers, numbers, numbers).map(np.array)
sizes = st.tuples(*[st.floats(0.01, 1.0)] * 3).map(np.array)
rotations = st.integers(0, 2**32 - 1).map(
    lambda seed: np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0]
)
boxes = st.builds(SweptBox, vectors, sizes, rotations)


def test_boxes_side_by_side_are_as_far_apart_as_their_faces():
    one = SweptBox(np.zeros(3), np.full(3, 2.0), np.eye(3))
    assert gap_between(one, one._replace(centre=np.array([2.5, 0.3, 0.0]))) == pytest.approx(0.5)
    assert gap_between(one, one._replace(centre=np.array([1.9, 0.3, 0.0]))) == 0.0


def test_crossed_edges_are_found_apart():
    """Two long bars at right angles, each on its edge: only their edges separate them."""
    s = np.sqrt(0.5)
    along_x = np.array([[1.0, 0.0, 0.0], [0.0, s, -s], [0.0, s, s]])
    along_y = np.array([[s, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, s]])
    one = SweptBox(np.zeros(3), np.array([9.0, 1.0, 1.0]), along_x)
    above = np.array([0.0, 0.0, np.sqrt(2.0) + 0.01])
    other = SweptBox(above, np.array([1.0, 9.0, 1.0]), along_y)
    assert gap_between(one, other) == pytest.approx(0.01)


@given(boxes, boxes, st.integers(0, 2**32 - 1))
def test_no_two_points_of_the_boxes_are_nearer_than_the_gap(one, other, seed):
    rng = np.random.default_rng(seed)
    a, b = (
        box.centre + (rng.uniform(-0.5, 0.5, (200, 3)) * box.size) @ box.axes.T
        for box in (one, other)
    )
    nearest = np.linalg.norm(a[:, None] - b[None], axis=2).min()
    assert gap_between(one, other) <= nearest + 1e-12


@given(boxes, boxes)
def test_boxes_have_a_gap_exactly_where_the_collision_library_finds_them_apart(one, other):
    objects = MovableBox(), MovableBox()
    for placed, box in zip(objects, (one, other), strict=True):
        placed.place(box)
    gap = gap_between(one, other)
    assert gap_between(other, one) == pytest.approx(gap, abs=1e-12)
    grown = one._replace(size=one.size + 1e-6), other._replace(size=other.size + 1e-6)
    is_near = gap > 0.0 and gap_between(*grown) == 0.0
    if not is_near:
        assert are_colliding(objects[0].object, objects[1].object) == (gap == 0.0)
