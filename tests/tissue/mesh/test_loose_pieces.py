"""Which pieces are loose, and which nodes are theirs."""

import numpy as np

from tissue import TetrahedralMesh, block
from tissue.mesh.body import build_body
from tissue.mesh.pieces import are_same_pieces, loose_pieces_of, no_loose_pieces

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
