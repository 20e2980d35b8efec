"""Places in a tree of boxes: which is the nearest to a point, near a triangle, in a tetrahedron.

The boxes are nodes of a complete binary tree: node 1 is around all places, nodes 2 i and 2 i + 1
are the halves of node i, and the last row are the leaves. A search goes through the nodes in depth
and omits those whose box is too far away.
"""

import math
from typing import NamedTuple

import numpy as np

from tissue.core.array_types import BoolArray, FloatArray, IntArray
from tissue.core.jit import inlined, kernel
from tissue.core.simd_rows import natural
from tissue.core.structs import Arrays
from tissue.core.vec3 import Vec3, add, axpy, cross, dot, norm, sub, vec3
from tissue.geometry.aabb import (
    Aabb,
    empty_box,
    overlap,
    tetrahedron_box,
    widened,
    with_point,
)
from tissue.geometry.tetrahedron import (
    barycentric_in,
    nearest_on_triangle,
    smallest_weight,
    tetrahedron_volume,
)

_IN_A_LEAF = 16
"""Places in a leaf, at most: as many as cost about as much as the two boxes above them."""


class PlaceTree(Arrays):
    """Places, and boxes around them."""

    places: FloatArray
    """The places in the order of the leaves [m], shape (n, 3)."""
    number: IntArray
    """Number of each as it was given, shape (n,)."""
    begin: IntArray
    """Where the places of each leaf begin, and the end, shape (n_leaves + 1,)."""
    boxes: FloatArray
    """Lowest and highest corner of the box of each node [m], shape (2 n_leaves, 6); row 0 is of no
    node."""


