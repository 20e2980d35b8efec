"""The charts of a surface: which triangles lie side by side in a texture, and their normals.

Each triangle is projected along the axis that is nearest to its normal at rest (a cube map of six
charts). A vertex that lies in several charts becomes several vertices.
"""

import math
from typing import NamedTuple

import numpy as np

from scalpel_sim.viewer.primitives import TriangleMesh
from tissue import BoolArray, FloatArray, IntArray
from tissue.support import kernel

CREASE_COSINE = 0.87
"""Cosine of 30 degrees. Where the normal of a chart differs by more from the normal of all
triangles around a vertex, at rest, there is a crease, and its edge is drawn sharp: the edges of a
box, but not the rim of an organ, whose charts meet at any angle. At 45 degrees boxes would look
inflated."""

N_CHARTS = 6
"""Number of charts: the sides of a cube."""

CHART_AXES = np.array([[1, 2], [1, 2], [0, 2], [0, 2], [0, 1], [0, 1]])
"""Rest coordinates that serve as u and v in the charts that face -x, +x, -y, +y, -z and +z."""

CHART_SHIFT = np.array(
    [[0.0, 0.0], [0.37, 0.61], [0.71, 0.23], [0.13, 0.47], [0.59, 0.83], [0.29, 0.07]]
)
"""Shift of u and v in each chart, so that opposite sides of a body do not show the same pattern."""


class Charts(NamedTuple):
    """Triangles of a surface as its charts have them: what stays while the body only deforms."""

    nodes: IntArray
    """Vertex of the surface that each vertex of the charts is, shape (n_vertices,)."""
    corners: IntArray
    """Vertices of the charts at the corners of the triangles, shape (n_triangles, 3)."""
    is_on_crease: BoolArray
    """Whether each vertex lies on a crease of the body at rest, shape (n_vertices,)."""
    uv: FloatArray
    """Texture coordinates of each vertex in repeats, shape (n_vertices, 2)."""

    def mesh(self, positions: FloatArray) -> TriangleMesh:
        """Return the triangles where the vertices of the surface are now [m], without tints."""
        n = len(self.nodes)
        of_node, normals = np.zeros((len(positions), 3)), np.zeros((n, 3))
        _add_normals(positions, self.nodes, self.corners, of_node, normals)
        _choose_normals(self.nodes, self.is_on_crease, of_node, normals)
        return TriangleMesh(positions[self.nodes], self.corners, normals, self.uv)


def charts_of(rest_positions: FloatArray, triangles: IntArray, tile: float) -> Charts:
    """Return the charts of some triangles of a surface.

    Args:
        rest_positions: Of the vertices of the surface [m], shape (n, 3).
        triangles: The triangles, shape (n_triangles, 3).
        tile: Length of the material that one repeat of the texture covers [m].
    """
    n_nodes = len(rest_positions)
    vertices = np.full((n_nodes, N_CHARTS), -1)
    corners, (nodes, chart) = np.empty_like(triangles), np.empty((2, triangles.size), np.int64)
    n = _number(rest_positions, triangles, vertices, corners, nodes, chart)
    nodes, is_on_crease, uv = nodes[:n], np.empty(n, np.bool_), np.empty((n, 2))
    of_node, of_chart = np.zeros((n_nodes, 3)), np.zeros((n, 3))
    _add_normals(rest_positions, nodes, corners, of_node, of_chart)
    _mark_creases(nodes, of_node, of_chart, CREASE_COSINE, is_on_crease)
    _lay_out(rest_positions, nodes, chart, CHART_AXES, CHART_SHIFT, tile, uv)
    return Charts(nodes, corners, is_on_crease, uv)


@kernel
def _number(
    rest_positions: FloatArray,
    triangles: IntArray,
    vertices: IntArray,
    corners: IntArray,
    nodes: IntArray,
    charts: IntArray,
) -> int:
    """Number the vertices of charts by node and chart; return how many there are.

    Args:
        rest_positions: Of the nodes [m], shape (n, 3).
        triangles: Nodes of the triangles, shape (n_triangles, 3).
        vertices: -1 at first, then the number of each node's vertex in each chart that it is in,
            shape (n, 6).
        corners: Receives the vertices at the corners of the triangles, shape (n_triangles, 3).
        nodes: Receives the node of each vertex, shape (room,).
        charts: Receives the chart of each vertex, shape (room,).
    """
    for t in range(len(triangles)):
        x, y, z = _area_normal(rest_positions, triangles[t, 0], triangles[t, 1], triangles[t, 2])
        chart = 4 + (z > 0.0)
        if abs(x) >= abs(y) and abs(x) >= abs(z):
            chart = 0 + (x > 0.0)
        elif abs(y) >= abs(z):
            chart = 2 + (y > 0.0)
        for k in range(3):
            vertices[triangles[t, k], chart] = 0
            corners[t, k] = chart
    n = 0
    for node in range(len(vertices)):
        for chart in range(6):
            if vertices[node, chart] == 0:
                vertices[node, chart] = n
                nodes[n], charts[n] = node, chart
                n += 1
    for t in range(len(triangles)):
        for k in range(3):
            corners[t, k] = vertices[triangles[t, k], corners[t, k]]
    return n


