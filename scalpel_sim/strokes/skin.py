"""Places on the skin of a body at rest, and where they are in the body as it lies."""

from typing import NamedTuple, Self

import numpy as np

from tissue import FloatArray, IntArray, TetrahedralMesh, boundary_faces

_ROUNDING = 1e-9
"""Weight by which a line may miss a face and still meet it: it may pass between two faces."""

_ALONG = 1e-12
"""Sine of the angle to a face below which a line runs along it, and meets no inside of it."""


class SkinPlace(NamedTuple):
    """A place on a face of the skin."""

    face: int
    """Index of the face."""
    weights: FloatArray
    """Barycentric weights of its corners, shape (3,)."""


class BodySkin(NamedTuple):
    """The faces of a body, at rest and as it lies."""

    at_rest: FloatArray
    """Corners of the faces at rest, counter-clockwise seen from outside [m], shape (n, 3, 3)."""
    lying: FloatArray
    """The same corners in the body as it lies [m], shape (n, 3, 3)."""

    @classmethod
    def of(cls, mesh: TetrahedralMesh, rest: FloatArray | None = None) -> Self:
        """Return the skin of a body.

        Args:
            mesh: The body as it lies, tissue frame [m].
            rest: Its nodes at rest [m], shape (n_nodes, 3); None: it lies at rest.
        """
        faces: IntArray = boundary_faces(mesh.tetrahedra)
        return cls((mesh.positions if rest is None else rest)[faces], mesh.positions[faces])

    def entered_at(self, place: FloatArray, direction: FloatArray) -> SkinPlace | None:
        """Return where a line enters the body at rest, nearest to a place on it; None: nowhere.

        Args:
            place: A place on the line [m], shape (3,).
            direction: Unit vector along the line, into the body, shape (3,).
        """
        faces, ways, weights = _entries(self.at_rest, place, direction)
        if len(faces) == 0:
            return None
        nearest = int(np.argmin(np.abs(ways)))
        return SkinPlace(int(faces[nearest]), weights[nearest])

    def seen_from(self, eye: FloatArray, direction: FloatArray) -> SkinPlace | None:
        """Return what a ray meets first of the body as it lies; None: nothing.

        Args:
            eye: Where the ray begins [m], shape (3,).
            direction: Unit vector along it, shape (3,).
        """
        faces, ways, weights = _entries(self.lying, eye, direction)
        ahead = np.flatnonzero(ways > 0.0)
        if len(ahead) == 0:
            return None
        first = int(ahead[np.argmin(ways[ahead])])
        return SkinPlace(int(faces[first]), weights[first])

    def rest_place(self, place: SkinPlace) -> FloatArray:
        """Return where a place of the skin is at rest [m], shape (3,)."""
        return np.asarray(place.weights @ self.at_rest[place.face])

    def lying_place(self, place: SkinPlace) -> FloatArray:
        """Return where a place of the skin is in the body as it lies [m], shape (3,)."""
        return np.asarray(place.weights @ self.lying[place.face])


def _entries(
    corners: FloatArray, start: FloatArray, direction: FloatArray
) -> tuple[IntArray, FloatArray, FloatArray]:
    """Return the faces through which a line enters, the ways there [m], and the weights there.

    After Moeller and Trumbore 1997, J. Graphics Tools 2:21.

    Args:
        corners: Of each face, counter-clockwise seen from outside [m], shape (n, 3, 3).
        start: Where the ways begin [m], shape (3,).
        direction: Unit vector along the line, shape (3,).
    """
    origin = corners[:, 0]
    along, across = corners[:, 1] - origin, corners[:, 2] - origin
    normal = np.cross(along, across)
    against = -(normal @ direction)
    is_entry = against > _ALONG * np.linalg.norm(normal, axis=1)
    faces = np.flatnonzero(is_entry)
    offset = start - origin[faces]
    turned = np.cross(offset, direction)
    facing = against[faces]
    u = np.einsum("ni,ni->n", across[faces], turned) / facing
    v = -np.einsum("ni,ni->n", along[faces], turned) / facing
    inside = (np.minimum(u, v) >= -_ROUNDING) & (u + v <= 1.0 + _ROUNDING)
    ways = np.einsum("ni,ni->n", offset, normal[faces]) / facing
    weights = np.column_stack([1.0 - u - v, u, v])
    return faces[inside], ways[inside], weights[inside]
