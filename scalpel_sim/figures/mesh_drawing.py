"""A line drawing of a mesh: edges are pale behind faces, and the faces of cuts are red."""

import numpy as np

from scalpel_sim.camera.canvas import Canvas, PixelSize
from scalpel_sim.camera.finishes import Finish
from scalpel_sim.camera.lights import Light, Rgb
from scalpel_sim.camera.viewpoints import Viewpoint
from scalpel_sim.figures.framing import pixel_at
from scalpel_sim.viewer.primitives import TriangleMesh
from tissue import FloatArray, IntArray, Snapshot, Surface

_PAPER = (1.0, 1.0, 1.0)
"""Colour of the background (sRGB)."""
SKIN_FACE, CUT_FACE = (0.955, 0.96, 0.97), (1.0, 0.86, 0.84)
"""Colours of skin and of cut faces (sRGB)."""
SKIN_LINE, CUT_LINE = (0.13, 0.16, 0.22), (0.75, 0.10, 0.10)
"""Colours of edges of the skin and of edges of cut faces (sRGB)."""
HIDDEN = 0.13
"""Opacity of lines behind faces: they show how deep the mesh goes, without confusing the eye."""
_THICKNESS = 1.3
"""Thickness of the lines [pixels]."""
_NO_LIGHT = Light((0.0, 0.0, -1.0), (0.0,) * 3, (0.0,) * 3)
"""With no lamp at all MuJoCo's renderer has some light of its own."""
_SAMPLES, _FINE = 4, 2
"""Samples of each pixel by the renderer, and along each side of a pixel besides."""


def draw_mesh(view: Viewpoint, size: PixelSize, body: Snapshot, surface: Surface) -> FloatArray:
    """Return a drawing of the mesh, sRGB from 0 to 1, shape (height, width, 3).

    Args:
        view: Where from, tissue frame.
        size: PixelSize of the picture.
        body: State of the body whose edges are drawn.
        surface: Surface of the body, which hides the edges behind it.

    Raises:
        RenderError: OpenGL is missing.
    """
    width = _THICKNESS * pixel_at(view, size)
    skin, cut = surface.triangles[~surface.is_cut], surface.triangles[surface.is_cut]
    at = surface.positions
    faces = {"skin": (_flat(at, skin), SKIN_FACE), "cut": (_flat(at, cut), CUT_FACE)}
    lines = {
        "edges": (rods(at[cell_edges(skin)], width), SKIN_LINE),
        "edges of the cut": (rods(at[cell_edges(cut)], width), CUT_LINE),
    }
    inner = {"inner edges": (rods(body.positions[cell_edges(body.tetrahedra)], width), SKIN_LINE)}
    seen, behind = _drawn(view, size, faces | lines), _drawn(view, size, inner)
    return seen * (1.0 - HIDDEN * (1.0 - behind))


def _drawn(
    view: Viewpoint,
    size: PixelSize,
    parts: dict[str, tuple[TriangleMesh, Rgb]],
) -> FloatArray:
    """Return a picture of meshes in even colours, sRGB from 0 to 1."""
    finishes = {
        name: Finish((*colour, 1.0), gloss=0.0, glow=1.0) for name, (_, colour) in parts.items()
    }
    canvas = Canvas(finishes=finishes, samples=_SAMPLES, background=_PAPER)
    try:
        for name, (mesh, _) in parts.items():
            canvas.put(name, mesh)
        canvas.look(view, lights=[_NO_LIGHT])
        pixels = canvas.colours(PixelSize(_FINE * size.width, _FINE * size.height)) / 255.0
    finally:
        canvas.close()
    mean: FloatArray = pixels.reshape(size.height, _FINE, size.width, _FINE, 3).mean(axis=(1, 3))
    return mean


def _flat(positions: FloatArray, triangles: IntArray) -> TriangleMesh:
    """Return triangles as a mesh whose normals are not used."""
    return TriangleMesh(positions, triangles, np.tile([0.0, 0.0, 1.0], (len(positions), 1)))


def rods(ends: FloatArray, width: float) -> TriangleMesh:
    """Return lines as rods with three sides.

    Args:
        ends: Ends of the lines [m], shape (n, 2, 3).
        width: Their thickness [m].
    """
    way = ends[:, 1] - ends[:, 0]
    aside = np.cross(way, np.eye(3)[np.abs(way).argmin(axis=1)])
    aside /= np.linalg.norm(aside, axis=1, keepdims=True)
    other = np.cross(way / np.linalg.norm(way, axis=1, keepdims=True), aside)
    angles = 2.0 * np.pi / 3.0 * np.arange(3)
    spokes = np.cos(angles)[:, None] * aside[:, None] + np.sin(angles)[:, None] * other[:, None]
    corners = ends[:, :, None] + 0.5 * width * spokes[:, None]  # (n, 2 ends, 3 spokes, 3)
    k, after = np.arange(3), (np.arange(3) + 1) % 3
    sides = np.concatenate(
        [np.stack([k, after, 3 + k], axis=1), np.stack([after, 3 + after, 3 + k], axis=1)]
    )
    triangles = (6 * np.arange(len(ends))[:, None, None] + sides).reshape(-1, 3)
    return _flat(corners.reshape(-1, 3), triangles)


def cell_edges(cells: IntArray) -> IntArray:
    """Return the edges of triangles or tetrahedra, each once, shape (n_edges, 2)."""
    n = cells.shape[1]
    pairs = [cells[:, [i, j]] for i in range(n) for j in range(i + 1, n)]
    return np.unique(np.sort(np.concatenate(pairs), axis=1), axis=0)
