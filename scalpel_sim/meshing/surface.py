"""A surface from a file of triangles: read, tidied, and refused where it encloses nothing."""

import warnings
from pathlib import Path
from typing import NamedTuple

import numpy as np

from scalpel_sim.errors import UsageError
from scalpel_sim.meshing.units import scale_of
from tissue import FloatArray, IntArray

SURFACE_FILES = (".stl", ".obj", ".ply", ".glb")
"""Suffixes of the files of surfaces that are read."""

SAME_PLACE = 1e-7
"""Vertices that are nearer to each other than this share of the size are one. Single precision, in
which most files are written, has that many digits."""

MOST_OPEN_EDGES = 0.5
"""Share of the edges with a triangle on one side alone, from which the triangles form no surface:
of separate triangles all edges are open, of a closed grid without every tenth triangle a fifth."""

MOST_OPEN_AREA = 0.4
"""Area of the holes, seen flat, per area of the surface, from which it is unclear what it encloses:
a box without its lid has 0.2, half a sphere 0.5, a sheet 1."""

LEAST_THICKNESS = 1e-4
"""Mean thickness per size, below which a surface is a sheet: a tissue of 100 mm that is thinner
than 0.01 mm cannot be cut with tetrahedra of any use."""

ELLIPSOID_OF_BOX = np.pi / 6.0
"""Volume of an ellipsoid per that of the box around it."""


class FileSurface(NamedTuple):
    """Triangles that enclose a body, perhaps with holes, and what was found amiss."""

    vertices: FloatArray
    """Shape (n_vertices, 3), in metres if `read_surface` had the scale of the file."""
    triangles: IntArray
    """Indices of vertices, shape (n_triangles, 3)."""
    notes: tuple[str, ...] = ()
    """Lines on what was mended, and what the mesher will close."""

    def size(self) -> float:
        """Return the diagonal of the box around it [m]."""
        return float(np.linalg.norm(np.ptp(self.vertices, axis=0)))

    def area(self) -> float:
        """Return the area of all triangles [m2]."""
        return float(np.linalg.norm(self._area_vectors(), axis=1).sum())

    def open_area(self) -> float:
        """Return the area of the holes, seen flat, per that of the surface; 0: it is closed."""
        return float(np.linalg.norm(self._area_vectors().sum(axis=0))) / max(self.area(), _TINY)

    def volume(self) -> float:
        """Return the volume inside [m3], an estimate where the surface has holes.

        Where triangles face either way, the volume of an ellipsoid in the box around it.
        """
        if not _face_one_way(self.triangles):
            return float(ELLIPSOID_OF_BOX * np.prod(np.ptp(self.vertices, axis=0)))
        corners = (self.vertices - self.vertices.mean(axis=0))[self.triangles]
        return abs(float(np.linalg.det(corners).sum())) / 6.0

    def thickness(self) -> float:
        """Return the mean thickness [m]: that of a wide plate, two thirds of a ball's radius."""
        return 2.0 * self.volume() / max(self.area(), _TINY)

    def is_closed(self) -> bool:
        """Return whether it has no open edge, and its triangles face one way."""
        return not _open_edges(self.triangles)[0] and _face_one_way(self.triangles)

    def _area_vectors(self) -> FloatArray:
        """Return the normal of each triangle, as long as its area."""
        a, b, c = self.vertices[self.triangles].swapaxes(0, 1)
        vectors: FloatArray = 0.5 * np.cross(b - a, c - a)
        return vectors


_STL_HEADER, _STL_TRIANGLE = 84, 50
"""Bytes of a binary STL file before its triangles, and of each triangle."""

_TINY = float(np.finfo(np.float64).tiny)


def read_surface(path: Path, scale: float | None) -> FileSurface:
    """Return the surface in a file, with its vertices in metres.

    Args:
        path: One of `SURFACE_FILES`. All bodies of a GLB scene are taken, in their places.
        scale: Unit of the file in metres. None: metres, where that makes sense.

    Raises:
        UsageError: the file holds no triangles, these enclose no body, or the unit has to be given.
    """
    if path.suffix.lower() == ".stl":
        _expect_whole_stl(path)
    vertices, triangles = _loaded(path)
    if not len(triangles):
        raise UsageError(f"{path}: there are no triangles in it; {_beginning(path)}")
    used = np.unique(triangles)
    wrong = used[~np.isfinite(vertices[used]).all(axis=1)]
    if wrong.size:
        raise UsageError(
            f"{path}: {wrong.size} of {used.size} vertices have a coordinate that is NaN or "
            f"infinite, the first is vertex {wrong[0]}; export the surface again"
        )
    width = float(np.ptp(vertices[used], axis=0).max())
    if width == 0.0:
        raise UsageError(f"{path}: all triangles are in one point: there is no body")
    surface = tidied(scale_of(path, width, scale) * vertices, triangles)
    _expect_body(path, surface)
    return surface


def _expect_whole_stl(path: Path) -> None:
    """Check that an STL file is as long as its header says; its reader takes what it finds.

    Raises:
        UsageError: it is not.
    """
    with path.open("rb") as file:
        start = file.read(_STL_HEADER)
    if start.lstrip().lower().startswith(b"solid") or len(start) < _STL_HEADER:
        return  # a text, or too short for any triangle
    size, n = path.stat().st_size, int.from_bytes(start[-4:], "little")
    if size != (whole := _STL_HEADER + _STL_TRIANGLE * n):
        raise UsageError(
            f"{path}: this is no STL file, or it is cut short: it would have {n:,} triangles and "
            f"{whole:,} bytes, and it has {size:,} bytes"
        )


