"""Geometry of tetrahedra: volumes, altitudes, barycentric weights, and 3 x 3 matrices."""

import math
from typing import NamedTuple

from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import kernel
from tissue.core.simd_rows import natural
from tissue.core.vec3 import Vec3, axpy, cross, dot, norm, scale, sub, vec3


class Weights(NamedTuple):
    """Barycentric weights of a point in a tetrahedron; they add up to one."""

    a: float
    b: float
    c: float
    d: float


class Matrix3(NamedTuple):
    """A 3 by 3 matrix by its columns."""

    c0: Vec3
    """First column."""
    c1: Vec3
    """Second column."""
    c2: Vec3
    """Third column."""


@kernel
def signed_volume(a: Vec3, b: Vec3, c: Vec3, d: Vec3) -> float:
    """Return the signed volume of tetrahedron abcd [m3], positive if abc turns left seen from d."""
    return dot(cross(sub(b, a), sub(c, a)), sub(d, a)) / 6.0


@kernel
def tetrahedron_volume(positions: FloatArray, tetrahedra: IntArray, t: int) -> float:
    """Return the signed volume of tetrahedron `t` [m3]."""
    return signed_volume(
        vec3(positions, tetrahedra[t, 0]),
        vec3(positions, tetrahedra[t, 1]),
        vec3(positions, tetrahedra[t, 2]),
        vec3(positions, tetrahedra[t, 3]),
    )


@kernel
def triangle_area(a: Vec3, b: Vec3, c: Vec3) -> float:
    """Return the area of triangle abc [m2]."""
    return 0.5 * norm(cross(sub(b, a), sub(c, a)))


@kernel
def face_area(positions: FloatArray, tetrahedra: IntArray, t: int, f: int) -> float:
    """Return the area of the face of tetrahedron `t` opposite its local node `f` [m2]."""
    return triangle_area(
        vec3(positions, tetrahedra[t, (f + 1) % 4]),
        vec3(positions, tetrahedra[t, (f + 2) % 4]),
        vec3(positions, tetrahedra[t, (f + 3) % 4]),
    )


@kernel
def altitude(apex: Vec3, a: Vec3, b: Vec3, c: Vec3) -> float:
    """Return the distance of `apex` from the plane of abc [m]; 0 where abc is a line."""
    normal = cross(sub(b, a), sub(c, a))
    length = norm(normal)
    if length == 0.0:
        return 0.0
    return abs(dot(normal, sub(apex, a))) / length


@kernel
def node_altitude(positions: FloatArray, tetrahedra: IntArray, t: int, k: int) -> float:
    """Return the altitude of tetrahedron `t` over its local node `k` [m]."""
    return altitude(
        vec3(positions, tetrahedra[t, k]),
        vec3(positions, tetrahedra[t, (k + 1) % 4]),
        vec3(positions, tetrahedra[t, (k + 2) % 4]),
        vec3(positions, tetrahedra[t, (k + 3) % 4]),
    )


@kernel
def smallest_altitude(a: Vec3, b: Vec3, c: Vec3, d: Vec3) -> float:
    """Return the smallest of the four altitudes of a tetrahedron [m]."""
    return min(
        min(altitude(a, b, c, d), altitude(b, a, c, d)),
        min(altitude(c, a, b, d), altitude(d, a, b, c)),
    )


@kernel
def barycentric(p: Vec3, a: Vec3, b: Vec3, c: Vec3, d: Vec3) -> Weights:
    """Return the barycentric weights of `p` in tetrahedron abcd.

    A weight is negative where `p` is beyond the face opposite that corner.

    Args:
        p: The point [m].
        a: First corner [m].
        b: Second corner [m].
        c: Third corner [m].
        d: Fourth corner [m].
    """
    volume = signed_volume(a, b, c, d)
    if volume == 0.0:
        return Weights(0.25, 0.25, 0.25, 0.25)
    wb = signed_volume(a, p, c, d) / volume
    wc = signed_volume(a, b, p, d) / volume
    wd = signed_volume(a, b, c, p) / volume
    return Weights(1.0 - wb - wc - wd, wb, wc, wd)


@kernel
def barycentric_in(p: Vec3, positions: FloatArray, tetrahedra: IntArray, t: int) -> Weights:
    """Return the barycentric weights of `p` in tetrahedron `t`."""
    row = natural(t)
    return barycentric(
        p,
        vec3(positions, tetrahedra[row, 0]),
        vec3(positions, tetrahedra[row, 1]),
        vec3(positions, tetrahedra[row, 2]),
        vec3(positions, tetrahedra[row, 3]),
    )


@kernel
def smallest_weight(w: Weights) -> float:
    """Return the smallest of four weights: negative outside, 0 on a face."""
    return min(min(w.a, w.b), min(w.c, w.d))


@kernel
def clipped(w: Weights) -> Weights:
    """Return the weights of a point of the tetrahedron near one that may be outside it."""
    a, b, c, d = max(w.a, 0.0), max(w.b, 0.0), max(w.c, 0.0), max(w.d, 0.0)
    total = a + b + c + d
    return Weights(a / total, b / total, c / total, d / total)


