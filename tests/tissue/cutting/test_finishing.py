"""Bridges that a blade passed over are parted where they are small, and where no fragment comes
loose.

The body is the block of 40 x 60 x 40 mm in cells of 10 mm. It is cut from y = 0 on along its middle
plane, which is a plane of the mesh.
"""

import numpy as np
import pytest

from tests.support import soundness
from tissue import Tissue, block
from tissue.blade.prescribed_cut import cut_along
from tissue.cutting.finishing import MOST_PASSED, finish_cut_surface
from tissue.mesh.body import CUT
from tissue.mesh.changes import clear_changes

MIDDLE, HEIGHT, DEPTH = 0.02, 0.04, 0.06


def cut_to(y, has_left=True):
    """Return a block whose middle plane was cut from the front to `y`, before the cut is ended."""
    tissue = Tissue(block(), gravity=(0.0, 0.0, 0.0))
    edges = np.array([[[MIDDLE, at, z] for z in (-0.01, 0.05)] for at in (-0.01, y)])
    forward = np.tile([0.0, 1.0, 0.0], (2, 1))
    cut_along(tissue._stages.incision, tissue._stages.hooks, edges, forward, tissue.node_size)
    tissue._stages.incision.path.has_left = int(has_left)
    return tissue


def test_a_bridge_of_a_tenth_of_the_cut_surface_is_parted():
    """5 mm of 60 are left, an eleventh of the 55 that were cut: the flat strip is the least."""
    tissue = cut_to(0.055)
    before = tissue.snapshot()
    tissue._stages.end_incision()
    change = tissue._stages.incision.scheme.change
    assert change.finished_area == pytest.approx(0.005 * HEIGHT, rel=1e-9)
    assert change.area == pytest.approx(DEPTH * HEIGHT, rel=1e-9)
    after = tissue.snapshot()
    assert tissue.n_pieces() == soundness.n_pieces(after.tetrahedra) == 2
    assert soundness.faults(before, after) == []
    assert soundness.link_faults(tissue._body) == []


@pytest.mark.parametrize(
    ("is_through", "has_end_in", "pieces"), [(1, 0, 2), (1, 1, 1), (0, 0, 1), (0, 1, 1)]
)
def test_a_bridge_of_a_quarter_is_parted_where_the_edge_has_passed_through_all_tissue(
    is_through, has_end_in, pieces
):
    """11.5 mm of 60 are left, 24 % of what was cut."""
    tissue = cut_to(0.0485)
    tissue._stages.incision.path.is_through = is_through
    tissue._stages.incision.path.has_end_in = has_end_in
    tissue._stages.end_incision()
    assert tissue.n_pieces() == pieces


def test_a_bridge_of_a_third_stays_whatever_the_edge_has_passed():
    tissue = cut_to(0.045)
    tissue._stages.incision.path.is_through = 1
    tissue._stages.end_incision()
    assert MOST_PASSED < 0.015 / 0.045
    assert tissue.n_pieces() == 1


def test_a_bridge_stays_where_the_blade_left_the_way_that_it_came():
    tissue = cut_to(0.055, has_left=False)
    tissue._stages.end_incision()
    assert tissue._stages.incision.finished_area == 0.0
    assert tissue.n_pieces() == 1


def test_nothing_is_finished_where_the_body_is_in_two():
    tissue = cut_to(0.07)
    tissue._stages.end_incision()
    assert tissue._stages.incision.finished_area == 0.0
    assert tissue._stages.incision.cut_area == pytest.approx(DEPTH * HEIGHT, rel=1e-9)
    assert tissue.n_pieces() == 2


def test_a_cut_without_a_blade_finishes_nothing():
    tissue = Tissue(block(), gravity=(0.0, 0.0, 0.0))
    edges = [[[MIDDLE, y, z] for z in (-0.01, 0.05)] for y in (-0.01, 0.055)]
    area = tissue.incise(edges, (0.0, 1.0, 0.0))
    assert area == pytest.approx(0.055 * HEIGHT, rel=1e-9)
    assert tissue.n_pieces() == 1


def test_nodes_that_no_blade_passed_count_in_no_path_error():
    """These are the ten at the back, y = 60 mm: five in each lip."""
    tissue = cut_to(0.055)
    tissue._stages.end_incision()
    body = tissue._body
    not_passed = np.flatnonzero(body.off_path[: body.n_nodes] < 0.0)
    np.testing.assert_array_equal(body.rest[not_passed, 1], [DEPTH] * 10)
    t, f = np.nonzero(body.links[: body.n_tetrahedra] == CUT)
    n_cut = len(
        {node for i, k in zip(t, f, strict=True) for node in np.delete(body.tetrahedra[i], k)}
    )
    assert tissue.cut_report().n_cut_nodes == n_cut - 10


def neighbour_across(body, t, f):
    """Return the face that lies on a cut face, as 4 * tetrahedron + face."""
    corners = np.delete(body.tetrahedra[t], f)
    place = {tuple(p) for p in body.rest[corners].tolist()}
    for other, g in np.argwhere(body.links[: body.n_tetrahedra] == CUT):
        there = body.rest[np.delete(body.tetrahedra[other], g)].tolist()
        if other != t and {tuple(p) for p in there} == place:
            return 4 * other + g
    raise AssertionError("the face has no twin")


def test_a_fragment_that_hangs_on_the_other_lip_is_not_cut_loose():
    """One tetrahedron of lip +1 is tied to lip -1, and to nothing else: its face is the least."""
    tissue = cut_to(0.07)
    incision, (body, visits) = tissue._stages.incision, tissue._stages.mesh()
    incision._cut_in_passes(incision.scheme.end, tissue._stages.hooks)
    cut = incision.scheme._arrays(body, visits, incision.path)
    links, surface = body.links, cut.surface
    crumb, f = next(
        (t, f)
        for t, f in np.argwhere(links[: body.n_tetrahedra] == CUT)
        if surface.tetrahedron_stamp[t] == surface.number and surface.tetrahedron_side[t] == 1
    )
    for g in range(4):
        if links[crumb, g] >= 0:
            links[links[crumb, g] // 4, links[crumb, g] % 4] = CUT
            links[crumb, g] = CUT
    other = neighbour_across(body, crumb, f)
    links[crumb, f], links[other // 4, other % 4] = other, 4 * crumb + f
    before = links.copy()
    clear_changes(cut.change)
    finish_cut_surface(cut, incision.scheme._graph, cut.change.area)
    np.testing.assert_array_equal(links, before)
    assert incision.finished_area == 0.0
    assert not incision.scheme._graph.lip.any()
