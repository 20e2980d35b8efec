"""The sheet that a planned blade sweeps: a plane or a bent, ruled surface across the body."""

import math
from typing import NamedTuple

import numpy as np

from tissue import BladeSegment, BoolArray, FloatArray, IntArray

# Seen along the blade; `down` points away from the reader, or towards:
#
#   normal ^          ___-----___           a half cosine of height `sagitta` over `chord`,
#          |     __---           ---__      and its tangents beyond
#          +----+----------o----------+----> motion


class PlannedSheet(NamedTuple):
    """A surface ruled by the edge of a blade that moves through it."""

    origin: FloatArray
    """Middle of the section with the body [m], shape (3,)."""
    motion: FloatArray
    """Unit vector along which the blade travels, shape (3,)."""
    down: FloatArray
    """Unit vector from heel to tip of a blade that is not raked, shape (3,)."""
    normal: FloatArray
    """Unit vector to one side of the sheet, shape (3,)."""
    rake: float = 0.0
    """Angle [rad] by which the tip trails the heel, in the sheet. 0 where the sheet is bent."""
    sagitta: float = 0.0
    """Height of the bend [m]."""
    chord: float = 1.0
    """Length over which the sheet bends [m]."""

    def bulge(self, along: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return height [m] and slope of the sheet over its plane, at lengths `along` the motion.

        The height is counted from the middle of the bend, so that it spares both sides equally.
        """
        phase = np.pi * np.clip(along / self.chord, -0.5, 0.5)
        slope = -np.pi * self.sagitta / self.chord * np.sin(phase)
        beyond = np.sign(along) * np.maximum(np.abs(along) - 0.5 * self.chord, 0.0)
        return self.sagitta * (np.cos(phase) - 0.5) + slope * beyond, slope

    def height(self, points: FloatArray) -> FloatArray:
        """Return on which side of the sheet points are, and how far [m] along the normal."""
        offset = points - self.origin
        return offset @ self.normal - self.bulge(offset @ self.motion)[0]

    def travel(self, points: FloatArray) -> FloatArray:
        """Return how far along the motion the blade is when it is level with the points [m]."""
        offset = points - self.origin
        return offset @ self.motion + math.tan(self.rake) * (offset @ self.down)

    def depth(self, points: FloatArray) -> FloatArray:
        """Return how far along the blade the points are, from its crossing with the motion [m]."""
        return (points - self.origin) @ self.down / math.cos(self.rake)

    @property
    def edge(self) -> FloatArray:
        """Unit vector from heel to tip, shape (3,); where the sheet is bent too, it never turns."""
        return math.cos(self.rake) * self.down - math.sin(self.rake) * self.motion

    def ending_at(self, height: float, end: float, heel: float, tip: float) -> tuple[float, float]:
        """Return travel of the end and depth of the tip [m], with no part of the edge lower.

        A blade that moves down ends its way there, any other its edge.

        Args:
            height: The lowest that the edge may be [m].
            end: Travel at the end, before.
            heel: Depth of the heel, which is above.
            tip: Depth of the tip, before.
        """
        below = float(height - self.origin[2])
        rise, fall = float(self.edge[2]), float(self.motion[2])
        if fall < 0.0:
            return min(end, (below - min(heel * rise, tip * rise)) / fall), tip
        return end, min(tip, below / rise) if rise < 0.0 else tip

    def blade(self, travel: FloatArray, heel: float, tip: float) -> list[BladeSegment]:
        """Return the edge from depth `heel` to depth `tip`, at each `travel`."""
        height, slope = self.bulge(travel)
        edge = self.edge
        middle = self.origin + np.outer(travel, self.motion) + np.outer(height, self.normal)
        tangent = self.motion + np.outer(slope, self.normal)
        tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
        forward = math.cos(self.rake) * tangent + math.sin(self.rake) * self.down
        return [
            BladeSegment(at + tip * edge, at + heel * edge, facing)
            for at, facing in zip(middle, forward, strict=True)
        ]


def mesh_edges(tetrahedra: IntArray) -> IntArray:
    """Return the distinct edges of a mesh, shape (n_edges, 2)."""
    pairs = np.array([[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]])
    ends = np.sort(tetrahedra[:, pairs].reshape(-1, 2), axis=1)
    n_nodes = int(tetrahedra.max()) + 1
    return np.stack(np.divmod(np.unique(ends[:, 0] * n_nodes + ends[:, 1]), n_nodes), axis=1)


def section(positions: FloatArray, edges: IntArray, heights: FloatArray) -> FloatArray:
    """Return where edges of the body cross a sheet [m], shape (n, 3).

    Args:
        positions: Positions of the nodes [m], shape (n_nodes, 3).
        edges: Node indices, shape (n_edges, 2).
        heights: Heights of the nodes over the sheet [m], shape (n_nodes,).
    """
    crossing = edges[is_above(heights)[edges[:, 0]] != is_above(heights)[edges[:, 1]]]
    first, second = heights[crossing[:, 0]], heights[crossing[:, 1]]
    share = (first / (first - second))[:, None]
    return np.asarray((1.0 - share) * positions[crossing[:, 0]] + share * positions[crossing[:, 1]])


def is_above(heights: FloatArray) -> BoolArray:
    """Return which nodes count as above the sheet; one on the sheet does."""
    return heights >= 0.0
