"""Places on triangles, evenly spaced: the middles of their parts, and places on their edges."""

import math

from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import kernel
from tissue.core.vec3 import axpy, cross, lerp, norm, scale, store, sub, vec3


@kernel
def count_places(corners: FloatArray, spacing: float, counts: IntArray) -> tuple[int, int]:
    """Write how often each edge of some triangles is divided; return how many places there are.

    Args:
        corners: Corners of the triangles one after the other [m], shape (3 n, 3).
        spacing: Longest part of an edge [m].
        counts: Written: of the edge that begins at each corner, shape (3 n,).

    Returns:
        Number of parts of all triangles, each divided as often as its longest edge; and of places
        on all edges.
    """
    n_parts = n_on_edges = 0
    for first in range(0, len(corners), 3):
        most = 1
        for k in range(3):
            way = sub(vec3(corners, first + (k + 1) % 3), vec3(corners, first + k))
            counts[first + k] = max(math.ceil(norm(way) / spacing), 1)
            most = max(most, counts[first + k])
            n_on_edges += counts[first + k]
        n_parts += most * most
    return n_parts, n_on_edges


@kernel
def write_parts(
    corners: FloatArray, counts: IntArray, middles: FloatArray, normals: FloatArray,
    areas: FloatArray,
) -> None:  # fmt: skip
    """Divide triangles into equal parts, k x k of each.

    Args:
        corners: As for `count_places`.
        counts: Its counts.
        middles: Written: middles of the parts [m], shape (n_parts, 3).
        normals: Written: their unit normals, shape (n_parts, 3); 0 of a triangle without area.
        areas: Written: their areas [m2], shape (n_parts,).
    """
    row = 0
    for first in range(0, len(corners), 3):
        a = vec3(corners, first)
        ab, ac = sub(vec3(corners, first + 1), a), sub(vec3(corners, first + 2), a)
        k = max(counts[first], counts[first + 1], counts[first + 2])
        crossed = cross(ab, ac)
        length = norm(crossed)
        per = 1.0 / length if length > 0.0 else 0.0
        normal = scale(per, crossed)
        for i in range(k):
            for j in range(2 * (k - i) - 1):  # upright parts, and turned ones between them
                third = (1.0 + j % 2) / 3.0
                middle = axpy((i + third) / k, ab, axpy((j // 2 + third) / k, ac, a))
                store(middles, row, middle)
                store(normals, row, normal)
                areas[row] = 0.5 * length / (k * k)
                row += 1


@kernel
def write_edge_places(corners: FloatArray, counts: IntArray, places: FloatArray) -> None:
    """Write places on the edges of triangles, each from its begin on.

    Args:
        corners: As for `count_places`.
        counts: Its counts.
        places: Written [m], shape (n_on_edges, 3).
    """
    row = 0
    for first in range(0, len(corners), 3):
        for k in range(3):
            a, b = vec3(corners, first + k), vec3(corners, first + (k + 1) % 3)
            for i in range(counts[first + k]):
                store(places, row, lerp(i / counts[first + k], a, b))
                row += 1
