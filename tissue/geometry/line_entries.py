"""Parallel lines through a closed surface of triangles: where they enter it."""

import math

from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import kernel
from tissue.core.vec3 import Vec3, cross, dot, norm, sub, vec3

_ALONG = 1e-12
"""Sine of the angle to a triangle below which a line runs along it, and meets no inside of it."""

_ROUNDING = 1e-9
"""Weight by which a line may miss a triangle and still meet it: it may pass between two."""


@kernel
def write_entries(
    corners: FloatArray, starts: FloatArray, direction: FloatArray, is_ahead: bool,
    faces: IntArray, weights: FloatArray, ways: FloatArray,
) -> None:  # fmt: skip
    """Write where lines enter a surface, of several places the one nearest to where they start.

    After Moeller and Trumbore 1997, J. Graphics Tools 2:21.

    Args:
        corners: Corners of the triangles one after the other, counter-clockwise seen from outside
            [m], shape (3 n_triangles, 3).
        starts: A place on each line [m], shape (n, 3).
        direction: Unit vector along all lines, shape (3,).
        is_ahead: Whether only places ahead of the start count, and not those behind it.
        faces: Written: the triangle, -1 where there is none, shape (n,).
        weights: Written: barycentric weights of its corners, shape (n, 3).
        ways: Written: way from the start along the line [m], inf where there is none, shape (n,).
    """
    way = Vec3(direction[0], direction[1], direction[2])
    for i in range(len(starts)):
        faces[i], ways[i] = -1, math.inf
    for first in range(0, len(corners), 3):
        origin = vec3(corners, first)
        along, across = sub(vec3(corners, first + 1), origin), sub(vec3(corners, first + 2), origin)
        normal = cross(along, across)
        facing = -dot(normal, way)
        if facing <= _ALONG * norm(normal):
            continue
        for i in range(len(starts)):
            offset = sub(vec3(starts, i), origin)
            turned = cross(offset, way)
            u, v = dot(across, turned) / facing, -dot(along, turned) / facing
            if min(u, v) < -_ROUNDING or u + v > 1.0 + _ROUNDING:
                continue
            found = dot(offset, normal) / facing
            if abs(found) < abs(ways[i]) and (found > 0.0 or not is_ahead):
                faces[i], ways[i] = first // 3, found
                weights[i, 0], weights[i, 1], weights[i, 2] = 1.0 - u - v, u, v
