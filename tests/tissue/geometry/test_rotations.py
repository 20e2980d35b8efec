"""Rotations are told from matrices that are none."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tissue import are_rotations, checked_rotation
from tissue.core.vec3 import Vec3
from tissue.geometry.polar_decomposition import IDENTITY, apply_transposed, nearest_rotation
from tissue.geometry.tetrahedron import Matrix3

pytestmark = pytest.mark.kernel

TURNED = Rotation.from_rotvec([0.3, -0.7, 1.1]).as_matrix()


def test_rotations_pass_as_copies_in_any_type():
    single = TURNED.astype(np.float32)
    for given in (TURNED, single, TURNED.tolist(), np.asfortranarray(TURNED)):
        found = checked_rotation(given, "it")
        assert found is not given and found.dtype == np.float64
        np.testing.assert_allclose(found, TURNED, atol=1e-6)


@pytest.mark.parametrize(
    ("matrix", "why"),
    [
        (-TURNED, "a reflection"),
        (TURNED[:, [1, 0, 2]], "a reflection"),
        (1.001 * TURNED, "not orthonormal"),
        (np.full((3, 3), 1e200), "not orthonormal"),
        (np.zeros((3, 3)), "not orthonormal"),
        (np.where(np.eye(3) > 0.0, np.nan, 0.0), "not finite"),
        (np.eye(4), r"shape \(4, 4\)"),
    ],
)
def test_what_is_no_rotation_is_refused_by_its_fault(matrix, why):
    with pytest.raises(ValueError, match=f"the jaw.*{why}"):
        checked_rotation(matrix, "the jaw")


def test_of_many_each_is_told_by_itself():
    many = np.stack([TURNED, -TURNED, 2.0 * TURNED, np.full((3, 3), np.nan), np.eye(3)])
    assert are_rotations(many).tolist() == [True, False, False, False, True]


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
