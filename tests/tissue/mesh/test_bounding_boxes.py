import numpy as np
import pytest

from tests.tissue.kernels_of import grown_body
from tissue import BladeSegment, BladeSweep, Material, TetrahedralMesh, Tissue, block
from tissue.mesh.body import build_body
from tissue.mesh.bounding_boxes import chunk_nodes, chunks_of

pytestmark = pytest.mark.kernel

BLOCK = block((8, 4, 4), (0.08, 0.04, 0.04))


def body_of(mesh: TetrahedralMesh, positions=None):
    return build_body(mesh, positions, None)


def in_some_box(boxes, points):
    """Return whether each point is in some box."""
    inside = (boxes[:, None, 0] <= points) & (points <= boxes[:, None, 1])
    return inside.all(axis=2).any(axis=0)


def test_every_tetrahedron_is_wholly_in_one_box():
    random = np.random.default_rng(0)
    moved = BLOCK.positions + random.normal(0.0, 3e-3, BLOCK.positions.shape)
    body = body_of(BLOCK, moved)
    chunks = chunks_of(body, chunk_nodes(body))
    corners = moved[BLOCK.tetrahedra]
    low, high = corners.min(axis=1), corners.max(axis=1)
    inside = (chunks.boxes[:, None, 0] <= low) & (high <= chunks.boxes[:, None, 1])
    assert inside.all(axis=2).any(axis=0).all()


def test_boxes_of_a_bent_body_do_not_cover_its_hollow():
    """A bar is bent to a half circle; a single box around it would contain its centre."""
    rest = BLOCK.positions
    turn = np.pi * rest[:, 0] / 0.08
    radius = 0.1 + rest[:, 1]
    bent = np.stack([radius * np.cos(turn), radius * np.sin(turn), rest[:, 2]], axis=1)
    body = body_of(BLOCK, bent)
    boxes = chunks_of(body, chunk_nodes(body)).boxes
    assert in_some_box(boxes, bent).all()
    assert not in_some_box(boxes, np.array([[0.0, 0.02, 0.02]])).any()


def test_a_body_of_one_tetrahedron_is_one_chunk():
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    body = body_of(TetrahedralMesh(corners, np.array([[0, 1, 2, 3]])))
    np.testing.assert_array_equal(
        chunks_of(body, chunk_nodes(body)).boxes, [[[0, 0, 0], [1, 1, 1]]]
    )


def test_the_speed_of_the_fastest_node_is_reported():
    body = body_of(BLOCK)
    body.velocities[7] = 3.0, 0.0, -4.0
    assert chunks_of(body, chunk_nodes(body)).fastest == 5.0


def test_spare_capacity_is_in_no_box():
    body = body_of(BLOCK)
    grown = grown_body(body, 1000, 9000)
    grown.positions[len(BLOCK.positions) :] = 1e6
    expected = chunks_of(body, chunk_nodes(body)).boxes
    np.testing.assert_array_equal(chunks_of(grown, chunk_nodes(grown)).boxes, expected)


def test_boxes_follow_a_body_that_is_cut():
    """The blade cuts half through; the boxes contain the new nodes and their neighbours."""
    mesh = block((2, 2, 2), (0.02, 0.02, 0.02))
    tissue = Tissue(mesh, Material(toughness=5.0), fixed=mesh.positions[:, 0] == 0.0)
    before = None
    for y in np.linspace(-0.001, 0.012, 27):
        tip, heel = np.array([0.009, y, -0.005]), np.array([0.009, y, 0.025])
        after = BladeSegment(tip, heel, np.array([0.0, 1.0, 0.0]))
        tissue.step(BladeSweep(before or after, after), 5e-3)
        before = after
        snapshot = tissue.snapshot()
        corners = snapshot.positions[snapshot.tetrahedra]
        low, high, boxes = corners.min(axis=1), corners.max(axis=1), tissue.chunks().boxes
        inside = (boxes[:, None, 0] <= low) & (high <= boxes[:, None, 1])
        assert inside.all(axis=2).any(axis=0).all()
    assert len(snapshot.positions) > len(mesh.positions)
