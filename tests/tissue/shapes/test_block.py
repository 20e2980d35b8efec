"""Blocks of cells and of a lattice, cylinders, and the organ."""

import numpy as np
import pytest

from tests.tissue.geometry_of_meshes import dihedral_angles
from tissue import block, cylinder, lattice_block, liver_lobe
from tissue.mesh.faces import boundary_faces, sorted_faces
from tissue.mesh.validation import checked, quality, signed_volumes
from tissue.shapes.liver_lobe import make_mesh


def test_the_default_grid_is_the_block_of_figure_10():
    mesh = block()
    assert mesh.positions.shape == (5 * 7 * 5, 3)
    assert mesh.tetrahedra.shape == (576, 4)
    assert np.array_equal(mesh.positions.min(axis=0), [0.0, 0.0, 0.0])
    assert np.array_equal(mesh.positions.max(axis=0), [0.04, 0.06, 0.04])


@pytest.mark.parametrize("cells", [(1, 1, 1), (1, 2, 5), (4, 6, 4)])
def test_the_six_tetrahedra_of_a_cell_have_equal_positive_volumes(cells):
    volumes = signed_volumes(*block(cells, (0.1, 0.2, 0.3))[:2])
    assert volumes == pytest.approx(0.1 * 0.2 * 0.3 / (6 * np.prod(cells)), rel=1e-12)


@pytest.mark.parametrize("cells", [(1, 1, 1), (3, 1, 2), (2, 3, 4)])
def test_neighbouring_cells_agree_on_the_diagonal_of_their_face(cells):
    n_x, n_y, n_z = cells
    tetrahedra = block(cells).tetrahedra
    assert sorted_faces(tetrahedra).counts.max() <= 2
    assert len(boundary_faces(tetrahedra)) == 4 * (n_x * n_y + n_y * n_z + n_z * n_x)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (dict(cells=(0, 1, 1)), "at least 1"),
        (dict(cells=(1, 1)), "three whole numbers"),
        (dict(cells=(1.5, 1, 1)), "three whole numbers"),
        (dict(cells=(10**6, 10**6, 1)), "at most"),
        (dict(size=(0.1, 0.0, 0.1)), "finite and positive"),
        (dict(size=(0.1, float("nan"), 0.1)), "finite and positive"),
        (dict(size=0.1), "three lengths"),
    ],
)
def test_an_impossible_grid_is_refused_with_the_reason(arguments, message):
    with pytest.raises(ValueError, match=message):
        block(**arguments)


def test_the_shipped_organ_is_the_one_that_the_code_makes():
    shipped, made = liver_lobe(), make_mesh()
    assert np.array_equal(shipped.tetrahedra, made.tetrahedra)
    assert np.allclose(shipped.positions, made.positions, rtol=0.0, atol=1e-12)


def test_the_organ_has_the_size_of_a_liver_lobe_and_is_at_the_origin():
    mesh = liver_lobe()
    assert 4500 <= len(mesh.tetrahedra) <= 5500
    assert mesh.positions.min(axis=0) == pytest.approx([0.0, 0.0, 0.0], abs=1e-12)
    assert mesh.positions.max(axis=0) == pytest.approx([0.090, 0.060, 0.033], abs=1.5e-3)


def test_an_organ_of_a_finer_spacing_has_the_same_shape():
    mesh, finer = liver_lobe(), liver_lobe(0.75)
    assert 2.0 < len(finer.tetrahedra) / len(mesh.tetrahedra) < 2.6
    volumes = [signed_volumes(*each[:2]).sum() for each in (mesh, finer)]
    assert volumes[1] == pytest.approx(volumes[0], rel=0.01)


def test_the_organ_is_one_sound_piece_with_good_angles():
    mesh = liver_lobe()
    assert checked(mesh).warnings == ()
    angles = dihedral_angles(mesh)
    assert angles.min() >= 10.0
    assert angles.max() <= 165.0


def test_the_surface_of_the_organ_is_a_closed_sphere():
    triangles = boundary_faces(liver_lobe().tetrahedra)
    edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    distinct, counts = np.unique(edges, axis=0, return_counts=True)
    assert (counts == 2).all()
    assert len(np.unique(triangles)) - len(distinct) + len(triangles) == 2


CELLS = [(1, 1, 1), (1, 2, 5), (3, 1, 2), (2, 3, 4)]


@pytest.mark.parametrize("cells", CELLS)
def test_a_lattice_block_fills_its_box_with_sound_tetrahedra(cells):
    size = (0.1, 0.2, 0.3)
    mesh = lattice_block(cells, size)
    checked(mesh)
    assert signed_volumes(*mesh[:2]).min() > 0.0
    assert signed_volumes(*mesh[:2]).sum() == pytest.approx(np.prod(size), rel=1e-12)
    assert np.array_equal(mesh.positions.min(axis=0), [0.0, 0.0, 0.0])
    assert np.array_equal(mesh.positions.max(axis=0), size)


