"""Connected pieces of the surface of a body."""

from typing import NamedTuple

import numpy as np

from tissue import FloatArray, IntArray, Surface


class SurfacePiece(NamedTuple):
    """The closed surface of one connected piece of the body."""

    name: str
    """`piece_1` for the largest at rest, and so on."""
    surface: Surface
    """Surface of this piece alone, with vertices of its own."""


def surface_pieces(surface: Surface) -> list[SurfacePiece]:
    """Return the closed surface of each connected piece of the body, the largest at rest first."""
    piece = piece_of_vertices(surface)
    of_triangle = piece[surface.triangles[:, 0]]
    found = []
    for number in range(int(piece.max()) + 1):
        vertices, triangles = np.flatnonzero(piece == number), of_triangle == number
        place = np.empty(len(piece), dtype=np.int64)
        place[vertices] = np.arange(len(vertices))
        part = surface.part(triangles)
        own = part._replace(
            positions=surface.positions[vertices],
            rest_positions=surface.rest_positions[vertices],
            triangles=place[part.triangles],
        )
        found.append(SurfacePiece(f"piece_{number + 1}", own))
    return found


def piece_of_vertices(surface: Surface) -> IntArray:
    """Return the number of the piece of each vertex, from 0, the largest at rest first.

    Triangles that hang together through vertices are one closed shell, and pieces share no vertex.
    A shell that encloses a negative volume is a cavity: it belongs to the piece around it.
    """
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import connected_components

    a, b, c = surface.triangles.T
    n = len(surface.positions)
    edges = np.concatenate([a, b]), np.concatenate([b, c])
    n_shells, shell = connected_components(csr_array((np.ones(2 * len(a)), edges), shape=(n, n)))
    corners = surface.rest_positions[surface.triangles]
    volumes = np.bincount(shell[a], np.linalg.det(corners) / 6.0, n_shells)
    outer = np.flatnonzero(volumes > 0.0)
    outer = outer[np.argsort(-volumes[outer], kind="stable")]
    piece = np.empty(n_shells, dtype=np.int64)
    piece[outer] = np.arange(len(outer))
    for cavity in np.flatnonzero(volumes <= 0.0):
        point = surface.rest_positions[shell == cavity][0]
        around = [_winding_number(point, corners[shell[a] == each]) for each in outer]
        piece[cavity] = int(np.argmax(around))
    found: IntArray = piece[shell]
    return found


def _winding_number(point: FloatArray, corners: FloatArray) -> float:
    """Return how often closed triangles, shape (n, 3, 3), surround a point: 1 inside, 0 outside.

    Source: A. Van Oosterom, J. Strackee, "The solid angle of a plane triangle", 1983.
    """
    a, b, c = np.moveaxis(corners - point, 1, 0)
    la, lb, lc = (np.linalg.norm(side, axis=1) for side in (a, b, c))
    ab, bc, ca = (np.einsum("ij,ij->i", *pair) for pair in ((a, b), (b, c), (c, a)))
    angle = np.arctan2(
        np.linalg.det(np.stack([a, b, c], 1)), la * lb * lc + ab * lc + bc * la + ca * lb
    )
    return float(angle.sum() / (2.0 * np.pi))
