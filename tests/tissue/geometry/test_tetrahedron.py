"""Measures of tetrahedra, bounding boxes, and rotations told from matrices that are none."""

import itertools

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.support import naive
from tissue import are_rotations, checked_rotation
from tissue.core.vec3 import Vec3, norm, vec3
from tissue.geometry.aabb import (
    Aabb,
    box_at,
    empty_box,
    overlap,
    overlap_within,
    store_box,
    widened,
    with_point,
)
from tissue.geometry.polar_decomposition import IDENTITY, apply_transposed, nearest_rotation
from tissue.geometry.tetrahedron import (
    Matrix3,
    altitude,
    apply,
    barycentric,
    edge_matrix,
    interpolate,
    normalised,
    signed_volume,
    smallest_altitude,
    solve,
)

pytestmark = pytest.mark.kernel

ORIGIN, X, Y, Z = Vec3(0.0, 0.0, 0.0), Vec3(1.0, 0.0, 0.0), Vec3(0.0, 1.0, 0.0), Vec3(0.0, 0.0, 1.0)
ONE = np.array([[0, 1, 2, 3]])


def random_corners(seed):
    return np.random.default_rng(seed).normal(size=(4, 3))


@pytest.mark.parametrize("seed", range(5))
def test_volume_is_a_sixth_of_the_determinant(seed):
    corners = random_corners(seed)
    by_kernel = signed_volume(*(vec3(corners, k) for k in range(4)))
    assert by_kernel == pytest.approx(naive.volume(corners))


def test_altitude_is_the_distance_from_the_plane():
    assert altitude(Vec3(5.0, 7.0, -2.0), ORIGIN, X, Y) == pytest.approx(2.0)


def test_altitude_over_a_line_is_zero():
    assert altitude(Z, ORIGIN, X, Vec3(2.0, 0.0, 0.0)) == 0.0


def test_the_smallest_altitude_is_the_least_of_four():
    assert smallest_altitude(ORIGIN, X, Y, Z) == pytest.approx(1 / np.sqrt(3))


def test_weights_in_a_flat_tetrahedron_are_equal_shares():
    assert barycentric(Z, ORIGIN, X, Y, Vec3(1.0, 1.0, 0.0)) == (0.25,) * 4


@pytest.mark.parametrize("seed", range(5))
def test_weights_add_up_to_one_and_reproduce_the_point(seed):
    corners = random_corners(seed)
    p = Vec3(0.3, -0.2, 0.9)
    w = barycentric(p, *(vec3(corners, k) for k in range(4)))
    assert sum(w) == pytest.approx(1.0)
    assert interpolate(w, corners, ONE, 0) == pytest.approx(p)


@pytest.mark.parametrize("seed", range(5))
def test_solve_undoes_apply(seed):
    m = edge_matrix(random_corners(seed), ONE, 0)
    y = Vec3(1.0, -2.0, 0.5)
    assert solve(m, apply(m, y)) == pytest.approx(y)


def test_a_unit_vector_has_length_one_and_zero_stays_zero():
    assert norm(normalised(Vec3(3.0, 4.0, 12.0))) == pytest.approx(1.0)
    assert normalised(ORIGIN) == ORIGIN


UNIT = Aabb(Vec3(0.0, 0.0, 0.0), Vec3(1.0, 1.0, 1.0))


def moved(box, x, y, z):
    d = Vec3(x, y, z)
    return Aabb(
        *(Vec3(*(p + q for p, q in zip(corner, d, strict=True))) for corner in (box.low, box.high))
    )


def test_a_box_of_points_is_the_smallest_that_contains_them():
    points = np.random.default_rng(0).normal(size=(20, 3))
    box = empty_box()
    for row in points.tolist():
        box = with_point(box, Vec3(*row))
    assert box.low == tuple(points.min(axis=0)) and box.high == tuple(points.max(axis=0))


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_boxes_overlap_until_their_sides_separate(axis, sign):
    for distance, overlaps in ((0.5, True), (1.0, True), (1.001, False)):
        d = [0.2, -0.3, 0.1]
        d[axis] = sign * distance
        other = moved(UNIT, *d)
        assert overlap(UNIT, other) == overlap(other, UNIT) == overlaps


def test_boxes_that_share_a_corner_or_are_nested_overlap():
    for signs in itertools.product((-1.0, 1.0), repeat=3):
        assert overlap(UNIT, moved(UNIT, *signs))
    assert overlap(UNIT, Aabb(Vec3(0.4, 0.4, 0.4), Vec3(0.5, 0.5, 0.5)))


def test_overlap_within_a_margin_is_overlap_with_a_widened_box():
    for distance, overlaps in ((1.2, True), (1.3, False)):
        other = moved(UNIT, 0.0, distance, 0.0)
        assert overlap_within(UNIT, other, 0.25) == overlaps
        assert overlap(UNIT, widened(other, 0.25)) == overlaps


def test_an_empty_box_overlaps_nothing():
    assert not overlap(empty_box(), UNIT)
    assert not overlap(UNIT, widened(empty_box(), 1.0))


def test_a_box_is_stored_in_rows_of_two_arrays():
    low, high = np.zeros((2, 3)), np.zeros((2, 3))
    store_box(low, high, 1, UNIT)
    assert box_at(low, high, 1) == UNIT
    assert not low.any() and not high[0].any()


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
