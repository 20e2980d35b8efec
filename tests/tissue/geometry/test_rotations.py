"""Rotations are told from matrices that are none."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tissue import are_rotations, checked_rotation

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
