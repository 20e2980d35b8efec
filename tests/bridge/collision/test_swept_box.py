import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.collision.collision_objects import MovableBox, are_colliding
from bridge.collision.swept_box import (
    TOUCHING_MARGIN,
    SweptBox,
    edge_axes,
    gap_between,
    swept_blade,
)
from tissue import BladeSegment, BladeShape, BladeSweep

SCALPEL = BladeShape()
WEDGE = BladeShape(thickness=4e-3, bevel_angle=0.5, height=20e-3)

coordinates = st.floats(-0.1, 0.1)
vectors = st.tuples(coordinates, coordinates, coordinates).map(np.array)
fractions = st.floats(0.0, 1.0)


@st.composite
def segments(draw):
    """Draw an edge of 1 to 200 mm, whose forward need not be exactly across it."""
    edge = draw(vectors.filter(lambda v: np.linalg.norm(v) > 1e-3))
    forward = draw(vectors.filter(lambda v: np.linalg.norm(np.cross(v, edge)) > 1e-5))
    forward /= np.linalg.norm(forward)
    if abs(forward @ edge) > 0.9 * np.linalg.norm(edge):
        forward = np.cross(edge, np.roll(forward, 1) + 0.1)
        forward /= np.linalg.norm(forward)
    tip = draw(vectors)
    return BladeSegment(tip, tip + edge, forward)


@st.composite
def sweeps(draw):
    """Draw two arbitrary poses, or a pose and a small motion of it, as in a frame."""
    before, after = draw(segments()), draw(segments())
    share = draw(st.sampled_from([1.0, 0.1, 1e-2, 1e-4]))
    tip = before.tip + share * (after.tip - before.tip)
    heel = before.heel + share * (after.heel - before.heel)
    forward = before.forward + share * (after.forward - before.forward)
    edge = (heel - tip) / max(np.linalg.norm(heel - tip), 1e-12)
    across = forward - (forward @ edge) * edge
    if np.linalg.norm(heel - tip) < 1e-3 or np.linalg.norm(across) < 0.1:
        return BladeSweep(before, before)
    return BladeSweep(before, BladeSegment(tip, heel, across / np.linalg.norm(across)))


def pose_at(sweep, when):
    """Return the pose at a fraction of a sweep, interpolated linearly as in the tissue."""
    t0, t1 = sweep
    forward = (1.0 - when) * t0.forward + when * t1.forward
    return BladeSegment(
        (1.0 - when) * t0.tip + when * t1.tip, (1.0 - when) * t0.heel + when * t1.heel, forward
    )


def contains(box, point):
    return bool(np.all(np.abs(box.axes.T @ (point - box.centre)) <= 0.5 * box.size))


@given(sweeps(), fractions, fractions)
def test_the_swept_box_contains_the_edge_during_the_whole_step(sweep, along, when):
    pose = pose_at(sweep, when)
    assert contains(swept_blade(sweep), pose.tip + along * (pose.heel - pose.tip))


@pytest.mark.parametrize("shape", [SCALPEL, WEDGE])
@given(sweeps(), fractions, fractions, fractions, st.sampled_from([-1.0, 1.0]))
def test_the_swept_box_contains_the_body_of_the_blade_however_it_turns(
    shape, sweep, along, when, back, side
):
    pose = pose_at(sweep, when)
    edge = pose.tip - pose.heel
    if np.linalg.norm(np.cross(edge, pose.forward)) < 1e-6:
        return  # halfway through a turn the blade has no plane, as in the tissue
    axes = edge_axes(pose)
    point = pose.heel + along * edge
    point = point - back * shape.height * axes[:, 0] + side * 0.5 * shape.thickness * axes[:, 2]
    assert contains(swept_blade(sweep, shape), point)


@given(segments())
def test_the_box_of_a_blade_at_rest_is_the_blade(pose):
    box = swept_blade(BladeSweep(pose, pose), SCALPEL)
    length = np.linalg.norm(pose.tip - pose.heel)
    expected = np.array([SCALPEL.height, length, SCALPEL.thickness])
    np.testing.assert_allclose(box.size, expected + 2.0 * TOUCHING_MARGIN, atol=1e-9)


def test_the_box_of_a_blade_that_turns_by_a_degree_is_hardly_larger_than_it():
    turn = math.radians(1.0)
    before = BladeSegment(np.zeros(3), np.array([0, 0, 0.04]), np.array([0.0, 1.0, 0.0]))
    after = before._replace(forward=np.array([math.sin(turn), math.cos(turn), 0.0]))
    box = swept_blade(BladeSweep(before, after), SCALPEL)
    at_rest = np.array([SCALPEL.height, 0.04, SCALPEL.thickness])
    assert ((at_rest < box.size) & (box.size < at_rest + 0.4e-3)).all()


@given(segments())
def test_the_axes_of_an_edge_form_a_rotation(pose):
    axes = edge_axes(pose)
    np.testing.assert_allclose(axes.T @ axes, np.eye(3), atol=1e-9)
    assert np.linalg.det(axes) == pytest.approx(1.0)


# ---- gaps ----------------------------------------------------------------------------------------

sizes = st.tuples(*[st.floats(0.01, 1.0)] * 3).map(np.array)
rotations = st.integers(0, 2**32 - 1).map(
    lambda seed: np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0]
)
boxes = st.builds(SweptBox, vectors.map(lambda v: 10.0 * v), sizes, rotations)


def test_boxes_side_by_side_are_as_far_apart_as_their_faces():
    one = SweptBox(np.zeros(3), np.full(3, 2.0), np.eye(3))
    assert gap_between(one, one._replace(centre=np.array([2.5, 0.3, 0.0]))) == pytest.approx(0.5)
    assert gap_between(one, one._replace(centre=np.array([1.9, 0.3, 0.0]))) == 0.0


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
