"""Fixtures: rigid obstacles around the tissue such as the table, clamps and retractors."""

from dataclasses import dataclass, field

import numpy as np

from bridge.poses import finite, rotation
from tissue import FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class FixtureBox:
    """A solid box.

    Raises:
        ValueError: an array has a wrong shape, a number is not finite, the box is flat, or its
            rotation is not one. (The collision library accepts all of these silently.)
    """

    name: str
    """Name of the fixture, in reports."""
    size: FloatArray
    """Lengths of the edges [m], shape (3,)."""
    centre: FloatArray
    """Centre of the box [m], shape (3,)."""
    rotation: FloatArray = field(default_factory=lambda: np.eye(3))
    """Axes of the box as columns, shape (3, 3)."""

    def __post_init__(self) -> None:
        whose = f"fixture {self.name!r}"
        size = finite(self.size, (3,), f"the size of {whose}")
        if np.any(size <= 0.0):
            raise ValueError(f"the size of {whose} is {size.tolist()} m; all must be positive")
        object.__setattr__(self, "size", size)
        object.__setattr__(self, "centre", finite(self.centre, (3,), f"the centre of {whose}"))
        object.__setattr__(self, "rotation", rotation(self.rotation, f"the rotation of {whose}"))


@dataclass(frozen=True, eq=False)
class FixtureMesh:
    """A triangulated surface. Only the surface collides, not the volume that it encloses.

    Raises:
        ValueError: an array has a wrong shape, a number is not finite, there is no triangle, or
            one refers to a vertex that does not exist. (In the collision library that would end
            the process.)
    """

    name: str
    """Name of the fixture, in reports."""
    positions: FloatArray
    """Positions of the vertices [m], shape (n_vertices, 3)."""
    triangles: IntArray
    """Vertex indices of the triangles, shape (n_triangles, 3)."""

    def __post_init__(self) -> None:
        whose = f"fixture {self.name!r}"
        positions = finite(self.positions, (None, 3), f"the positions of {whose}")
        triangles = np.array(self.triangles)
        if triangles.ndim != 2 or triangles.shape[1] != 3 or len(triangles) == 0:
            raise ValueError(
                f"the triangles of {whose} have shape {triangles.shape}; wanted (n, 3), n > 0"
            )
        if not np.issubdtype(triangles.dtype, np.integer):
            raise ValueError(
                f"the triangles of {whose} have type {triangles.dtype}; wanted vertex indices"
            )
        if triangles.min() < 0 or triangles.max() >= len(positions):
            raise ValueError(
                f"the triangles of {whose} refer to vertices {triangles.min()} to "
                f"{triangles.max()}, but its vertices are 0 to {len(positions) - 1}"
            )
        object.__setattr__(self, "positions", positions)
        object.__setattr__(self, "triangles", triangles.astype(np.int64))


Fixture = FixtureBox | FixtureMesh


def bounds_of(fixture: Fixture) -> FloatArray:
    """Return the lowest and the highest corner of a fixture [m], shape (2, 3)."""
    if isinstance(fixture, FixtureBox):
        half = 0.5 * np.abs(fixture.rotation) @ fixture.size
        return np.array([fixture.centre - half, fixture.centre + half])
    return np.array([fixture.positions.min(axis=0), fixture.positions.max(axis=0)])
