"""Places on the skin of a body at rest, and where they are in the body as it lies."""

from typing import NamedTuple, Self

import numpy as np

from tissue import FloatArray, IntArray, TetrahedralMesh, boundary_faces


class SkinPlace(NamedTuple):
    """A place on a face of the skin."""

    face: int
    """Index of the face."""
    weights: FloatArray
    """Barycentric weights of its corners, shape (3,)."""


class SkinPlaces(NamedTuple):
    """Places on faces of the skin."""

    faces: IntArray
    """Index of the face of each; -1 where there is none, shape (n,)."""
    weights: FloatArray
    """Barycentric weights of its corners, shape (n, 3)."""

    def place(self, i: int) -> SkinPlace | None:
        """Return one of them; None where there is none."""
        return SkinPlace(int(self.faces[i]), self.weights[i]) if self.faces[i] >= 0 else None


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
        return self.entered_along(place[None], direction).place(0)

    def entered_along(self, places: FloatArray, direction: FloatArray) -> SkinPlaces:
        """Return where parallel lines enter the body at rest, nearest to a place on each.

        Args:
            places: A place on each line [m], shape (n, 3).
            direction: Unit vector along the lines, into the body, shape (3,).
        """
        return _entries(self.at_rest, places, direction, is_ahead=False)

    def seen_from(self, eye: FloatArray, direction: FloatArray) -> SkinPlace | None:
        """Return what a ray meets first of the body as it lies; None: nothing.

        Args:
            eye: Where the ray begins [m], shape (3,).
            direction: Unit vector along it, shape (3,).
        """
        return _entries(self.lying, eye[None], direction, is_ahead=True).place(0)

    def rest_place(self, place: SkinPlace) -> FloatArray:
        """Return where a place of the skin is at rest [m], shape (3,)."""
        return np.asarray(place.weights @ self.at_rest[place.face])

    def rest_places(self, places: SkinPlaces) -> FloatArray:
        """Return where places of the skin are at rest [m], shape (n, 3)."""
        return np.asarray(np.einsum("nk,nkx->nx", places.weights, self.at_rest[places.faces]))

    def lying_place(self, place: SkinPlace) -> FloatArray:
        """Return where a place of the skin is in the body as it lies [m], shape (3,)."""
        return np.asarray(place.weights @ self.lying[place.face])


def _entries(
    corners: FloatArray, starts: FloatArray, direction: FloatArray, *, is_ahead: bool
) -> SkinPlaces:
    """Return where lines enter a skin, of several places the one nearest to where they start.

    Args:
        corners: Of each face, counter-clockwise seen from outside [m], shape (n_faces, 3, 3).
        starts: A place on each line [m], shape (n, 3).
        direction: Unit vector along the lines, shape (3,).
        is_ahead: Whether only places ahead of the start count.
    """
    from tissue.support import write_entries  # a kernel: a scene is read without the compiler

    n = len(starts)
    found = SkinPlaces(np.empty(n, np.int64), np.zeros((n, 3)))
    given = (np.require(each, np.float64, ["C", "W"]) for each in (corners, starts, direction))
    in_a_row, begins, way = given
    write_entries(in_a_row.reshape(-1, 3), begins, way, is_ahead, *found, np.empty(n))
    return found