@pytest.mark.parametrize("cells", CELLS)
def test_cells_of_a_lattice_block_agree_on_their_faces(cells):
    n_x, n_y, n_z = cells
    tetrahedra = lattice_block(cells).tetrahedra
    squares = 2 * (n_x * n_y + n_y * n_z + n_z * n_x)
    assert sorted_faces(tetrahedra).counts.max() == 2
    assert len(boundary_faces(tetrahedra)) == 2 * squares
    assert len(tetrahedra) == 12 * n_x * n_y * n_z  # six sides with two, or half of four


def test_angles_of_a_lattice_are_60_and_90_degrees_inside_and_45_to_120_at_the_surface():
    mesh = lattice_block((3, 3, 3), (1.0, 1.0, 1.0))
    angles = dihedral_angles(mesh)
    assert angles.min() == pytest.approx(45.0) and angles.max() == pytest.approx(120.0)
    is_inside = (mesh.tetrahedra >= 4**3).sum(axis=1) == 2  # between the centres of two cells
    inside = np.unique(np.round(angles[:, is_inside], 9))
    assert inside == pytest.approx([60.0, 90.0])


@pytest.mark.parametrize("axis", range(3))
def test_a_lattice_block_has_no_preferred_direction(axis):
    """Diagonals of the surface lie both ways on each side."""
    mesh = lattice_block((2, 2, 2), (1.0, 1.0, 1.0))
    faces = mesh.positions[boundary_faces(mesh.tetrahedra)]
    on_side = faces[(faces[:, :, axis] == 1.0).all(axis=1)]
    edges = np.delete(np.roll(on_side, 1, axis=1) - on_side, axis, axis=2)
    ways, counts = np.unique(np.sign(edges.prod(axis=2)), return_counts=True)
    assert ways.tolist() == [-1.0, 0.0, 1.0] and counts.tolist() == [4, 16, 4]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (dict(cells=(0, 1, 1)), "at least 1"),
        (dict(cells=(10**6, 10, 1)), "at most"),
        (dict(size=(0.1, 0.0, 0.1)), "finite and positive"),
    ],
)
def test_an_impossible_lattice_is_refused_with_the_reason(arguments, message):
    with pytest.raises(ValueError, match=message):
        lattice_block(**arguments)


@pytest.mark.parametrize("cells", [(1, 1), (2, 3), (5, 8), (8, 4)])
def test_its_volume_is_that_of_the_circle_times_the_height(cells):
    mesh = cylinder(cells, 0.015, 0.04)
    volumes = signed_volumes(*mesh[:2])
    assert volumes.min() > 0.0
    assert volumes.sum() == pytest.approx(np.pi * 0.015**2 * 0.04, rel=1e-12)
    assert len(mesh.tetrahedra) == 3 * 6 * cells[0] ** 2 * cells[1]


@pytest.mark.parametrize("cells", [(1, 1), (2, 3), (4, 6)])
def test_neighbours_in_a_cylinder_agree_on_every_face(cells):
    mesh, (rings, layers) = cylinder(cells, 0.015, 0.04), cells
    outer = 12 * rings**2 + 12 * rings * layers  # both ends, and two for each side of a prism
    assert len(boundary_faces(mesh.tetrahedra)) == outer
    assert sorted_faces(mesh.tetrahedra).counts.max() == 2
    assert len(checked(mesh).mesh.positions) == len(mesh.positions)


def test_its_elements_have_no_bad_shape():
    mesh = cylinder((5, 17), 0.015, 0.05)
    assert quality(*mesh[:2]).min() > 0.3


def test_the_ends_are_flat_and_the_side_is_on_a_circle():
    mesh = cylinder((3, 4), 0.01, 0.02)
    x = mesh.positions
    assert set(np.round(x[:, 2], 9)) == {0.0, 0.005, 0.01, 0.015, 0.02}
    radius = np.hypot(x[:, 0], x[:, 1])
    outer = np.sort(radius)[-5 * 18 :]
    np.testing.assert_allclose(outer, outer[0], rtol=1e-12)
    assert outer[0] == pytest.approx(0.01, rel=0.011)  # a little more: the area is exact


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        ({"cells": (0, 4)}, "whole numbers of at least 1"),
        ({"cells": (2.5, 4)}, "whole numbers of at least 1"),
        ({"cells": (2, 4, 4)}, "whole numbers of at least 1"),
        ({"cells": (10_000, 10_000)}, "prisms; take fewer"),
        ({"radius": 0.0}, "radius is 0.0 m"),
        ({"height": float("nan")}, "height is nan m"),
    ],
)
def test_measures_that_make_no_body_are_refused(arguments, expected):
    with pytest.raises(ValueError, match=expected):
        cylinder(**arguments)
