"""The rotation in a deformation: the orthogonal factor of the polar decomposition."""

from tissue.core.jit import kernel
from tissue.core.vec3 import Vec3, add, cross, dot, norm, scale
from tissue.geometry.tetrahedron import Matrix3, determinant

_ITERATIONS = 8
"""Iterations of Higham's method; each doubles the number of correct digits."""

_LEAST_DETERMINANT = 0.05
"""Determinant of the scaled matrix below which no rotation is near it."""

IDENTITY = Matrix3(Vec3(1.0, 0.0, 0.0), Vec3(0.0, 1.0, 0.0), Vec3(0.0, 0.0, 1.0))


@kernel
def nearest_rotation(m: Matrix3) -> Matrix3:
    """Return the rotation nearest to `m`, up to scale; the identity where none is near.

    Higham's iteration for the polar decomposition: R <- (R + R^-T) / 2.
    """
    size = norm(m.c0) + norm(m.c1) + norm(m.c2)
    if size == 0.0:
        return IDENTITY
    r = Matrix3(scale(3.0 / size, m.c0), scale(3.0 / size, m.c1), scale(3.0 / size, m.c2))
    for _ in range(_ITERATIONS):
        d = determinant(r)
        if d < _LEAST_DETERMINANT:
            return IDENTITY
        half = 0.5 / d  # the columns of R^-T are cross products of those of R, over det R
        r = Matrix3(
            add(scale(0.5, r.c0), scale(half, cross(r.c1, r.c2))),
            add(scale(0.5, r.c1), scale(half, cross(r.c2, r.c0))),
            add(scale(0.5, r.c2), scale(half, cross(r.c0, r.c1))),
        )
    return r


@kernel
def apply_transposed(m: Matrix3, v: Vec3) -> Vec3:
    """Return m^T v: the inverse of a rotation, applied to `v`."""
    return Vec3(dot(m.c0, v), dot(m.c1, v), dot(m.c2, v))
