"""Three floats. Inside kernels a point is a Vec3, never an array: nothing is allocated."""

import math
from typing import NamedTuple

from tissue.core.array_types import FloatArray
from tissue.core.jit import inlined
from tissue.core.simd_rows import natural


class Vec3(NamedTuple):
    """A point or a vector."""

    x: float
    y: float
    z: float


@inlined
def vec3(array: FloatArray, i: int) -> Vec3:
    """Return row `i` of an array of shape (n, 3)."""
    row = natural(i)
    return Vec3(array[row, 0], array[row, 1], array[row, 2])


@inlined
def store(array: FloatArray, i: int, a: Vec3) -> None:
    """Write `a` into row `i` of an array of shape (n, 3)."""
    row = natural(i)
    array[row, 0] = a.x
    array[row, 1] = a.y
    array[row, 2] = a.z


@inlined
def add(a: Vec3, b: Vec3) -> Vec3:
    """Return a + b."""
    return Vec3(a.x + b.x, a.y + b.y, a.z + b.z)


@inlined
def sub(a: Vec3, b: Vec3) -> Vec3:
    """Return a - b."""
    return Vec3(a.x - b.x, a.y - b.y, a.z - b.z)


@inlined
def scale(s: float, a: Vec3) -> Vec3:
    """Return s a."""
    return Vec3(s * a.x, s * a.y, s * a.z)


@inlined
def axpy(s: float, a: Vec3, b: Vec3) -> Vec3:
    """Return s a + b."""
    return Vec3(s * a.x + b.x, s * a.y + b.y, s * a.z + b.z)


@inlined
def dot(a: Vec3, b: Vec3) -> float:
    """Return the scalar product."""
    return a.x * b.x + a.y * b.y + a.z * b.z


@inlined
def cross(a: Vec3, b: Vec3) -> Vec3:
    """Return the vector product."""
    return Vec3(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x)


@inlined
def norm(a: Vec3) -> float:
    """Return the length."""
    return math.sqrt(dot(a, a))


@inlined
def lerp(t: float, a: Vec3, b: Vec3) -> Vec3:
    """Return the point at fraction `t` of the way from a to b."""
    return Vec3(a.x + t * (b.x - a.x), a.y + t * (b.y - a.y), a.z + t * (b.z - a.z))
