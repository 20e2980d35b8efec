"""The oracle of the pieces, and what cuts decide, on cuts of a box that can be told by hand."""

import numpy as np
import pytest

from tests.support import soundness
from tests.support.exact_pieces import ExactPieces, divided
from tests.support.piece_bounds import (
    centroids_of,
    contradictions,
    decided,
    pieces_at,
)
from tissue import Tissue, block

SIDE = 0.04
PARTS = divided(block((2, 2, 2), (SIDE, SIDE, SIDE)), 2)
VOLUME = SIDE**3


def across(axis, at, stop=2.0 * SIDE):
    """Return a cut across an axis that runs along the next one up to `stop` [m]."""
    corners = np.zeros((2, 2, 3))
    corners[..., axis] = at
    corners[..., (axis + 1) % 3] = [[-SIDE], [stop]]
    corners[..., (axis + 2) % 3] = [-SIDE, 2.0 * SIDE]
    return corners


def shares(*cuts, crumb=0.0):
    """Return the volumes of the pieces as shares of the box, the smallest first."""
    pieces = ExactPieces(PARTS, crumb * VOLUME)
    for cut in cuts:
        pieces.cut(cut)
    return np.sort(pieces.volumes()) / VOLUME


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("at", [0.5, 0.25, 0.3171])
def test_a_plane_makes_two_pieces_of_its_shares_of_the_box(axis, at):
    """Also where it runs along faces of the mesh, to the size of the parts elsewhere."""
    found = shares(across(axis, at * SIDE), crumb=0.01)
    np.testing.assert_allclose(found, [at, 1.0 - at], atol=1e-12 if at != 0.3171 else 0.03)


def test_three_planes_make_eight_pieces():
    found = shares(*(across(axis, 0.5 * SIDE) for axis in range(3)))
    np.testing.assert_allclose(found, np.full(8, 0.125), rtol=1e-9)


def test_a_cut_that_ends_inside_makes_one_piece_until_another_meets_it():
    slit, along = across(0, 0.4 * SIDE, stop=0.6 * SIDE), across(1, 0.5 * SIDE)
    assert len(shares(slit, crumb=0.01)) == 1
    assert len(shares(slit, along, crumb=0.01)) == 3


def test_a_crumb_stays_with_the_side_that_it_touches_most():
    """The second plane would cut a slab in two crumbs; it stays whole, and so does the rest."""
    slab, half = across(0, 0.25 * SIDE), across(1, 0.5 * SIDE)
    assert len(shares(slab, half, crumb=0.1)) == 4
    assert len(shares(slab, half, crumb=0.2)) == 3


MESH = block((4, 4, 4), (SIDE, SIDE, SIDE))
EIGHTHS = divided(MESH, 1)
CENTROIDS = centroids_of(EIGHTHS)
ERROR = 0.1 * SIDE
CRUMB = 0.01 * SIDE**3


def against(piece_of, *cuts):
    """Return what pieces, told by the centroids of parts, contradict."""
    found = decided(EIGHTHS, cuts, np.full(len(EIGHTHS.volumes), ERROR))
    piece = piece_of(CENTROIDS[found.parts])
    return contradictions(found, piece, EIGHTHS.volumes[found.parts], CRUMB)


def one(points):
    return np.zeros(len(points), dtype=np.int64)


def halves(points, at=0.5):
    return (points[:, 0] > at * SIDE).astype(np.int64)


PLANE = across(0, 0.5 * SIDE)
SLIT = across(0, 0.5 * SIDE, stop=0.5 * SIDE)
ALMOST = across(0, 0.5 * SIDE, stop=SIDE)
"""A cut that ends at the far side of the box, within the error of a cut through it."""


def test_pieces_where_the_cuts_make_them_contradict_nothing():
    assert against(one) == []
    assert against(halves, PLANE) == []
    assert against(one, SLIT) == []


def test_a_cut_that_lies_off_by_more_than_the_error_tears_what_is_whole():
    faults = against(lambda points: halves(points, 0.7), PLANE)
    assert any("a whole region is in pieces" in fault for fault in faults)


def test_what_a_plane_cuts_must_be_apart():
    (fault,) = against(one, PLANE)
    assert "two regions are one piece" in fault


def test_what_a_slit_leaves_must_be_whole():
    (fault,) = against(halves, SLIT)
    assert "a whole region is in pieces" in fault


def test_a_cut_that_ends_within_the_error_of_the_skin_decides_neither():
    assert against(halves, ALMOST) == against(one, ALMOST) == []


def test_an_incision_makes_the_pieces_that_are_decided():
    tissue = Tissue(MESH)
    forward = np.tile([0.0, 1.0, 0.0], (2, 1))
    tissue.incise(PLANE, forward)
    body = tissue.snapshot()
    piece, _ = soundness.piece_volumes(body)
    at = pieces_at(CENTROIDS, body, piece)
    assert (at >= 0).all()
    assert against(lambda points: pieces_at(points, body, piece), PLANE) == []
