"""The collision shapes of an arm: those of its bodies, of the handle and of the blade."""

import math
from dataclasses import dataclass
from typing import Literal, get_args

import fcl
import numpy as np

from tissue import FloatArray

GeomShape = Literal["box", "sphere", "capsule", "cylinder"]

SIZES_PER_SHAPE = {"box": 3, "sphere": 1, "capsule": 2, "cylinder": 2}
"""Number of sizes of each shape."""


@dataclass(frozen=True)
class ArmGeom:
    """A rigid body of one simple shape, centred on its own origin: a geom in MuJoCo's words.

    Raises:
        ValueError: the shape is unknown, or a size is missing or not positive.
    """

    name: str
    """Name of the geom, in reports."""
    shape: GeomShape
    """Shape of the geom."""
    sizes: tuple[float, ...]
    """Sizes [m], in MuJoCo's order: half the lengths of a box; the radius of a sphere; the radius
    and half the length along z, without the caps, of a capsule or cylinder."""
    is_instrument: bool = False
    """Whether the geom belongs to the blade or its handle, which must not touch the arm either."""
    checked_against_instrument: bool = True
    """Whether a collision with the instrument is reported: False next to it, where geoms always
    overlap."""
    checked_against_fixtures: bool = True
    """Whether a collision with a fixture is reported: False for a geom that stands on one."""

    def __post_init__(self) -> None:
        if self.shape not in get_args(GeomShape):
            raise ValueError(
                f"geom {self.name!r} is a {self.shape!r}; wanted one of "
                f"{', '.join(get_args(GeomShape))}"
            )
        if len(self.sizes) != SIZES_PER_SHAPE[self.shape] or not all(
            math.isfinite(size) and size > 0.0 for size in self.sizes
        ):
            raise ValueError(
                f"geom {self.name!r} has the sizes {self.sizes} m; a {self.shape} has "
                f"{SIZES_PER_SHAPE[self.shape]}, all positive"
            )

    @property
    def half_extents(self) -> FloatArray:
        """Half the size of the geom's bounding box along its own axes [m], shape (3,)."""
        if self.shape == "box":
            return np.array(self.sizes)
        radius = self.sizes[0]
        half_length = self.sizes[1] if len(self.sizes) > 1 else 0.0
        caps = 0.0 if self.shape == "cylinder" else radius
        return np.array([radius, radius, half_length + caps])

    def geometry(self) -> fcl.CollisionGeometry:
        """Return a new geometry of the collision library."""
        if self.shape == "box":
            return fcl.Box(*(2.0 * size for size in self.sizes))
        if self.shape == "sphere":
            return fcl.Sphere(self.sizes[0])
        make = fcl.Capsule if self.shape == "capsule" else fcl.Cylinder
        return make(self.sizes[0], 2.0 * self.sizes[1])