def place_tree(places: FloatArray) -> PlaceTree:
    """Return the tree of some places [m], shape (n, 3), one at least."""
    from scipy.spatial import cKDTree  # 0.2 s, and only here

    n = len(places)
    n_leaves = 1 << max(math.ceil(math.log2(n / _IN_A_LEAF)), 0)
    number = np.asarray(cKDTree(places, leafsize=_IN_A_LEAF).indices, np.int64)
    begin = np.arange(n_leaves + 1) * n // n_leaves
    in_order = np.ascontiguousarray(places[number], np.float64)
    low, high = np.zeros((2, 2 * n_leaves, 3))
    low[n_leaves:] = np.minimum.reduceat(in_order, begin[:-1])
    high[n_leaves:] = np.maximum.reduceat(in_order, begin[:-1])
    row = n_leaves
    while row > 1:
        np.minimum(low[row : 2 * row : 2], low[row + 1 : 2 * row : 2], out=low[row // 2 : row])
        np.maximum(high[row : 2 * row : 2], high[row + 1 : 2 * row : 2], out=high[row // 2 : row])
        row //= 2
    boxes = np.concatenate((low, high), axis=1)
    return PlaceTree(places=in_order, number=number, begin=begin, boxes=boxes)


@inlined
def _box(tree: PlaceTree, node: int) -> Aabb:
    """Return the box of a node."""
    row = natural(node)
    low = Vec3(tree.boxes[row, 0], tree.boxes[row, 1], tree.boxes[row, 2])
    return Aabb(low, Vec3(tree.boxes[row, 3], tree.boxes[row, 4], tree.boxes[row, 5]))


@inlined
def _next_node(node: int) -> int:
    """Return the node that comes after a node and all below it; 0 after the last."""
    while node % 2 == 1:
        node //= 2
    return node + 1 if node > 0 else 0


@inlined
def nearest_place(tree: PlaceTree, p: Vec3, square: float) -> int:
    """Return the row of the place nearest to a point; -1 where none is nearer than asked.

    Args:
        tree: The places.
        p: The point [m].
        square: Square of the distance below which a place counts [m2].
    """
    found, node, n_leaves = -1, 1, len(tree.begin) - 1
    while node > 0:
        low, high = _box(tree, node)
        x = max(max(low.x - p.x, p.x - high.x), 0.0)
        y = max(max(low.y - p.y, p.y - high.y), 0.0)
        z = max(max(low.z - p.z, p.z - high.z), 0.0)
        if x * x + y * y + z * z < square:
            if node < n_leaves:
                node *= 2
                continue
            leaf = node - n_leaves
            for row in range(tree.begin[leaf], tree.begin[leaf + 1]):
                offset = sub(p, vec3(tree.places, row))
                if dot(offset, offset) < square:
                    found, square = row, dot(offset, offset)
        node = _next_node(node)
    return found


@kernel
def _off_cell(tree: PlaceTree, normals: FloatArray, radius: float, p: Vec3, row: int) -> float:
    """Return the distance of a point from the cell around a place: see `write_distances`."""
    offset = sub(p, vec3(tree.places, row))
    normal = vec3(normals, row)
    across = dot(offset, normal)
    along = norm(axpy(-across, normal, offset))
    return math.hypot(across, max(along - radius, 0.0))


@kernel
def write_distances(
    tree: PlaceTree, normals: FloatArray, radius: float, points: FloatArray, distances: FloatArray
) -> None:
    """Write the distances of points from a surface, of which each place has a flat round cell.

    Args:
        tree: The places.
        normals: Unit normals of the surface at each, in the order of the tree, shape (n_places, 3).
        radius: Radius of the cells [m].
        points: The points [m], shape (n, 3); each is mostly near the one before.
        distances: Written [m], shape (n,).
    """
    row = 0
    for i in range(len(points)):
        p = vec3(points, i)
        offset = sub(p, vec3(tree.places, row))
        nearer = nearest_place(tree, p, dot(offset, offset))
        row = nearer if nearer >= 0 else row
        distances[i] = _off_cell(tree, normals, radius, p, row)


@kernel
def least_distance(
    tree: PlaceTree, normals: FloatArray, radius: float, points: FloatArray, least: float
) -> float:
    """Return the least of a distance [m] and those of points from such a surface.

    Args:
        tree: The places.
        normals: Unit normals of the surface at each, in the order of the tree, shape (n_places, 3).
        radius: Radius of the cells [m].
        points: The points [m], shape (n, 3).
        least: The distance.
    """
    for i in range(len(points)):
        p, reach = vec3(points, i), least + radius
        row = nearest_place(tree, p, reach * reach)
        if row >= 0:
            least = min(least, _off_cell(tree, normals, radius, p, row))
    return least


@kernel
def deepen(
    tree: PlaceTree, into: FloatArray, heights: FloatArray, reach: float, points: FloatArray,
    depths: FloatArray,
) -> None:  # fmt: skip
    """Write how deep the deepest of some points is below each station, where that is more.

    Args:
        tree: The stations as they are seen along the depth: in the plane across it through the
            origin.
        into: Unit vector in which depth is measured, shape (3,).
        heights: Of each station along it [m], shape (n_stations,).
        reach: Distance from a station, seen so, below which a point counts [m].
        points: The points [m], shape (n, 3).
        depths: Written [m], shape (n_stations,).
    """
    way = Vec3(into[0], into[1], into[2])
    for i in range(len(points)):
        p = vec3(points, i)
        height = dot(p, way)
        row = nearest_place(tree, axpy(-height, way, p), reach * reach)
        if row >= 0:
            station = tree.number[row]
            depths[station] = max(depths[station], height - heights[station])


class _Triangle(NamedTuple):
    """A triangle, and the slab and the three half spaces that it lies in, widened."""

    a: Vec3
    """First corner [m]."""
    b: Vec3
    """Second corner [m]."""
    c: Vec3
    """Third corner [m]."""
    normal: Vec3
    """Normal, as long as the triangle is large, twice [m2]."""
    to_b: Vec3
    """Vector in its plane, away from the edge ac: by it b is `square` from there [m3]."""
    to_c: Vec3
    """Vector in its plane, away from the edge ab, in the same way."""
    square: float
    """Square of `normal` [m4]."""


@kernel
def _triangle(a: Vec3, b: Vec3, c: Vec3) -> _Triangle:
    """Return a triangle of these corners."""
    ab, ac = sub(b, a), sub(c, a)
    normal = cross(ab, ac)
    return _Triangle(a, b, c, normal, cross(ac, normal), cross(normal, ab), dot(normal, normal))


@inlined
def _is_near(p: Vec3, triangle: _Triangle, within: float) -> bool:
    """Return whether a place is at most that far from a triangle [m].

    Most places are above or below it, or beyond a line along an edge, which is soon seen.
    """
    a, b, c, normal, to_b, to_c, square = triangle
    offset = sub(p, a)
    if abs(dot(offset, normal)) > within * math.sqrt(square):
        return False
    v, w = dot(offset, to_b), dot(offset, to_c)
    if v > 0.0 and w > 0.0 and v + w < square:
        return True
    if v < -within * norm(to_b) or w < -within * norm(to_c):
        return False
    if v + w > square + within * norm(add(to_b, to_c)):
        return False
    from_triangle = sub(p, nearest_on_triangle(p, a, b, c))
    return dot(from_triangle, from_triangle) <= within * within


@kernel
def mark_near_triangles(
    tree: PlaceTree, areas: FloatArray, corners: FloatArray, within: float, marked: BoolArray
) -> float:
    """Mark the places that are near one of some triangles; return the area of those [m2].

    Args:
        tree: The places.
        areas: Area of the surface for which each stands [m2], in the order of the tree, shape (n,).
        corners: Corners of the triangles one after the other [m], shape (3 n_triangles, 3).
        within: Distance up to which a place is near [m].
        marked: Those that are marked already are not looked at, in the order in which they were
            given; shape (n,).
    """
    n_leaves, area = len(tree.begin) - 1, 0.0
    for first in range(0, len(corners), 3):
        a, b, c = vec3(corners, first), vec3(corners, first + 1), vec3(corners, first + 2)
        triangle, node = _triangle(a, b, c), 1
        box = widened(with_point(with_point(with_point(empty_box(), a), b), c), within)
        while node > 0:
            if overlap(box, _box(tree, node)):
                if node < n_leaves:
                    node *= 2
                    continue
                leaf = node - n_leaves
                for row in range(tree.begin[leaf], tree.begin[leaf + 1]):
                    number = tree.number[row]
                    if not marked[number] and _is_near(vec3(tree.places, row), triangle, within):
                        marked[number] = True
                        area += areas[row]
            node = _next_node(node)
    return area


@kernel
def write_holders(
    tree: PlaceTree, positions: FloatArray, tetrahedra: IntArray, least: float,
    holders: IntArray, weights: FloatArray,
) -> None:  # fmt: skip
    """Write which tetrahedron holds each place, of several the last one.

    Args:
        tree: The places.
        positions: Of the nodes [m], shape (n_nodes, 3).
        tetrahedra: Nodes of each, shape (n_tetrahedra, 4); one without volume holds nothing.
        least: Barycentric weight that a place has at least in a tetrahedron that holds it.
        holders: Written where one does, in the order in which the places were given, shape (n,).
        weights: Written: barycentric weights in it, shape (n, 4).
    """
    n_leaves = len(tree.begin) - 1
    for t in range(len(tetrahedra)):
        if tetrahedron_volume(positions, tetrahedra, t) == 0.0:
            continue
        box, node = tetrahedron_box(positions, tetrahedra, t), 1
        # Outside the box by as much a weight is lower than that.
        box = widened(box, 4.0 * abs(least) * norm(sub(box.high, box.low)))
        while node > 0:
            if overlap(box, _box(tree, node)):
                if node < n_leaves:
                    node *= 2
                    continue
                leaf = node - n_leaves
                for row in range(tree.begin[leaf], tree.begin[leaf + 1]):
                    p = vec3(tree.places, row)
                    if not overlap(box, Aabb(p, p)):
                        continue
                    found = barycentric_in(p, positions, tetrahedra, t)
                    if smallest_weight(found) >= least:
                        number = tree.number[row]
                        holders[number] = t
                        weights[number, 0], weights[number, 1] = found.a, found.b
                        weights[number, 2], weights[number, 3] = found.c, found.d
            node = _next_node(node)
