"""An edge in two sheets at once: each is followed with its own rotation, and nothing lies between.

The body is two cubes of 20 mm, which no tetrahedron joins: two sheets of an organ, far from each
other at rest and side by side on the edge. The edge has 21 samples, 5 mm apart.
"""

import numpy as np
import pytest

from tests.tissue.kernels_of import line_blade
from tissue import TetrahedralMesh, block
from tissue.blade.edge import Edge
from tissue.blade.edge_anchors import FREE, LEFT, RETRACTED, new_anchors
from tissue.blade.material_frame import find_sheets
from tissue.blade.path_tracing import forget_path, trace_path
from tissue.blade.return_mapping import set_anchor
from tissue.core.vec3 import Vec3
from tissue.cutting.blade_path import new_path
from tissue.mesh.body import build_body
from tissue.mesh.point_location import tetrahedron_at
from tissue.mesh.tetrahedron_grid import build_grid

pytestmark = pytest.mark.kernel

SIDE, SPACING, N = 0.02, 5e-3, 21
REACH = 0.01
"""`BladeState.reach`, a node size [m]: two spacings."""
MARGIN = 5e-3
NEAR, FAR = np.zeros(3), np.array([0.0, 0.3, 0.08])
"""Where the two cubes are at rest [m]."""
QUARTER = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
"""Turns y to z."""
Y, Z = np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0])
EDGE = Edge(*(Vec3(*row) for row in ([0.01, 0.01, 0.0], [0.01, 0.01, 0.1], Y) * 2))


class TwoSheets:
    """Two cubes, the far one turned by a quarter about its middle, and an edge in both."""

    def __init__(self, turn=QUARTER):
        cube = block((2, 2, 2), (SIDE,) * 3)
        n = len(cube.positions)
        rest = np.concatenate([cube.positions + NEAR, cube.positions + FAR])
        mesh = TetrahedralMesh(rest, np.concatenate([cube.tetrahedra, cube.tetrahedra + n]))
        positions = rest.copy()
        middle = FAR + 0.5 * SIDE
        positions[n:] = (rest[n:] - middle) @ turn.T + [0.01, 0.01, 0.09]
        self.body = build_body(mesh, positions, None)
        self.grid = build_grid(self.body, self.body.rest, 0.0)
        self.anchors = new_anchors(N, SPACING * (N - 1), 1.0)
        self.blade = line_blade(self.anchors).replaced(reach=REACH)
        self.path = new_path(N)

    def hold(self, k, *at, slipped=True):
        """Anchor sample `k` at a point of the body at rest."""
        p = Vec3(*(float(x) for x in at))
        t = tetrahedron_at(self.body, self.grid, self.body.rest, p)
        assert t >= 0
        set_anchor(self.anchors, self.body, k, t, p)
        self.anchors.slipped[k] = slipped
        self.anchors.is_new[k] = True

    def hold_both(self, y=0.01):
        """Hold the near sheet with samples 1 to 3, and the far one with 16 to 18."""
        for k in (1, 2, 3):
            self.hold(k, 0.01, y, SPACING * k)
        for k in (16, 17, 18):
            self.hold(k, 0.01, 0.3 + y, 0.08 + SPACING * (k - 15))

    def trace(self):
        trace_path(self.blade, self.body, EDGE, 1.0, MARGIN, self.path)
        return self.path


def rotation(sheets, k):
    """Return the matrix of a sheet's rotation."""
    return sheets.rotation[k].reshape(3, 3).T


def test_each_sheet_has_its_own_rotation():
    held = TwoSheets()
    held.hold_both()
    find_sheets(held.anchors, held.body, REACH)
    sheets = held.anchors.sheets
    assert sheets.first[[1, 2, 3, 16, 17, 18]].tolist() == [1, 1, 1, 16, 16, 16]
    assert (np.delete(sheets.first, [1, 2, 3, 16, 17, 18]) == -1).all()
    np.testing.assert_allclose(rotation(sheets, 2), np.eye(3), atol=1e-12)
    np.testing.assert_allclose(rotation(sheets, 17), QUARTER, atol=1e-12)


def test_samples_beside_each_other_that_hold_points_far_apart_hold_two_sheets():
    """Without a gap: 2 and 3 are 5 mm apart on the edge, and 0.3 m at rest."""
    held = TwoSheets()
    held.hold_both()
    held.hold(3, 0.01, 0.31, 0.09)
    find_sheets(held.anchors, held.body, REACH)
    assert held.anchors.sheets.first[[1, 2, 3]].tolist() == [1, 1, 3]


