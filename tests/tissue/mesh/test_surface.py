"""The surface of the body and its pieces, before and after a cut."""

import numpy as np
import pytest

from tests.support import bodies, naive, soundness, strokes
from tissue import Tissue, block
from tissue.mesh.body import CUT, build_body
from tissue.mesh.pieces import label_pieces
from tissue.mesh.star import LARGEST_STAR, edge_star, mean_node_size, no_visits, node_size, star
from tissue.mesh.surface import boundary_surface

CUBE = block((2, 2, 2), (0.04, 0.04, 0.04))


def enclosed_volume(surface):
    """Return the volume that the triangles enclose at rest, if they face outwards [m3]."""
    a, b, c = (surface.rest_positions[surface.triangles[:, k]] for k in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c))) / 6.0


@pytest.mark.kernel
def test_the_surface_of_a_cube_is_its_six_sides_facing_outwards():
    surface = boundary_surface(build_body(CUBE, None, None))
    assert len(surface.triangles) == 6 * 4 * 2
    assert len(surface.positions) == 26  # all nodes except the one in the middle
    assert enclosed_volume(surface) == pytest.approx(0.04**3)
    assert soundness.is_closed(surface.triangles)
    assert not surface.is_cut.any()


@pytest.mark.kernel
def test_pieces_are_connected_by_faces_that_are_not_cut():
    body = build_body(bodies.two_tetrahedra(), None, None)
    piece, queue = np.zeros((2, 2), dtype=np.int64)
    assert label_pieces(body, piece, queue) == 1
    body.links[0, 0] = body.links[1, 0] = CUT
    assert label_pieces(body, piece, queue) == 2
    assert piece.tolist() == [0, 1]


@pytest.mark.parametrize("stroke", strokes.THROUGH)
def test_the_faces_of_a_cut_are_on_the_surface_twice(stroke):
    mesh = bodies.jittered(3, 0)
    tissue = Tissue(mesh, fixed=bodies.sides(mesh))
    last = strokes.make(tissue, strokes.THROUGH[stroke](mesh))[-1]
    surface = tissue.surface()
    cut = surface.triangles[surface.is_cut]
    area = soundness.triangle_areas(surface.rest_positions, cut).sum()
    assert area == pytest.approx(2.0 * last.cut_area, rel=1e-9)
    skin = soundness.triangle_areas(surface.rest_positions, surface.triangles[~surface.is_cut])
    assert skin.sum() == pytest.approx(6 * 0.04**2, rel=1e-9)
    assert enclosed_volume(surface) == pytest.approx(0.04**3, rel=1e-9)
    assert soundness.is_closed(surface.triangles)


MESHES = {"grid": block((2, 2, 2), (1.0, 1.0, 1.0)), "jittered": bodies.jittered(3, 4, size=1.0)}


@pytest.fixture(params=MESHES)
def mesh(request):
    return MESHES[request.param]


@pytest.fixture
def around(mesh):
    """Return the body, its visit marks and the scratch array of a search."""
    visits = no_visits(len(mesh.positions), len(mesh.tetrahedra))
    return build_body(mesh, None, None), visits, np.zeros(LARGEST_STAR, dtype=np.int64)


@pytest.mark.kernel
def test_the_star_of_a_node_is_every_tetrahedron_with_that_node(mesh, around):
    body, visits, out = around
    for node in range(len(mesh.positions)):
        n = star(body, visits, node, body.node_tetrahedron[node], out)
        assert len(set(out[:n])) == n
        assert set(out[:n].tolist()) == naive.star(mesh.tetrahedra, node)


@pytest.mark.kernel
def test_the_star_of_an_edge_is_every_tetrahedron_with_both_ends(mesh, around):
    body, visits, out = around
    for a, b in mesh.tetrahedra[:, :2]:
        n = edge_star(body, visits, a, b, out)
        both = naive.star(mesh.tetrahedra, a) & naive.star(mesh.tetrahedra, b)
        assert set(out[:n].tolist()) == both


@pytest.mark.kernel
def test_node_size_is_the_smallest_altitude_around(mesh, around):
    body, visits, out = around
    n_nodes = len(mesh.positions)
    sizes = [naive.node_size(mesh.positions, mesh.tetrahedra, node) for node in range(n_nodes)]
    assert [node_size(body, visits, k, out) for k in range(n_nodes)] == pytest.approx(sizes)
    assert mean_node_size(body, visits, out) == pytest.approx(np.mean(sizes))
