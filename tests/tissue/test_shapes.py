import numpy as np
import pytest

from tissue.faces import boundary_faces, sorted_faces
from tissue.shapes import grid


def signed_volumes(mesh):
    a, b, c, d = (mesh.positions[mesh.tetrahedra[:, k]] for k in range(4))
    return np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a) / 6.0


def test_the_default_grid_is_the_block_of_figure_10():
    mesh = grid()
    assert mesh.positions.shape == (5 * 7 * 5, 3)
    assert mesh.tetrahedra.shape == (576, 4)
    assert np.array_equal(mesh.positions.min(axis=0), [0.0, 0.0, 0.0])
    assert np.array_equal(mesh.positions.max(axis=0), [0.04, 0.06, 0.04])


@pytest.mark.parametrize("cells", [(1, 1, 1), (1, 2, 5), (4, 6, 4)])
def test_the_six_tetrahedra_of_a_cell_are_equal_in_volume_and_turn_left(cells):
    volumes = signed_volumes(grid(cells, (0.1, 0.2, 0.3)))
    assert volumes == pytest.approx(0.1 * 0.2 * 0.3 / (6 * np.prod(cells)), rel=1e-12)


def test_the_six_tetrahedra_of_a_cell_share_its_main_diagonal():
    mesh = grid((1, 1, 1), (1.0, 1.0, 1.0))
    for corner in ([0, 0, 0], [1, 1, 1]):
        node = np.flatnonzero((mesh.positions == corner).all(axis=1))
        assert (mesh.tetrahedra == node).any(axis=1).all()


@pytest.mark.parametrize("cells", [(1, 1, 1), (3, 1, 2), (2, 3, 4)])
def test_neighbouring_cells_agree_on_the_diagonal_of_their_face(cells):
    n_x, n_y, n_z = cells
    tetrahedra = grid(cells).tetrahedra
    assert sorted_faces(tetrahedra).counts.max() <= 2
    assert len(boundary_faces(tetrahedra)) == 4 * (n_x * n_y + n_y * n_z + n_z * n_x)


def test_the_boundary_faces_of_a_grid_turn_left_seen_from_outside():
    mesh = grid((2, 3, 1))
    a, b, c = (mesh.positions[boundary_faces(mesh.tetrahedra)[:, k]] for k in range(3))
    enclosed = np.einsum("ij,ij->i", np.cross(a, b), c).sum() / 6.0
    assert enclosed == pytest.approx(signed_volumes(mesh).sum(), rel=1e-12)


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
def test_a_grid_that_cannot_be_is_refused_by_name(arguments, message):
    with pytest.raises(ValueError, match=message):
        grid(**arguments)
