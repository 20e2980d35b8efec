"""Measures of tetrahedra, on the corner of a cube and on random ones."""

import numpy as np
import pytest

from tests.support import naive
from tissue.core.vec3 import Vec3, cross, dot, lerp, norm, sub, vec3
from tissue.geometry.tetrahedron import (
    altitude,
    apply,
    barycentric,
    determinant,
    edge_matrix,
    interpolate,
    normalised,
    signed_volume,
    smallest_altitude,
    solve,
    triangle_area,
)

pytestmark = pytest.mark.kernel

ORIGIN, X, Y, Z = Vec3(0.0, 0.0, 0.0), Vec3(1.0, 0.0, 0.0), Vec3(0.0, 1.0, 0.0), Vec3(0.0, 0.0, 1.0)
ONE = np.array([[0, 1, 2, 3]])


def random_corners(seed):
    return np.random.default_rng(seed).normal(size=(4, 3))


def test_the_corner_of_a_cube_is_a_sixth_of_it():
    assert signed_volume(ORIGIN, X, Y, Z) == pytest.approx(1 / 6)
    assert signed_volume(ORIGIN, Y, X, Z) == pytest.approx(-1 / 6)


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


def test_area_of_half_a_square():
    assert triangle_area(ORIGIN, X, Y) == pytest.approx(0.5)


def test_weights_of_a_corner_are_one_and_zeros():
    assert barycentric(Y, ORIGIN, X, Y, Z) == pytest.approx((0.0, 0.0, 1.0, 0.0))


def test_a_weight_is_negative_beyond_the_opposite_face():
    assert barycentric(Vec3(-0.1, 0.2, 0.2), ORIGIN, X, Y, Z).b < 0.0


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


@pytest.mark.parametrize("seed", range(3))
def test_the_determinant_of_the_edges_is_six_volumes(seed):
    corners = random_corners(seed)
    m = edge_matrix(corners, ONE, 0)
    assert determinant(m) == pytest.approx(6.0 * naive.volume(corners))


def test_a_unit_vector_has_length_one_and_zero_stays_zero():
    assert norm(normalised(Vec3(3.0, 4.0, 12.0))) == pytest.approx(1.0)
    assert normalised(ORIGIN) == ORIGIN


def test_vector_operations_are_right_handed():
    assert cross(X, Y) == Z
    assert dot(X, Y) == 0.0
    assert norm(sub(X, Y)) == pytest.approx(np.sqrt(2.0))
    assert lerp(0.25, ORIGIN, Vec3(4.0, 0.0, -8.0)) == (1.0, 0.0, -2.0)
