"""What cuts decide, on cuts of a box whose pieces can be told by hand."""

import numpy as np
import pytest

from tests.support import soundness
from tests.support.exact_pieces import divided
from tests.support.piece_bounds import (
    centroids_of,
    contradictions,
    decided,
    pieces_at,
    trimmed,
    within,
)
from tests.support.test_exact_pieces import SIDE, across
from tissue import Tissue, block

MESH = block((4, 4, 4), (SIDE, SIDE, SIDE))
PARTS = divided(MESH, 1)
CENTROIDS = centroids_of(PARTS)
ERROR = 0.1 * SIDE
CRUMB = 0.01 * SIDE**3


def against(piece_of, *cuts):
    """Return what pieces, told by the centroids of parts, contradict."""
    found = decided(PARTS, cuts, np.full(len(PARTS.volumes), ERROR))
    piece = piece_of(CENTROIDS[found.parts])
    return contradictions(found, piece, PARTS.volumes[found.parts], CRUMB)


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


def test_a_cut_that_lies_off_by_less_than_the_error_contradicts_nothing():
    assert against(lambda points: halves(points, 0.45), PLANE) == []


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


def test_a_trimmed_surface_ends_by_so_much_earlier_all_round():
    cut = trimmed(PLANE, 0.1 * SIDE)
    margin = np.array([0.0, 0.1 * SIDE, 0.1 * SIDE])
    np.testing.assert_allclose(cut.min(axis=(0, 1)), PLANE.min(axis=(0, 1)) + margin)
    np.testing.assert_allclose(cut.max(axis=(0, 1)), PLANE.max(axis=(0, 1)) - margin)
    assert len(trimmed(PLANE, 2.0 * SIDE)) == 0


@pytest.mark.parametrize(
    ("point", "distance"), [([0.7, 0.5, 0.5], 0.2), ([0.5, 2.3, 0.5], 0.3), ([0.8, 2.4, 0.5], 0.5)]
)
def test_the_distance_from_a_surface_is_that_from_its_nearest_point(point, distance):
    points = SIDE * np.array([point, point])
    reach = SIDE * distance * np.array([0.999, 1.001])
    assert within(points, PLANE, reach).tolist() == [False, True]