def _beginning(path: Path) -> str:
    """Return what to say of the first bytes of a file."""
    with path.open("rb") as file:
        start = file.read(40)
    return f"it begins with {start!r}" if start else "it is empty"


def _loaded(path: Path) -> tuple[FloatArray, IntArray]:
    """Return vertices and triangles as they are in a file."""
    import trimesh

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of divisions by the size of an empty surface
            loaded = trimesh.load(path, force="mesh", process=False, skip_materials=True)
    except MemoryError:
        raise
    except Exception as error:  # the readers of trimesh raise whatever they meet
        reason = " ".join(str(error).split())[:120] or type(error).__name__
        raise UsageError(
            f"{path}: this is no {path.suffix[1:].upper()} file, or it is cut short ({reason})"
        ) from error
    vertices = np.asarray(getattr(loaded, "vertices", ()), dtype=np.float64).reshape(-1, 3)
    triangles = np.asarray(getattr(loaded, "faces", ()), dtype=np.int64).reshape(-1, 3)
    if triangles.size and not 0 <= triangles.min() <= triangles.max() < len(vertices):
        raise UsageError(
            f"{path}: a triangle names vertex {triangles.max()}, and there are {len(vertices)}"
        )
    return vertices, triangles


def tidied(vertices: FloatArray, triangles: IntArray) -> FileSurface:
    """Return a surface whose vertices are in places of their own and whose triangles occur once.

    Args:
        vertices: Shape (n, 3), finite.
        triangles: Indices of them, shape (n_triangles, 3).
    """
    used, inverse = np.unique(triangles, return_inverse=True)
    vertices, triangles = vertices[used], inverse.reshape(-1, 3)
    lowest, size = vertices.min(axis=0), float(np.linalg.norm(np.ptp(vertices, axis=0)))
    cells = np.round((vertices - lowest) / max(SAME_PLACE * size, _TINY))
    _, first, place = np.unique(cells, axis=0, return_index=True, return_inverse=True)
    vertices, triangles = vertices[first], place.ravel()[triangles]
    in_order = np.sort(triangles, axis=1)
    is_flat = (in_order[:, 1:] == in_order[:, :-1]).any(axis=1)
    _, kept = np.unique(in_order, axis=0, return_index=True)
    kept = np.sort(kept)
    kept = kept[~is_flat[kept]]
    notes = []
    if n_flat := int(is_flat.sum()):
        notes.append(f"dropped {n_flat} triangles without an area")
    if n_again := len(triangles) - len(kept) - n_flat:
        notes.append(f"dropped {n_again} triangles that are there twice")
    return FileSurface(vertices, triangles[kept], tuple(notes))


def _expect_body(path: Path, surface: FileSurface) -> None:
    """Check that a surface encloses a body.

    Raises:
        UsageError: it does not.
    """
    if not len(surface.triangles) or surface.area() == 0.0:
        raise UsageError(f"{path}: all triangles are in one line: there is no body")
    n_open, n_edges = _open_edges(surface.triangles)
    if n_open >= MOST_OPEN_EDGES * n_edges:
        raise UsageError(
            f"{path}: the triangles form no closed surface: {n_open} of {n_edges} edges have a "
            "triangle on one side only. Join and close them in a mesh editor first"
        )
    if not _face_one_way(surface.triangles):
        return
    if surface.open_area() > MOST_OPEN_AREA:
        raise UsageError(
            f"{path}: the surface is open: its holes have {surface.open_area():.0%} of its area, "
            "and it is unclear what it encloses. Close them in a mesh editor first"
        )
    if surface.thickness() < LEAST_THICKNESS * surface.size():
        raise UsageError(
            f"{path}: the surface encloses no volume: it is a sheet, {surface.size() * 1e3:.3g} mm "
            f"wide and {surface.thickness() * 1e3:.2g} mm thick. Give it a thickness first"
        )


def with_notes_on_holes(surface: FileSurface) -> FileSurface:
    """Return a surface with a note on what the mesher has to close and to turn."""
    notes = list(surface.notes)
    if n_open := _open_edges(surface.triangles)[0]:
        notes.append(f"closed the surface along {n_open} open edges")
    if not _face_one_way(surface.triangles):
        notes.append("triangles faced either way; what is inside was found without that")
    return surface._replace(notes=tuple(notes))


def _edges(triangles: IntArray) -> IntArray:
    """Return the directed edges of triangles, shape (3 n_triangles, 2)."""
    edges: IntArray = triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    return edges


def _open_edges(triangles: IntArray) -> tuple[int, int]:
    """Return how many edges have a triangle on one side only, and how many there are."""
    _, counts = np.unique(np.sort(_edges(triangles), axis=1), axis=0, return_counts=True)
    return int((counts == 1).sum()), len(counts)


def _face_one_way(triangles: IntArray) -> bool:
    """Return whether no two triangles go through an edge in the same direction."""
    edges = _edges(triangles)
    return len(np.unique(edges, axis=0)) == len(edges)
