import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.collision.broad_phase import ChunkBoxes, not_separated
from bridge.collision.collision_objects import MovableBox
from bridge.collision.swept_box import box_around

CHUNKS = np.array([[[0.0, 0, 0], [1, 1, 1]], [[2.0, 0, 0], [3, 1, 1]]])

coordinates = st.floats(-1.0, 1.0)
points = st.tuples(coordinates, coordinates, coordinates).map(np.array)


def stick(start, end):
    """Return a thin box around a line segment, aligned with it."""
    along = (end - start) / np.linalg.norm(end - start)
    across = np.linalg.qr(np.stack([along, *np.eye(3)[:2] + 0.1], axis=1))[0]
    return box_around(np.stack([start, end]), across)


def is_colliding(box, chunks):
    movable = MovableBox()
    movable.place(box)
    return ChunkBoxes().collide_with(box, movable.object, chunks)


@pytest.mark.parametrize(("x", "found"), [(0.5, [0]), (1.5, []), (2.5, [1])])
def test_a_stick_collides_with_the_chunk_that_it_is_in(x, found):
    box = stick(np.array([x, 0.2, 0.5]), np.array([x + 0.1, 0.9, 0.6]))
    assert not_separated(box, CHUNKS).tolist() == found
    assert is_colliding(box, CHUNKS) == bool(found)


def test_a_slanted_stick_beside_a_corner_does_not_collide():
    box = stick(np.array([1.5, 0.6, 0.5]), np.array([0.6, 1.5, 0.5]))
    assert not is_colliding(box, CHUNKS[:1])


def test_a_stick_that_only_a_pair_of_edges_separates_is_left_to_the_collision_library():
    rng, n_left_over = np.random.default_rng(0), 0
    for _ in range(2000):
        box = stick(*rng.uniform(-1.0, 2.0, (2, 3)))
        remaining = not_separated(box, CHUNKS[:1])
        n_left_over += len(remaining) > 0 and not is_colliding(box, CHUNKS[:1])
    assert n_left_over > 10


@given(points, points.filter(lambda p: np.linalg.norm(p) > 1e-3), st.floats(0.0, 1.0), points)
def test_a_chunk_that_contains_a_point_of_the_box_is_never_missed(start, displacement, along, size):
    point = start + along * displacement
    chunk = np.array([[point - np.abs(size), point + np.abs(size)]])
    assert is_colliding(stick(start, start + displacement), chunk)


def test_without_chunks_nothing_collides():
    assert not is_colliding(stick(np.zeros(3), np.ones(3)), np.zeros((0, 2, 3)))
