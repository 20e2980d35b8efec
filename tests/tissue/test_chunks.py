import numpy as np
import pytest

from tests.tissue.kernels_of import grown_body
from tissue.body import build_body
from tissue.chunks import chunk_cells, chunks_of
from tissue.shapes import grid
from tissue.types import TetrahedralMesh

pytestmark = pytest.mark.kernel

BLOCK = grid((8, 4, 4), (0.08, 0.04, 0.04))


def body_of(mesh: TetrahedralMesh, positions=None):
    return build_body(mesh, positions, None)


def is_held(boxes, points):
    """Whether each point is in one box."""
    inside = (boxes[:, None, 0] <= points) & (points <= boxes[:, None, 1])
    return inside.all(axis=2).any(axis=0)


def test_every_tetrahedron_is_wholly_in_one_box():
    random = np.random.default_rng(0)
    moved = BLOCK.positions + random.normal(0.0, 3e-3, BLOCK.positions.shape)
    body = body_of(BLOCK, moved)
    chunks = chunks_of(body, chunk_cells(body))
    corners = moved[BLOCK.tetrahedra]
    low, high = corners.min(axis=1), corners.max(axis=1)
    inside = (chunks.boxes[:, None, 0] <= low) & (high <= chunks.boxes[:, None, 1])
    assert inside.all(axis=2).any(axis=0).all()


def test_boxes_of_a_bent_body_leave_the_hollow_free():
    """A bar that is bent to a half circle: one box around it would hold its centre."""
    rest = BLOCK.positions
    turn = np.pi * rest[:, 0] / 0.08
    radius = 0.1 + rest[:, 1]
    bent = np.stack([radius * np.cos(turn), radius * np.sin(turn), rest[:, 2]], axis=1)
    body = body_of(BLOCK, bent)
    boxes = chunks_of(body, chunk_cells(body)).boxes
    assert is_held(boxes, bent).all()
    assert not is_held(boxes, np.array([[0.0, 0.02, 0.02]])).any()


def test_a_body_of_one_tetrahedron_is_one_chunk():
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    body = body_of(TetrahedralMesh(corners, np.array([[0, 1, 2, 3]])))
    np.testing.assert_array_equal(
        chunks_of(body, chunk_cells(body)).boxes, [[[0, 0, 0], [1, 1, 1]]]
    )


def test_the_fastest_node_is_told():
    body = body_of(BLOCK)
    body.velocities[7] = 3.0, 0.0, -4.0
    assert chunks_of(body, chunk_cells(body)).fastest == 5.0


def test_room_to_grow_is_in_no_box():
    body = body_of(BLOCK)
    cells = chunk_cells(body)
    grown = grown_body(body, 1000, 9000)
    grown.positions[len(BLOCK.positions) :] = 1e6
    np.testing.assert_array_equal(chunks_of(grown, cells).boxes, chunks_of(body, cells).boxes)
