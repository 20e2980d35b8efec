"""What an arm is made of, for the collision library: its links, the handle, the blade's body."""

import math
from dataclasses import dataclass
from typing import Literal, get_args

import fcl
import numpy as np

from tissue import FloatArray

Kind = Literal["box", "sphere", "capsule", "cylinder"]

N_SIZES = {"box": 3, "sphere": 1, "capsule": 2, "cylinder": 2}
"""How many numbers say how large each is."""


@dataclass(frozen=True)
class Part:
    """A rigid body of one simple shape, centred on its own origin.

    Raises:
        ValueError: there is no such shape, or a size is missing or not positive.
    """

    name: str
    kind: Kind
    sizes: tuple[float, ...]
    """[m], as MuJoCo has them: half the lengths of a box; the radius of a sphere; radius, and half
    the length along z without the caps, of a capsule or cylinder."""
    is_instrument: bool = False
    """Whether it is the blade or what holds it, which must not meet the arm either."""
    may_meet_instrument: bool = True
    """Whether it is news that the instrument meets it: not of the links next to it, which do."""
    may_meet_fixtures: bool = True
    """Whether it is news that it meets a fixture: not of what stands on one."""

    def __post_init__(self) -> None:
        if self.kind not in get_args(Kind):
            raise ValueError(
                f"part {self.name!r} is a {self.kind!r}; wanted one of {', '.join(get_args(Kind))}"
            )
        if len(self.sizes) != N_SIZES[self.kind] or not all(
            math.isfinite(size) and size > 0.0 for size in self.sizes
        ):
            raise ValueError(
                f"part {self.name!r} has the sizes {self.sizes} m; a {self.kind} has "
                f"{N_SIZES[self.kind]}, all positive"
            )

    @property
    def half_extents(self) -> FloatArray:
        """Of the box around it, along its own axes [m], shape (3,)."""
        if self.kind == "box":
            return np.array(self.sizes)
        radius = self.sizes[0]
        half_length = self.sizes[1] if len(self.sizes) > 1 else 0.0
        caps = 0.0 if self.kind == "cylinder" else radius
        return np.array([radius, radius, half_length + caps])

    def geometry(self) -> fcl.CollisionGeometry:
        """Return a new geometry of the collision library."""
        if self.kind == "box":
            return fcl.Box(*(2.0 * size for size in self.sizes))
        if self.kind == "sphere":
            return fcl.Sphere(self.sizes[0])
        shape = fcl.Capsule if self.kind == "capsule" else fcl.Cylinder
        return shape(self.sizes[0], 2.0 * self.sizes[1])
