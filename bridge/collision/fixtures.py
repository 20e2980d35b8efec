"""What stands around the tissue and must not meet the blade: the table, clamps, retractors."""

from dataclasses import dataclass, field

import numpy as np

from bridge.input_checks import finite, rotation
from tissue import FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class FixtureBox:
    """A solid box.

    Raises:
        ValueError: a shape is wrong, a number is not finite, the box is flat, or its rotation is
            none. (The collision library takes all of these silently.)
    """

    name: str
    size: FloatArray
    """Whole lengths of its edges [m], shape (3,)."""
    centre: FloatArray
    """[m], shape (3,)."""
    rotation: FloatArray = field(default_factory=lambda: np.eye(3))
    """Its axes as columns, shape (3, 3)."""

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
    """A triangulated surface. Only the surface can be met, not what it encloses.

    Raises:
        ValueError: a shape is wrong, a number is not finite, there is no triangle, or one names a
            vertex that is not there. (In the collision library that would end the process.)
    """

    name: str
    positions: FloatArray
    """[m], shape (n_vertices, 3)."""
    triangles: IntArray
    """Vertex indices, shape (n_triangles, 3)."""

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
                f"the triangles of {whose} name vertices {triangles.min()} to {triangles.max()}, "
                f"but its vertices are 0 to {len(positions) - 1}"
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
