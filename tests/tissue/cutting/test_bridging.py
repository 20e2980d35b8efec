"""Bridges: edges that still join both sides of the cut surface behind the blade."""

import numpy as np
import pytest

from tests.tissue.cutting import upright_edge
from tissue.cutting.bridging import remember_active, resolve_bridges
from tissue.cutting.cut_surface import note_side, on_cut_surface, side_of
from tissue.mesh.changes import note_dirty

pytestmark = pytest.mark.kernel


def corner(x: float, low: float = -1.0):
    """Return the corner of a unit cube, active in the last step, with a blade plane at `x`.

    Nodes 0 and 1 are noted on its two sides.
    """
    cut = upright_edge.corner(x, ahead=0.3, low=low)
    cut.scratch.active[0] = 0
    cut.scratch.n_active = 1
    remember_active(cut)
    cut.scratch.n_active = 0
    note_side(cut.surface, 0, -1, True)
    note_side(cut.surface, 1, 1, True)
    return cut


def test_an_edge_between_both_sides_is_cut_where_the_cut_surface_crosses_it():
    cut = corner(0.5)
    resolve_bridges(cut)
    assert cut.body.n_nodes == 5
    np.testing.assert_allclose(cut.body.rest[4], [0.5, 0.0, 0.0])
    assert on_cut_surface(cut.surface, 4)


def test_the_wrong_side_of_a_node_far_from_the_cut_surface_is_corrected():
    cut = corner(-0.5)  # the tetrahedron is wholly on side +1
    resolve_bridges(cut)
    assert cut.body.n_nodes == 4
    assert side_of(cut.surface, 0) == 1


def test_an_edge_that_the_blade_has_not_reached_is_no_bridge():
    cut = corner(0.5)
    cut.path.t1[:, 1] = -0.2  # edge 0-1 is at y = 0
    resolve_bridges(cut)
    assert cut.body.n_nodes == 4
    assert not on_cut_surface(cut.surface, 0)
    assert not on_cut_surface(cut.surface, 1)


def test_a_node_on_the_wrong_side_but_near_the_cut_surface_is_put_on_it():
    cut = corner(-0.05)
    resolve_bridges(cut)
    assert cut.body.n_nodes == 4
    assert on_cut_surface(cut.surface, 0)


@pytest.mark.parametrize(("low", "n_active"), [(1.5, 0), (-1.0, 1)], ids=["beyond tip", "active"])
def test_a_tetrahedron_beyond_the_tip_or_still_active_is_no_bridge(low, n_active):
    cut = corner(0.5, low=low)
    cut.scratch.n_active = n_active
    resolve_bridges(cut)
    assert cut.body.n_nodes == 4


def test_changed_tetrahedra_are_remembered_along_with_the_active_ones():
    cut = corner(0.5)
    cut.scratch.n_active = 1
    note_dirty(cut.change, 0)
    remember_active(cut)
    assert cut.scratch.n_previous == 2
