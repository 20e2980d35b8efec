"""The oracle of the pieces, on cuts of a box whose pieces can be told by hand."""

import numpy as np
import pytest

from tests.support.exact_pieces import ExactPieces, divided
from tissue import block

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
