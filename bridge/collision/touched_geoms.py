"""Geoms that a tissue in this process touches, behind a broad phase."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import fcl
import numpy as np

from bridge.collision.collision_objects import MovableBox, Obstacles
from bridge.collision.swept_box import SweptBox
from bridge.driven import GeomLoads, GeomPoses
from tissue import BoolArray, FloatArray, Geom, GeomForces

if TYPE_CHECKING:  # the side without the tissue starts without its compiler
    from tissue import Tissue

NODE_SIZES_AROUND = 3.0
"""Distance from the body, in mean node sizes, at which a geom is taken for near: for faces that it
may touch between their corners, and for what moves faster in the step than before."""

SLACK = 1.0
"""Motion of geoms and tissue, in mean node sizes, after which the collision library is queried
again. Larger: more geoms are taken for near; smaller: a call of 0.1 ms in more frames."""


class TouchedGeoms:
    """Contact of a tissue with driven geoms; tissue frame.

    Args:
        tissue: The tissue, which touches no other geoms from now on.
        geoms: The geoms.
        poses: Where they are.

    Raises:
        ValueError: see `tissue.Tissue.collide_with`.
    """

    def __init__(self, tissue: Tissue, geoms: Sequence[Geom], poses: GeomPoses) -> None:
        self._tissue = tissue
        self._contact = tissue.collide_with(geoms, *poses)  # which checks the geoms
        self._near = NearGeoms(geoms, tissue.node_size)

    def move(self, poses: GeomPoses) -> None:
        """Move the geoms to their poses at the end of the next step, at even speeds.

        Raises:
            ValueError: see `tissue.GeomContact.move`.
        """
        self._contact.move(*poses)
        near = self._near.near(*poses, self._tissue.bounds)
        if near is not None:
            self._contact.consider(near)

    @property
    def loads(self) -> GeomLoads:
        """Forces of the tissue on the geoms in the last step."""
        return GeomLoads(*self._contact.wrenches())

    def forces(self) -> GeomForces:
        """Return where the tissue touched them in the last step, and with which forces."""
        return self._contact.forces()


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
        self._queried_at: tuple[FloatArray, FloatArray, FloatArray] | None = None

    def near(
        self, origins: FloatArray, rotations: FloatArray, bounds: FloatArray
    ) -> BoolArray | None:
        """Return which geoms may touch the tissue in a step, shape (n,); None: as before.

        Args:
            origins: Origins of the geoms at its end [m], tissue frame, shape (n, 3).
            rotations: Their axes as columns, shape (n, 3, 3).
            bounds: Lowest and highest corner of the tissue at its begin [m], shape (2, 3).
        """
        queried_at = self._queried_at
        if queried_at is not None:
            shifts = np.abs(origins - queried_at[0]).sum(axis=1)
            shifts += self._radii * np.abs(rotations - queried_at[1]).max(axis=(1, 2), initial=0.0)
            moved = float(shifts.max(initial=0.0)) + float(np.abs(bounds - queried_at[2]).max())
            if moved <= self._slack:
                return None
        self._queried_at = (origins, rotations, bounds.copy())
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
