"""Broad phase of rigid geoms and tissue: which of them may touch in a step.

The filter is conservative: what it leaves out would touch nothing.
"""

from collections.abc import Sequence

import fcl
import numpy as np

from bridge.collision.collision_objects import MovableBox, Obstacles
from bridge.collision.swept_box import SweptBox
from tissue import BoolArray, FloatArray, Geom

NODE_SIZES_AROUND = 3.0
"""How far from the body, in mean node sizes, a geom is looked at for faces that it may touch
between their corners, and for what moves faster in the step than it did before it."""

SLACK = 1.0
"""How far geoms and tissue may move, in mean node sizes, until the collision library is asked
again. Larger: more geoms are taken for near; smaller: a call of 0.1 ms in more frames."""


class NearGeoms:
    """Boxes around geoms, and the one around the tissue.

    Args:
        geoms: The geoms.
        node_size: Mean node size of the tissue [m].
    """

    def __init__(self, geoms: Sequence[Geom], node_size: float) -> None:
        self._margin = (NODE_SIZES_AROUND + SLACK) * node_size
        self._slack = SLACK * node_size
        self._is_plane = np.array([geom.shape == "plane" for geom in geoms], dtype=np.bool_)
        boxes = [geom.box() for geom in geoms]
        self._middles = np.array([middle for middle, _ in boxes]).reshape(-1, 3)
        shapes = {
            geom.name: fcl.Box(*(2.0 * half))
            for geom, (_, half) in zip(geoms, boxes, strict=True)
            if geom.shape != "plane"
        }
        self._names = [geom.name for geom in geoms]
        self._objects = {
            name: fcl.CollisionObject(shape, fcl.Transform()) for name, shape in shapes.items()
        }
        self._obstacles = Obstacles({name: (shapes[name], self._objects[name]) for name in shapes})
        self._tissue = MovableBox()
        reaches = np.array([np.abs(middle) + half for middle, half in boxes]).reshape(-1, 3)
        radii = np.linalg.norm(reaches, axis=1)
        # Where no element of a rotation changes by more than d, no point moves by 3 d radius.
        self._radii = 3.0 * np.where(np.isfinite(radii), radii, 0.0)
        self._asked: tuple[FloatArray, FloatArray, FloatArray] | None = None

    def near(
        self, origins: FloatArray, rotations: FloatArray, bounds: FloatArray
    ) -> BoolArray | None:
        """Return which geoms may touch the tissue in a step, shape (n,); None: as before.

        Args:
            origins: Origins of the geoms at its end [m], tissue frame, shape (n, 3).
            rotations: Their axes as columns, shape (n, 3, 3).
            bounds: Lowest and highest corner of the tissue at its begin [m], shape (2, 3).
        """
        asked = self._asked
        if asked is not None:
            ways = np.abs(origins - asked[0]).sum(axis=1)
            ways += self._radii * np.abs(rotations - asked[1]).max(axis=(1, 2), initial=0.0)
            moved = float(ways.max(initial=0.0)) + float(np.abs(bounds - asked[2]).max())
            if moved <= self._slack:
                return None
        self._asked = (origins, rotations, bounds.copy())
        return self._found(origins, rotations, bounds)

    def _found(self, origins: FloatArray, rotations: FloatArray, bounds: FloatArray) -> BoolArray:
        """Return which geoms are within the margin of the box around the tissue."""
        low, high = bounds
        found: BoolArray = np.zeros(len(self._names), dtype=np.bool_)
        margin = self._margin
        if self._is_plane.any():
            normals = rotations[:, :, 2]
            centre, half = 0.5 * (low + high), 0.5 * (high - low) + margin
            nearest = ((centre - origins) * normals).sum(axis=1) - np.abs(normals) @ half
            found |= self._is_plane & (nearest <= 0.0)
        middles = origins + np.einsum("nij,nj->ni", rotations, self._middles)
        for name, middle, axes in zip(self._names, middles, rotations, strict=True):
            if name in self._objects:
                self._objects[name].setTransform(fcl.Transform(axes, middle))
        self._obstacles.update()
        self._tissue.place(SweptBox(0.5 * (low + high), high - low + 2.0 * margin, np.eye(3)))
        touched = self._obstacles.colliding_with(self._tissue.object)
        return found | np.array([name in touched for name in self._names], dtype=np.bool_)