@kernel
def interpolate(w: Weights, values: FloatArray, tetrahedra: IntArray, t: int) -> Vec3:
    """Return the value at weights `w` of a field given at the nodes, shape (n_nodes, 3)."""
    row = natural(t)
    a, b = natural(tetrahedra[row, 0]), natural(tetrahedra[row, 1])
    c, d = natural(tetrahedra[row, 2]), natural(tetrahedra[row, 3])
    return Vec3(
        w.a * values[a, 0] + w.b * values[b, 0] + w.c * values[c, 0] + w.d * values[d, 0],
        w.a * values[a, 1] + w.b * values[b, 1] + w.c * values[c, 1] + w.d * values[d, 1],
        w.a * values[a, 2] + w.b * values[b, 2] + w.c * values[c, 2] + w.d * values[d, 2],
    )


@kernel
def edge_matrix(positions: FloatArray, tetrahedra: IntArray, t: int) -> Matrix3:
    """Return the matrix with columns b - a, c - a, d - a of tetrahedron `t` [m]."""
    a = vec3(positions, tetrahedra[t, 0])
    return Matrix3(
        sub(vec3(positions, tetrahedra[t, 1]), a),
        sub(vec3(positions, tetrahedra[t, 2]), a),
        sub(vec3(positions, tetrahedra[t, 3]), a),
    )


@kernel
def determinant(m: Matrix3) -> float:
    """Return the determinant of `m`."""
    return dot(m.c0, cross(m.c1, m.c2))


@kernel
def solve(m: Matrix3, b: Vec3) -> Vec3:
    """Solve m y = b by Cramer's rule; `m` must not be singular."""
    d = determinant(m)
    return Vec3(
        dot(b, cross(m.c1, m.c2)) / d, dot(m.c0, cross(b, m.c2)) / d, dot(m.c0, cross(m.c1, b)) / d
    )


@kernel
def apply(m: Matrix3, y: Vec3) -> Vec3:
    """Return m y."""
    return Vec3(
        m.c0.x * y.x + m.c1.x * y.y + m.c2.x * y.z,
        m.c0.y * y.x + m.c1.y * y.y + m.c2.y * y.z,
        m.c0.z * y.x + m.c1.z * y.y + m.c2.z * y.z,
    )


@kernel
def normalised(a: Vec3) -> Vec3:
    """Return the unit vector along `a`; zero stays zero."""
    length = norm(a)
    if length == 0.0 or not math.isfinite(length):
        return Vec3(0.0, 0.0, 0.0)
    return scale(1.0 / length, a)


@kernel
def nearest_on_segment(a: Vec3, b: Vec3, p: Vec3) -> Vec3:
    """Return the point between `a` and `b` nearest to `p`."""
    along = sub(b, a)
    squared = dot(along, along)
    if squared == 0.0:
        return a
    return axpy(min(1.0, max(0.0, dot(sub(p, a), along) / squared)), along, a)


@kernel
def nearest_on_triangle(p: Vec3, a: Vec3, b: Vec3, c: Vec3) -> Vec3:
    """Return the point of triangle abc nearest to `p`, by Voronoi regions (Ericson 2005, 5.1.5)."""
    ab = sub(b, a)
    ac = sub(c, a)
    ap = sub(p, a)
    d1 = dot(ab, ap)
    d2 = dot(ac, ap)
    if d1 <= 0.0 and d2 <= 0.0:
        return a
    bp = sub(p, b)
    d3 = dot(ab, bp)
    d4 = dot(ac, bp)
    if d3 >= 0.0 and d4 <= d3:
        return b
    cp = sub(p, c)
    d5 = dot(ab, cp)
    d6 = dot(ac, cp)
    if d6 >= 0.0 and d5 <= d6:
        return c
    vc = d1 * d4 - d3 * d2
    if vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        return axpy(d1 / (d1 - d3), ab, a)
    vb = d5 * d2 - d1 * d6
    if vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        return axpy(d2 / (d2 - d6), ac, a)
    va = d3 * d6 - d5 * d4
    if va <= 0.0 and d4 >= d3 and d5 >= d6:
        return axpy((d4 - d3) / ((d4 - d3) + (d5 - d6)), sub(c, b), b)
    total = va + vb + vc
    return axpy(vb / total, ab, axpy(vc / total, ac, a))


class Symmetric(NamedTuple):
    """A symmetric 3 x 3 matrix."""

    xx: float
    yy: float
    zz: float
    xy: float
    xz: float
    yz: float


@kernel
def nothing_symmetric() -> Symmetric:
    """Return the matrix of zeros."""
    return Symmetric(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@kernel
def add_square(m: Symmetric, c: float, a: Vec3) -> Symmetric:
    """Return m + c a a^T."""
    return Symmetric(
        m.xx + c * a.x * a.x,
        m.yy + c * a.y * a.y,
        m.zz + c * a.z * a.z,
        m.xy + c * a.x * a.y,
        m.xz + c * a.x * a.z,
        m.yz + c * a.y * a.z,
    )


@kernel
def largest_eigenvalue(m: Symmetric) -> float:
    """Return the largest eigenvalue, from the angle of the characteristic cubic."""
    xy, xz, yz = m.xy, m.xz, m.yz
    mean = (m.xx + m.yy + m.zz) / 3.0
    xx, yy, zz = m.xx - mean, m.yy - mean, m.zz - mean
    square = (xx * xx + yy * yy + zz * zz + 2.0 * (xy * xy + xz * xz + yz * yz)) / 6.0
    if square == 0.0:
        return mean
    radius = math.sqrt(square)
    half_determinant = 0.5 * (
        xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz)
    )
    cosine = min(1.0, max(-1.0, half_determinant / (square * radius)))
    return mean + 2.0 * radius * math.cos(math.acos(cosine) / 3.0)
