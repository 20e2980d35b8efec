"""The connected pieces of a body: number, mass, motion, and whether each is held."""

import numpy as np
import pytest

from tests.support import soundness, strokes
from tissue import Material, TetrahedralMesh, Tissue, block
from tissue.mesh.body import build_body
from tissue.mesh.pieces import (
    are_same_pieces,
    loose_pieces_of,
    no_loose_pieces,
    piece_of_tetrahedra,
    pieces_of,
)

BLOCK = block((4, 2, 2), (0.04, 0.02, 0.02))


def cut_block(weight=0.0):
    """Return a block of 16 g, held at its left half and cut through at 3/4 of its length."""
    tissue = Tissue(
        BLOCK,
        # The toughness is low so that the blade does not push the block aside. With friction the
        # soft piece, turned by the blade, would get caught on the corners of the other one.
        Material(toughness=0.5, friction=0.0),
        fixed=BLOCK.positions[:, 0] <= 0.02,
        gravity=(0.0, 0.0, -weight),
    )
    strokes.make(tissue, strokes.straight(BLOCK, 0.75))
    return tissue


@pytest.fixture(scope="module")
def cut():
    return cut_block()


def test_a_whole_body_is_one_piece():
    tissue = Tissue(BLOCK)
    (piece,) = tissue.pieces()
    assert piece.n_tetrahedra == tissue.n_tetrahedra and piece.n_nodes == tissue.n_nodes
    assert piece.mass == pytest.approx(0.016) and piece.volume == pytest.approx(16e-6)
    assert not piece.is_held
    np.testing.assert_allclose(piece.centre, [0.02, 0.01, 0.01], atol=1e-4)


def test_pieces_are_sorted_by_size_and_know_whether_they_are_held(cut):
    large, small = cut.pieces()
    assert large.is_held and not small.is_held
    assert large.rest_volume == pytest.approx(0.75 * 16e-6)
    assert small.rest_volume == pytest.approx(0.25 * 16e-6)
    assert large.mass + small.mass == pytest.approx(0.016, rel=1e-12)
    assert large.n_tetrahedra + small.n_tetrahedra == cut.n_tetrahedra
    assert large.centre[0] < 0.03 < small.centre[0]


def test_all_counts_of_pieces_agree(cut):
    piece = cut.piece_of_tetrahedra()
    assert np.bincount(piece).tolist() == [p.n_tetrahedra for p in cut.pieces()]
    assert cut.n_pieces() == len(cut.pieces()) == soundness.n_pieces(cut.snapshot().tetrahedra) == 2


def test_a_spinning_piece_has_the_given_velocities(cut):
    body = cut.snapshot()
    nodes = np.unique(body.tetrahedra[piece_of_tetrahedra(body) == 1])
    v, w = np.array([0.1, -0.2, 0.3]), np.array([3.0, -1.0, 2.0])
    body.velocities[nodes] = v + np.cross(w, body.positions[nodes] - pieces_of(body)[1].centre)
    small = pieces_of(body)[1]
    np.testing.assert_allclose(small.velocity, v, atol=1e-12)
    np.testing.assert_allclose(small.angular_velocity, w, atol=1e-9)
    np.testing.assert_allclose(small.angular_momentum, small.inertia @ w, atol=1e-15)
    np.testing.assert_allclose(small.inertia, small.inertia.T)


CELL = block((1, 1, 1), (0.01,) * 3)
N = len(CELL.positions)


def three_blocks(*held):
    """Return three blocks that do not touch, of which some are held at one node."""
    positions = np.concatenate(
        [CELL.positions + np.array([x, 0.0, 0.0]) for x in (0.0, 0.02, 0.04)]
    )
    mesh = TetrahedralMesh(positions, np.concatenate([CELL.tetrahedra + N * i for i in range(3)]))
    fixed = np.zeros(3 * N, np.bool_)
    fixed[[N * i for i in held]] = True
    return build_body(mesh, None, fixed)


def test_a_piece_with_a_fixed_node_is_not_loose():
    loose = loose_pieces_of(three_blocks(1))
    assert loose.begin.tolist() == [0, N, 2 * N]
    assert loose.node.tolist() == [*range(N), *range(2 * N, 3 * N)]


def test_a_body_that_is_held_everywhere_has_no_loose_piece():
    for body in (three_blocks(0, 1, 2), build_body(CELL, None, np.ones(N, np.bool_))):
        loose = loose_pieces_of(body)
        assert len(loose.node) == 0 and loose.begin.tolist() == [0]


def test_a_body_that_is_held_nowhere_is_one_loose_piece():
    loose = loose_pieces_of(build_body(CELL, None, None))
    assert loose.begin.tolist() == [0, N] and loose.node.tolist() == [*range(N)]


def test_the_same_pieces_found_again_are_the_same():
    found = [loose_pieces_of(three_blocks(*held)) for held in ((1,), (1,), (2,), (0, 1, 2))]
    assert are_same_pieces(found[0], found[1])
    assert not are_same_pieces(found[0], found[2])
    assert not are_same_pieces(found[0], found[3])
    assert are_same_pieces(found[3], no_loose_pieces())
