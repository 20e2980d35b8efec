"""Geoms that a tissue in this process touches, behind a broad phase."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from bridge.collision.near_geoms import NearGeoms
from bridge.led_geoms import GeomLoads, GeomPoses
from tissue import Geom, GeomForces

if TYPE_CHECKING:  # the side without the tissue starts without its compiler
    from tissue import Tissue


class TouchedGeoms:
    """Contact of a tissue with geoms that are led from outside; tissue frame.

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
        """Lead the geoms to where they are at the end of the next step, at even speeds.

        Raises:
            ValueError: see `tissue.GeomContact.move`.
        """
        self._contact.move(*poses)
        near = self._near.near(*poses, self._tissue.bounds)
        if near is not None:
            self._contact.consider(near)

    @property
    def loads(self) -> GeomLoads:
        """What the tissue did to the geoms in the last step."""
        return GeomLoads(*self._contact.wrenches())

    def forces(self) -> GeomForces:
        """Return where the tissue touched them in the last step, and with which forces."""
        return self._contact.forces()
