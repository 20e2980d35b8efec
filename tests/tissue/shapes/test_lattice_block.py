import numpy as np
import pytest

from tests.tissue.geometry_of_meshes import dihedral_angles
from tissue import boundary_faces, lattice_block
from tissue.mesh.faces import sorted_faces
from tissue.mesh.validation import checked, signed_volumes

CELLS = [(1, 1, 1), (1, 2, 5), (3, 1, 2), (2, 3, 4)]


@pytest.mark.parametrize("cells", CELLS)
def test_a_lattice_block_fills_its_box_with_sound_tetrahedra(cells):
    size = (0.1, 0.2, 0.3)
    mesh = lattice_block(cells, size)
    checked(mesh)
    assert signed_volumes(*mesh).min() > 0.0
    assert signed_volumes(*mesh).sum() == pytest.approx(np.prod(size), rel=1e-12)
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


def test_a_node_is_in_the_middle_of_each_cell():
    mesh = lattice_block((2, 1, 1), (2.0, 1.0, 1.0))
    assert mesh.positions[-2:].tolist() == [[0.5, 0.5, 0.5], [1.5, 0.5, 0.5]]


def test_angles_of_a_lattice_are_60_and_90_degrees_inside_and_45_to_120_at_the_surface():
    mesh = lattice_block((3, 3, 3), (1.0, 1.0, 1.0))
    angles = dihedral_angles(mesh)
    assert angles.min() == pytest.approx(45.0) and angles.max() == pytest.approx(120.0)
    is_inside = (mesh.tetrahedra >= 4**3).sum(axis=1) == 2  # between the centres of two cells
    inside = np.unique(np.round(angles[:, is_inside], 9))
    assert inside == pytest.approx([60.0, 90.0])


def test_a_lattice_block_has_no_preferred_direction():
    """Diagonals of the surface lie both ways on each side."""
    mesh = lattice_block((2, 2, 2), (1.0, 1.0, 1.0))
    for axis in range(3):
        faces = mesh.positions[boundary_faces(mesh.tetrahedra)]
        on_side = faces[(faces[:, :, axis] == 1.0).all(axis=1)]
        edges = np.roll(on_side, 1, axis=1) - on_side
        others = np.delete(edges, axis, axis=2).prod(axis=2)
        assert np.unique(np.sign(others), return_counts=True)[1].tolist() == [4, 16, 4]


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
