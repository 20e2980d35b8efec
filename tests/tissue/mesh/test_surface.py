"""The surface of the body and its pieces, before and after a cut."""

import numpy as np
import pytest

from tests.support import bodies, soundness, strokes
from tissue import Tissue, block
from tissue.mesh.body import CUT, build_body
from tissue.mesh.pieces import label_pieces
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
def test_the_surface_of_a_single_tetrahedron_is_its_four_faces():
    surface = boundary_surface(build_body(bodies.unit_tetrahedron(), None, None))
    assert enclosed_volume(surface) == pytest.approx(1 / 6)


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


def test_every_vertex_of_the_surface_is_used():
    mesh = bodies.jittered(3, 0)
    tissue = Tissue(mesh, fixed=bodies.sides(mesh))
    strokes.make(tissue, strokes.curved(mesh))
    surface = tissue.surface()
    np.testing.assert_array_equal(np.unique(surface.triangles), np.arange(len(surface.positions)))
    assert len(surface.rest_positions) == len(surface.positions)
