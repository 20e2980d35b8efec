"""Snapping: whether a crossing splits its edge, uses a node of it, or does nothing."""

import numpy as np
import pytest

from tests.tissue.cutting import upright_edge
from tissue.core.vec3 import Vec3
from tissue.cutting.cut_surface import begin_cut_surface, on_cut_surface, side_of
from tissue.cutting.snapping import insert_crossing, insert_in_face, snap_distance, sort_crossings
from tissue.cutting.workspace import flag

pytestmark = pytest.mark.kernel

SIZE = 1.0 / np.sqrt(3.0)
"""Size (altitude) of the node at the origin of the corner of a cube; the others have size 1."""


def corner(x: float, **quality):
    """Return the corner of a unit cube with a blade plane at `x`, its side +1 towards +x."""
    cut = upright_edge.corner(x)
    return cut.replaced(limits=cut.limits.replaced(**quality))


def test_an_edge_crossed_in_its_middle_gets_a_node_there():
    cut = corner(0.5)
    insert_crossing(cut, 0, 1, 0, 0.5)
    assert cut.body.n_nodes == 5
    np.testing.assert_allclose(cut.body.rest[4], [0.5, 0.0, 0.0])
    assert on_cut_surface(cut.surface, 4)


def test_the_sides_of_the_ends_of_a_crossed_edge_are_noted():
    cut = corner(0.5)
    insert_crossing(cut, 0, 1, 0, 0.5)
    assert (side_of(cut.surface, 0), side_of(cut.surface, 1)) == (-1, 1)


@pytest.mark.parametrize(("share", "splits"), [(0.29, False), (0.31, True)])
def test_a_crossing_nearer_than_a_share_of_the_node_s_size_uses_the_node(share, splits):
    x = share * SIZE
    cut = corner(x, snap=0.3)
    insert_crossing(cut, 0, 1, 0, x)
    assert (cut.body.n_nodes == 5) == splits
    assert on_cut_surface(cut.surface, 0) != splits


def test_a_crossing_nearer_than_the_floor_uses_the_node():
    cut = corner(0.25, snap=0.0, floor=0.3)
    insert_crossing(cut, 0, 1, 0, 0.25)
    assert cut.body.n_nodes == 4
    assert on_cut_surface(cut.surface, 0)


def test_a_split_that_would_break_the_guard_uses_the_nearest_node():
    cut = corner(0.3, snap=0.01, guard=0.5)
    insert_crossing(cut, 0, 1, 0, 0.3)
    assert cut.body.n_nodes == 4
    assert on_cut_surface(cut.surface, 0)


def test_the_offset_of_a_node_is_its_distance_from_the_cut_surface():
    cut = corner(0.1)
    insert_crossing(cut, 0, 1, 0, 0.1)
    assert cut.surface.offset[0] == pytest.approx(0.1)


def test_a_crossing_near_a_node_on_the_cut_surface_adds_no_node():
    cut = corner(0.1)
    insert_crossing(cut, 0, 1, 0, 0.1)
    insert_crossing(cut, 0, 2, 0, 0.1)
    assert cut.body.n_nodes == 4
    assert cut.change.n_flagged == 1


def test_an_edge_with_both_ends_on_the_cut_surface_is_not_split():
    cut = corner(0.5)
    flag(cut, 0)
    flag(cut, 1)
    insert_crossing(cut, 0, 1, 0, 0.5)
    assert cut.body.n_nodes == 4


def test_a_node_of_an_earlier_cut_surface_snaps_a_repeated_cut_from_further():
    cut = corner(0.4)
    flag(cut, 0)  # 0.4 from the cut surface, further than a new node may be
    assert snap_distance(cut, 0) == pytest.approx(0.3 * SIZE)
    begin_cut_surface(cut.surface)
    assert snap_distance(cut, 0) == pytest.approx(1.5 * 0.4)


@pytest.mark.parametrize(
    ("weights", "place"),
    [
        (Vec3(0.9, 0.05, 0.05), 1),
        (Vec3(0.05, 0.9, 0.05), 2),
        (Vec3(1 / 3, 1 / 3, 1 / 3), 4),
        (Vec3(0.5, 0.48, 0.02), 4),
    ],
    ids=["at a corner", "at another corner", "in the middle", "at a side"],
)
def test_a_point_in_a_face_uses_its_corner_splits_its_side_or_itself(weights, place):
    cut = corner(0.5, snap=0.2)
    assert insert_in_face(cut, 1, 2, 3, weights) == place
    assert on_cut_surface(cut.surface, place)
    if weights.z == 0.02:  # on the side of 1 and 2
        assert cut.body.rest[4, 2] == 0.0


def test_crossings_are_handled_from_the_middle_of_their_edges_outwards():
    cut = corner(0.5)
    scratch = cut.scratch
    scratch.n_crossings = 4
    scratch.crossing[:4, :2] = [[5, 6], [1, 9], [1, 3], [0, 1]]
    scratch.crossing_at[:4, 0] = [0.9, 0.4, 0.6, 0.5]
    sort_crossings(cut)
    assert scratch.order[:4].tolist() == [3, 2, 1, 0]
