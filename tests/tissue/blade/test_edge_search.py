"""A blade is in a slit beside a cut face, not ahead of its rim, below its bottom or across it."""

import numpy as np
import pytest

from tests.tissue.kernels_of import line_blade
from tissue import Tissue, block
from tissue.blade.edge import Edge, pose_at
from tissue.blade.edge_anchors import ANCHORED, FREE, new_anchors
from tissue.blade.edge_search import anchor_beside, is_behind_edge, is_in_slit
from tissue.blade.return_mapping import set_anchor
from tissue.core.vec3 import Vec3
from tissue.cutting.blade_path import new_path
from tissue.mesh.point_location import tetrahedron_at
from tissue.mesh.star import no_visits
from tissue.mesh.tetrahedron_grid import build_grid

EDGE = 0.04
REACH = 1e-3
UP, AHEAD, ACROSS = Vec3(0.0, 0.0, 1.0), Vec3(0.0, 1.0, 0.0), Vec3(1.0, 0.0, 0.0)


@pytest.fixture(scope="module")
def slit_body():
    """Return a cube with a slit at x = 20 mm, from y = 0 to 20 mm and from z = 20 mm to the top."""
    tissue = Tissue(block((4, 4, 4), (EDGE,) * 3), gravity=(0.0, 0.0, 0.0))
    y = np.linspace(-0.01, 0.02, 31)
    edges = [[[0.02, at, 0.02], [0.02, at, 0.05]] for at in y]
    area = tissue.incise(edges, (0.0, 1.0, 0.0))
    assert area == pytest.approx(4e-4)
    return tissue._body


def in_slit(body, x, y, z, along=UP, forward=AHEAD) -> bool:
    p = Vec3(x, y, z)
    t = tetrahedron_at(body, build_grid(body, body.rest, 0.0), body.rest, p)
    assert 0 <= t < body.n_tetrahedra
    return is_in_slit(body, t, p, along, forward, REACH)


@pytest.mark.parametrize(
    ("place", "forward", "is_in"),
    [
        ((0.0195, 0.011, 0.033), AHEAD, True),
        ((0.0205, 0.011, 0.033), AHEAD, True),
        ((0.025, 0.011, 0.033), AHEAD, False),
        ((0.0201, 0.0207, 0.033), AHEAD, False),
        ((0.0201, 0.011, 0.0193), AHEAD, False),
        ((0.0195, 0.011, 0.033), ACROSS, False),
    ],
    ids=["left", "right", "reaches beside", "ahead of the rim", "below the bottom", "across"],
)
def test_a_blade_along_a_cut_face_is_in_the_slit(slit_body, place, forward, is_in):
    assert in_slit(slit_body, *place, forward=forward) == is_in


@pytest.mark.parametrize("x", [0.0195, 0.0205])
def test_samples_beside_an_anchored_one_that_are_in_the_slit_stay_free(slit_body, x):
    """The edge goes down along the slit; one sample holds the tissue below the slit's bottom."""
    n, length = 11, 0.02
    tip, heel = Vec3(x, 0.011, 0.013), Vec3(x, 0.011, 0.033)
    blade = line_blade(new_anchors(n, length, 1e3)).replaced(reach=EDGE)
    visits = no_visits(len(slit_body.positions), len(slit_body.tetrahedra))
    grid = build_grid(slit_body, slit_body.rest, 0.0)
    set_anchor(
        blade.anchors, slit_body, 0, tetrahedron_at(slit_body, grid, slit_body.rest, tip), tip
    )
    pose = pose_at(Edge(tip, heel, AHEAD, tip, heel, AHEAD), 1.0)
    anchor_beside(blade, slit_body, visits, pose, REACH)
    height = tip.z + np.linspace(0.0, length, n)
    assert (blade.anchors.state[height < 0.0195] == ANCHORED).all()
    assert (blade.anchors.state[height > 0.0205] == FREE).all()


@pytest.mark.parametrize("is_whole", [True, False])
def test_samples_beside_one_that_has_not_broken_the_skin_have_it_to_break_too(is_whole):
    body = Tissue(block((2, 2, 2), (EDGE,) * 3), gravity=(0.0, 0.0, 0.0))._body
    tip, heel = Vec3(0.019, 0.0, 0.011), Vec3(0.019, 0.0, 0.031)
    blade = line_blade(new_anchors(11, 0.02, 1e3)).replaced(reach=EDGE)
    visits = no_visits(len(body.positions), len(body.tetrahedra))
    grid = build_grid(body, body.rest, 0.0)
    set_anchor(blade.anchors, body, 0, tetrahedron_at(body, grid, body.rest, tip), tip)
    blade.anchors.at_skin[0] = is_whole
    anchor_beside(
        blade, body, visits, pose_at(Edge(tip, heel, AHEAD, tip, heel, AHEAD), 1.0), REACH
    )
    assert (blade.anchors.state == ANCHORED).all()
    assert (blade.anchors.at_skin == is_whole).all()


def test_a_body_without_a_cut_has_no_slit():
    body = Tissue(block((2, 2, 2), (EDGE,) * 3), gravity=(0.0, 0.0, 0.0))._body
    assert not in_slit(body, 0.019, 0.011, 0.033)


@pytest.mark.kernel
@pytest.mark.parametrize(
    ("point", "expected"),
    [
        ((0.0, -0.5, 0.5), True),
        ((0.0, 0.5, 0.5), False),
        ((0.0, -0.5, -0.5), False),
        ((0.0, -0.5, 1.5), False),
        ((0.3, -0.5, 0.5), True),
    ],
    ids=["behind", "ahead", "below the tip", "above the heel", "behind, aside"],
)
def test_a_point_is_behind_the_edge_between_tip_and_heel_only(point, expected):
    path = new_path(3)
    path.t1[:] = [[0.0, 0.0, z] for z in (0.0, 0.5, 1.0)]
    path.forward[:] = [0.0, 1.0, 0.0]
    path.linked[:2] = True
    assert is_behind_edge(path, Vec3(*point)) == expected
