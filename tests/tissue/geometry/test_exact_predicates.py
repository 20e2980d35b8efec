"""Orientation and piercing tests: exact, with ties resolved consistently at shared edges."""

import itertools

import numpy as np
import pytest

from tests.support import naive
from tissue.core.vec3 import Vec3
from tissue.geometry.exact_predicates import (
    LATTICE_LIMIT,
    LATTICE_POINTS,
    LatticePoint,
    lattice_around,
    nearest,
    orient3d,
    pierces,
)

pytestmark = pytest.mark.kernel


def points(random, n, reach=LATTICE_POINTS // 2):
    """Return `n` random lattice points."""
    return [LatticePoint(*row) for row in random.integers(-reach, reach, (n, 3)).tolist()]


def adversarial(random: np.random.Generator) -> list[LatticePoint]:
    """Return four points that are coplanar, collinear or coincident, exactly or almost."""
    reach = LATTICE_LIMIT // 8
    a, u, v = random.integers(-reach, reach + 1, (3, 3))
    if random.random() < 0.5:  # a thin or short triangle
        u, v = u // 10 ** int(random.integers(0, 5)), u // int(random.integers(1, 9)) + v % 3
    i, j = random.integers(-3, 4, 2)
    off = random.integers(-1, 2, 3) * (random.random() < 0.7)
    four = [a, a + u, a + v, a + i * u + j * v + off]
    return [LatticePoint(*p.clip(-LATTICE_LIMIT, LATTICE_LIMIT).tolist()) for p in four]


def test_orientation_is_exact_in_10000_adversarial_cases():
    random = np.random.default_rng(7)
    zero = 0
    for _ in range(10_000):
        four = adversarial(random)
        expected = naive.determinant(*four)
        zero += expected == 0
        assert orient3d(*four) == expected
    assert 1_000 < zero < 9_000


def test_no_points_of_the_lattice_overflow():
    ends = (-LATTICE_LIMIT, LATTICE_LIMIT)
    corners = [LatticePoint(*corner) for corner in itertools.product(ends, repeat=3)]
    for four in itertools.permutations(corners, 4):
        assert orient3d(*four) == naive.determinant(*four)


def test_piercing_agrees_with_exact_fractions():
    random = np.random.default_rng(2)
    n_pierced = 0
    for _ in range(1000):
        a, b, p, q, r = points(random, 5)
        ends = naive.determinant(p, q, r, a), naive.determinant(p, q, r, b)
        weights = naive.pierced_at(a, b, p, q, r)
        expected = ends[0] * ends[1] < 0 and weights is not None and min(weights) > 0
        assert pierces(a, b, p, q, r) == expected
        n_pierced += expected
    assert n_pierced > 20


def test_cyclic_order_of_a_triangle_does_not_matter_even_for_ties():
    small = [LatticePoint(*p) for p in itertools.product(range(2), repeat=3)]
    for a, b, p, q, r in itertools.permutations(small, 5):
        assert pierces(a, b, p, q, r) == pierces(a, b, q, r, p) == pierces(a, b, r, p, q)


def test_exactly_one_of_two_triangles_is_pierced_through_their_common_edge():
    random = np.random.default_rng(4)
    n = 0
    while n < 10_000:
        p, step, direction, r, s = random.integers(-1000, 1001, (5, 3))
        q, middle = p + 7 * step, p + random.integers(1, 7) * step
        a, b = middle - 2 * direction, middle + 3 * direction
        if naive.determinant(a, b, p, r) * naive.determinant(a, b, p, s) >= 0:
            continue  # a fold: the segment touches or misses it
        a, b, p, q, r, s = (LatticePoint(*x.tolist()) for x in (a, b, p, q, r, s))
        assert naive.determinant(a, b, p, q) == 0
        assert pierces(a, b, p, q, r) != pierces(a, b, q, p, s)
        n += 1


def test_exactly_one_of_two_joined_segments_pierces_the_triangle_at_their_joint():
    random = np.random.default_rng(5)
    for _ in range(2000):
        p, u, v, a, c = random.integers(-1000, 1001, (5, 3))
        triangle = [LatticePoint(*x.tolist()) for x in (p, p + 5 * u, p + 5 * v)]
        a, b, c = (LatticePoint(*x.tolist()) for x in (a, p + u + 2 * v, c))
        if naive.determinant(*triangle, a) * naive.determinant(*triangle, c) < 0:
            assert pierces(a, b, *triangle) != pierces(b, c, *triangle)


def test_a_flat_triangle_is_never_pierced():
    random = np.random.default_rng(6)
    for _ in range(500):
        a, b, p, step = random.integers(-1000, 1001, (4, 3))
        i, j = random.integers(-3, 4, 2)
        flat = (LatticePoint(*x.tolist()) for x in (p, p + i * step, p + j * step))
        assert not pierces(LatticePoint(*a.tolist()), LatticePoint(*b.tolist()), *flat)


def test_the_lattice_covers_the_body_from_its_centre():
    lattice = lattice_around(np.array([[0.0, 0.0, 0.0], [0.1, 0.02, 0.04]]))
    assert nearest(lattice, Vec3(0.05, 0.01, 0.02)) == LatticePoint(0, 0, 0)
    assert nearest(lattice, Vec3(0.1, 0.01, 0.02)) == LatticePoint(LATTICE_POINTS // 2, 0, 0)


def test_a_point_far_from_the_body_is_clamped_to_the_lattice():
    lattice = lattice_around(np.array([[0.0, 0.0, 0.0], [0.1, 0.02, 0.04]]))
    far = nearest(lattice, Vec3(1e9, -1e9, 0.02))
    assert (far.x, far.y, far.z) == (LATTICE_LIMIT, -LATTICE_LIMIT, 0)