@kernel
def _lay_out(
    rest_positions: FloatArray,
    nodes: IntArray,
    charts: IntArray,
    axes: IntArray,
    shift: FloatArray,
    tile: float,
    uv: FloatArray,
) -> None:
    """Write the texture coordinates of vertices.

    Args:
        rest_positions: Of the nodes [m], shape (n, 3).
        nodes: Node of each vertex, shape (n_vertices,).
        charts: Chart of each vertex.
        axes: CHART_AXES.
        shift: CHART_SHIFT.
        tile: Length of the material that one repeat of the texture covers [m].
        uv: Receives them, shape (n_vertices, 2).
    """
    for i in range(len(nodes)):
        for k in range(2):
            chart = charts[i]
            uv[i, k] = rest_positions[nodes[i], axes[chart, k]] / tile + shift[chart, k]


@kernel
def _add_normals(
    positions: FloatArray,
    nodes: IntArray,
    corners: IntArray,
    of_node: FloatArray,
    of_vertex: FloatArray,
) -> None:
    """Add the normals of the triangles around each node, and each vertex, by their areas.

    Args:
        positions: Of the nodes [m], shape (n, 3).
        nodes: Node of each vertex, shape (n_vertices,).
        corners: Vertices of the triangles, shape (n_triangles, 3).
        of_node: Sums of the nodes, shape (n, 3).
        of_vertex: Sums of the vertices, shape (n_vertices, 3).
    """
    for t in range(len(corners)):
        a, b, c = corners[t, 0], corners[t, 1], corners[t, 2]
        normal = _area_normal(positions, nodes[a], nodes[b], nodes[c])
        for vertex in (a, b, c):
            for k in range(3):
                of_vertex[vertex, k] += normal[k]
                of_node[nodes[vertex], k] += normal[k]


@kernel
def _mark_creases(
    nodes: IntArray,
    of_node: FloatArray,
    of_vertex: FloatArray,
    cosine: float,
    is_on_crease: BoolArray,
) -> None:
    """Mark the vertices whose normals differ from that of their node.

    Args:
        nodes: Node of each vertex, shape (n_vertices,).
        of_node: Normals of the nodes, of any length, shape (n, 3).
        of_vertex: Normals of the vertices, of any length, shape (n_vertices, 3).
        cosine: Cosine of the least angle between the two at a crease.
        is_on_crease: Receives the marks, shape (n_vertices,).
    """
    for i in range(len(nodes)):
        one, other = _unit(of_vertex, i), _unit(of_node, nodes[i])
        alike = one[0] * other[0] + one[1] * other[1] + one[2] * other[2]
        is_on_crease[i] = alike < cosine


@kernel
def _choose_normals(
    nodes: IntArray, is_on_crease: BoolArray, of_node: FloatArray, normals: FloatArray
) -> None:
    """Make normals unit vectors: those of vertices on creases, and those of the nodes elsewhere.

    Args:
        nodes: Node of each vertex, shape (n_vertices,).
        is_on_crease: Whether each vertex lies on a crease, shape (n_vertices,).
        of_node: Normals of the nodes, of any length, shape (n, 3).
        normals: Normals of the vertices, of any length; receives those to draw, (n_vertices, 3).
    """
    for i in range(len(nodes)):
        chosen = _unit(normals, i) if is_on_crease[i] else _unit(of_node, nodes[i])
        for k in range(3):
            normals[i, k] = chosen[k]


@kernel
def _area_normal(positions: FloatArray, a: int, b: int, c: int) -> tuple[float, float, float]:
    """Return the normal of a triangle, twice its area long."""
    p, q, r = (
        positions[b, 0] - positions[a, 0],
        positions[b, 1] - positions[a, 1],
        positions[b, 2] - positions[a, 2],
    )
    u, v, w = (
        positions[c, 0] - positions[a, 0],
        positions[c, 1] - positions[a, 1],
        positions[c, 2] - positions[a, 2],
    )
    return q * w - r * v, r * u - p * w, p * v - q * u


@kernel
def _unit(vectors: FloatArray, i: int) -> tuple[float, float, float]:
    """Return row `i` of vectors at unit length; a zero vector becomes (0, 0, 1)."""
    x, y, z = vectors[i, 0], vectors[i, 1], vectors[i, 2]
    length = math.sqrt(x * x + y * y + z * z)
    if length > 0.0:
        return x / length, y / length, z / length
    return 0.0, 0.0, 1.0
