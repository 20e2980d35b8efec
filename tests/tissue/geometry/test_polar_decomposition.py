"""The polar decomposition: the rotation in a deformation."""

import numpy as np
import pytest

from tissue.core.vec3 import Vec3
from tissue.geometry.rotations import IDENTITY, apply_transposed, nearest_rotation
from tissue.geometry.tetrahedron import Matrix3

pytestmark = pytest.mark.kernel


def turn_and_stretch():
    """Return a random rotation, and a deformation that stretches before it rotates."""
    turn, _ = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))
    turn *= np.linalg.det(turn)
    return turn, turn @ np.diag([1.3, 0.8, 1.1])


def columns(matrix):
    return Matrix3(*(Vec3(*column) for column in matrix.T.tolist()))


def test_the_rotation_after_a_stretch_is_found():
    turn, stretched = turn_and_stretch()
    np.testing.assert_allclose(np.transpose(nearest_rotation(columns(stretched))), turn, atol=1e-9)


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
def test_a_common_factor_does_not_change_the_rotation(scale):
    turn, stretched = turn_and_stretch()
    found = nearest_rotation(columns(scale * stretched))
    np.testing.assert_allclose(np.transpose(found), turn, atol=1e-9)


@pytest.mark.parametrize("diagonal", [[0.0, 0.0, 0.0], [1.0, 1.0, 0.0], [1.0, 1.0, -1.0]])
def test_a_matrix_near_no_rotation_gives_the_identity(diagonal):
    assert nearest_rotation(columns(np.diag(diagonal))) == IDENTITY


def test_the_transpose_of_a_rotation_undoes_it():
    turn, _ = turn_and_stretch()
    v = np.array([0.3, -1.0, 2.0])
    back = apply_transposed(columns(turn), Vec3(*(turn @ v).tolist()))
    np.testing.assert_allclose(back, v, atol=1e-14)
