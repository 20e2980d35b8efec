"""`RigidBody`: what is exported beside the tissue, such as a link of an arm."""

from collections.abc import Sequence
from typing import NamedTuple

from tissue import FloatArray, IntArray

ROUGHNESS = 0.5
"""Roughness of tissue and arms, from 0, a mirror, to 1."""

STEEL_ROUGHNESS = 0.25
"""Roughness of the blade and of the pads of graspers. They are not metal: that would be black where
there is no room to reflect."""


class RigidPart(NamedTuple):
    """Triangles of one colour."""

    name: str
    """Its name."""
    positions: FloatArray
    """Vertices [m], frame of the body, shape (n_vertices, 3)."""
    triangles: IntArray
    """Vertex numbers, shape (n_triangles, 3)."""
    normals: FloatArray
    """Unit normals of the vertices, frame of the body, shape (n_vertices, 3)."""
    colour: tuple[int, ...]
    """Red, green, blue and opacity, 0 to 255 (sRGB)."""
    roughness: float = ROUGHNESS
    """From 0, a mirror, to 1."""


class RigidBody(NamedTuple):
    """Parts that move together."""

    name: str
    """Its name."""
    pose: FloatArray
    """Transform from its frame to that of the tissue [m], shape (4, 4)."""
    parts: Sequence[RigidPart]
    """Its visible parts."""
    is_fixed: bool
    """Whether it is part of the surroundings, such as a table, and not of an arm."""


def group_of(body: RigidBody) -> str:
    """Return the name of the node that a body hangs on."""
    return "surroundings" if body.is_fixed else "arm"