def test_a_free_sample_is_placed_with_the_nearer_sheet():
    """6 samples out from 3: at 5 mm each along z; and in the turned sheet along y at rest."""
    held = TwoSheets()
    held.hold_both()
    path = held.trace()
    assert path.member[[5, 9, 10, 14]].all()
    np.testing.assert_allclose(path.t1[5], path.t1[3] + 2 * SPACING * Z, atol=1e-12)
    np.testing.assert_allclose(path.t1[14], path.t1[16] - 2 * SPACING * Y, atol=1e-12)
    np.testing.assert_array_equal(path.forward[5], path.forward[3])
    np.testing.assert_array_equal(path.forward[14], path.forward[16])


def test_no_cut_surface_is_drawn_between_two_sheets():
    """Samples 9 and 10 are placed beside each other on the edge, and 0.3 m apart at rest."""
    held = TwoSheets()
    held.hold_both()
    linked = held.trace().linked
    assert not linked[9]
    assert linked[:9].all()
    assert linked[10:20].all()


def test_one_sheet_that_is_held_in_two_places_is_linked_between_them():
    """The samples as before, in cubes that are at rest where they are now."""
    held = TwoSheets(np.eye(3))
    held.body.rest[27:] = held.body.positions[27:]
    held.grid = build_grid(held.body, held.body.rest, 0.0)
    for k in (1, 2, 3, 16, 17, 18):
        held.hold(k, 0.01, 0.01, SPACING * k)
    assert held.trace().linked[:20].all()


def test_a_sample_that_moves_ahead_in_its_sheet_spans_a_cut_surface_from_where_it_was():
    held = TwoSheets()
    held.hold_both(0.005)
    held.trace()
    held.hold_both(0.010)
    path = held.trace()
    np.testing.assert_allclose(path.t1[2] - path.t0[2], 0.005 * Y, atol=1e-12)
    np.testing.assert_allclose(path.t1[5] - path.t0[5], 0.005 * Y, atol=1e-12)


def test_a_sample_that_takes_hold_of_another_sheet_begins_anew_there():
    """It was 0.3 m away: nothing was cut between. The step begins a margin outside the skin."""
    held = TwoSheets(np.eye(3))
    held.hold_both(0.01)
    held.trace()
    for k in (1, 2, 3):
        held.hold(k, 0.01, 0.301, 0.08 + SPACING * k)
    path = held.trace()
    np.testing.assert_allclose(path.t1[2], [0.01, 0.301, 0.09], atol=1e-12)
    np.testing.assert_allclose(path.t0[2], [0.01, 0.301 - MARGIN, 0.09], atol=1e-12)
    np.testing.assert_allclose(path.t1[5] - path.t0[5], MARGIN * Y, atol=1e-12)


def test_a_sheet_that_the_edge_only_presses_has_not_begun_though_another_is_cut():
    held = TwoSheets()
    held.hold_both()
    held.anchors.slipped[16:19] = False
    path = held.trace()
    assert held.anchors.sheets.has_begun[[1, 16]].tolist() == [True, False]
    np.testing.assert_array_equal(path.t1[17], path.t0[17])


def test_nothing_begins_beside_samples_from_which_the_blade_has_backed_off():
    """Where the edge pulls, a free sample that was placed nowhere yet begins outside the skin."""
    held = TwoSheets(np.eye(3))
    held.hold_both()
    held.anchors.state[1:4] = RETRACTED
    path = held.trace()
    np.testing.assert_array_equal(path.t0[5], path.t1[5])
    np.testing.assert_allclose(path.t1[14] - path.t0[14], MARGIN * Y, atol=1e-12)


def test_the_cut_surface_ends_outside_the_sheet_that_is_left_and_goes_on_in_the_other():
    held = TwoSheets(np.eye(3))
    held.hold_both(0.015)
    held.trace()
    held.hold_both(0.018)
    held.anchors.state[1:4] = LEFT
    path = held.trace()
    assert path.t1[2, 1] == pytest.approx(0.018 + MARGIN)
    assert path.t1[17, 1] == pytest.approx(0.318)
    assert (held.anchors.state[1:4] == FREE).all()


def test_an_edge_is_through_once_all_that_it_holds_is_left_ahead():
    held = TwoSheets()
    held.hold_both()
    assert held.trace().is_through == 0
    for k in (1, 2, 3):
        held.anchors.state[k] = LEFT
    assert held.trace().is_through == 0
    for k in (16, 17, 18):
        held.anchors.state[k] = LEFT
    path = held.trace()
    assert path.is_through == 1
    assert path.has_end_in == 0


@pytest.mark.parametrize("end", [0, N - 1])
def test_an_end_of_the_edge_that_once_held_tissue_is_remembered_until_the_path_is_forgotten(end):
    held = TwoSheets()
    held.hold(end, 0.01, 0.01, 0.01)
    assert held.trace().has_end_in == 1
    held.anchors.state[end] = FREE
    held.hold(2, 0.01, 0.01, 0.01)
    assert held.trace().has_end_in == 1
    forget_path(held.path)
    assert held.trace().has_end_in == 0
