"""Unit quaternions (w, x, y, z) in kernels, term by term as MuJoCo's own functions.

Each gives the bits of the function of MuJoCo that it names. A call of one of those from Python
takes longer than all the arithmetic of a frame.
"""

import math

from tissue.support import kernel

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]
Matrix = tuple[float, float, float, float, float, float, float, float, float]
"""A matrix of shape (3, 3), row by row."""

_SMALLEST = 1e-15
"""Length below which a vector has no direction, as in MuJoCo."""


@kernel
def product(a: Quaternion, b: Quaternion) -> Quaternion:
    """Return the rotation `b` followed by `a` (mju_mulQuat)."""
    aw, ax, ay, az = a
    bw, bx, by, bz = b
    return (
        (aw * bw - ax * bx) + (-ay * by - az * bz),
        (aw * bx + ax * bw) + (ay * bz - az * by),
        (aw * by - ax * bz) + (ay * bw + az * bx),
        (aw * bz + ax * by) + (az * bw - ay * bx),
    )


@kernel
def inverse(q: Quaternion) -> Quaternion:
    """Return the rotation back (mju_negQuat)."""
    w, x, y, z = q
    return w, -x, -y, -z


@kernel
def unit(q: Quaternion) -> Quaternion:
    """Return a quaternion with the length 1 (mju_normalize4)."""
    w, x, y, z = q
    length = math.sqrt(w * w + x * x + y * y + z * z)
    if length < _SMALLEST:
        return 1.0, 0.0, 0.0, 0.0
    if abs(length - 1.0) > _SMALLEST:
        share = 1.0 / length
        return w * share, x * share, y * share, z * share
    return q


@kernel
def split(v: Vector) -> tuple[float, Vector]:
    """Return length and direction of a vector (mju_normalize3)."""
    x, y, z = v
    length = math.sqrt(x * x + y * y + z * z)
    if length < _SMALLEST:
        return length, (1.0, 0.0, 0.0)
    share = 1.0 / length
    return length, (x * share, y * share, z * share)


@kernel
def turned_on(q: Quaternion, spin: Vector, share: float) -> Quaternion:
    """Return a rotation, then a share of a rotation vector in its frame (mju_quatIntegrate)."""
    angle, (x, y, z) = split(spin)
    angle *= share
    if angle == 0.0:
        return product(unit(q), (1.0, 0.0, 0.0, 0.0))
    sine = math.sin(0.5 * angle)
    return product(unit(q), (math.cos(0.5 * angle), x * sine, y * sine, z * sine))


@kernel
def turn_between(before: Quaternion, after: Quaternion) -> Vector:
    """Return the rotation vector, in the frame of `before`, that leads to `after` (mju_subQuat)."""
    w, x, y, z = product(inverse(before), after)
    sine, (x, y, z) = split((x, y, z))
    angle = 2.0 * math.atan2(sine, w)
    if angle > math.pi:
        angle -= 2.0 * math.pi
    return x * angle, y * angle, z * angle


@kernel
def rotated(v: Vector, q: Quaternion) -> Vector:
    """Return a rotated vector (mju_rotVecQuat)."""
    vx, vy, vz = v
    w, x, y, z = q
    if vx == 0.0 and vy == 0.0 and vz == 0.0:
        return 0.0, 0.0, 0.0
    tx, ty, tz = w * vx + y * vz - z * vy, w * vy + z * vx - x * vz, w * vz + x * vy - y * vx
    return (
        vx + 2.0 * (y * tz - z * ty),
        vy + 2.0 * (z * tx - x * tz),
        vz + 2.0 * (x * ty - y * tx),
    )


@kernel
def matrix_of(q: Quaternion) -> Matrix:
    """Return the matrix of a rotation (mju_quat2Mat)."""
    w, x, y, z = q
    ww, xx, yy, zz = w * w, x * x, y * y, z * z
    return (
        (ww - yy) + (xx - zz),
        2.0 * (x * y - w * z),
        2.0 * (x * z + w * y),
        2.0 * (x * y + w * z),
        (ww + yy) - (xx + zz),
        2.0 * (y * z - w * x),
        2.0 * (x * z - w * y),
        2.0 * (y * z + w * x),
        (ww - yy) - (xx - zz),
    )


@kernel
def quaternion_of(matrix: Matrix) -> Quaternion:
    """Return the rotation of a matrix (mju_mat2Quat)."""
    xx, xy, xz, yx, yy, yz, zx, zy, zz = matrix
    if xx + yy + zz > 0.0:
        w = 0.5 * math.sqrt(1.0 + xx + yy + zz)
        return unit((w, 0.25 * (zy - yz) / w, 0.25 * (xz - zx) / w, 0.25 * (yx - xy) / w))
    if xx > yy and xx > zz:
        x = 0.5 * math.sqrt(1.0 + xx - yy - zz)
        return unit((0.25 * (zy - yz) / x, x, 0.25 * (xy + yx) / x, 0.25 * (xz + zx) / x))
    if yy > zz:
        y = 0.5 * math.sqrt(1.0 - xx + yy - zz)
        return unit((0.25 * (xz - zx) / y, 0.25 * (xy + yx) / y, y, 0.25 * (yz + zy) / y))
    z = 0.5 * math.sqrt(1.0 - xx - yy + zz)
    return unit((0.25 * (yx - xy) / z, 0.25 * (xz + zx) / z, 0.25 * (yz + zy) / z, z))
