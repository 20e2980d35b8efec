"""A line drawing of a mesh: edges are pale behind faces, and the faces of cuts are red."""

import numpy as np

from scalpel_sim.figures.camera import View, mean_of_samples
from scalpel_sim.figures.rasterise import draw_segments, rasterise
from tissue import FloatArray, IntArray, Snapshot, Surface

_PAPER = (1.0, 1.0, 1.0)
"""Colour of the background (sRGB)."""
SKIN_FACE, CUT_FACE = (0.955, 0.96, 0.97), (1.0, 0.86, 0.84)
"""Colours of skin and of cut faces (sRGB)."""
SKIN_LINE, CUT_LINE = (0.13, 0.16, 0.22), (0.75, 0.10, 0.10)
"""Colours of edges of the skin and of edges of cut faces (sRGB)."""
HIDDEN = 0.13
"""Opacity of lines behind faces: they show how deep the mesh goes, without confusing the eye."""
_THICKNESS = 1.1
"""Thickness of the lines [pixels]."""
_SLACK = 2e-3
"""Fraction by which a face must be nearer to hide a line: lines lie on faces, which must not
hide them."""


def draw_mesh(view: View, body: Snapshot, surface: Surface, samples: int = 3) -> FloatArray:
    """Return a drawing of the mesh, sRGB from 0 to 1, shape (view.height, view.width, 3).

    Args:
        view: Projection to the picture.
        body: State of the body whose edges are drawn.
        surface: Surface of the body, which hides the edges behind it.
        samples: Number of samples along each side of a pixel, against aliasing.
    """
    fine = view.sampled(samples)
    corners = fine.project(surface.positions)[surface.triangles]
    raster = rasterise(corners, fine.width, fine.height)
    image = np.empty((fine.height, fine.width, 3))
    image[:] = _PAPER
    seen = raster.triangle >= 0
    is_cut = np.zeros_like(seen)
    is_cut[seen] = surface.is_cut[raster.triangle[seen]]
    image[seen] = SKIN_FACE
    image[is_cut] = CUT_FACE

    of_cut = cell_edges(surface.triangles[surface.is_cut])
    groups = (
        (cell_edges(body.tetrahedra), body.positions, SKIN_LINE, False),
        (cell_edges(surface.triangles[~surface.is_cut]), surface.positions, SKIN_LINE, True),
        (of_cut, surface.positions, CUT_LINE, True),
    )
    for edges, positions, colour, is_surface in groups:
        visible, hidden = np.zeros(seen.shape), np.zeros(seen.shape)
        ends = np.ascontiguousarray(fine.project(positions)[edges])
        draw_segments(ends, raster.nearness, samples * _THICKNESS, _SLACK, visible, hidden)
        drawn = visible if is_surface else HIDDEN * np.maximum(visible, hidden)
        image += drawn[:, :, None] * (np.array(colour) - image)
    return mean_of_samples(image, samples)


def cell_edges(cells: IntArray) -> IntArray:
    """Return the edges of triangles or tetrahedra, each once, shape (n_edges, 2)."""
    n = cells.shape[1]
    pairs = [cells[:, [i, j]] for i in range(n) for j in range(i + 1, n)]
    return np.unique(np.sort(np.concatenate(pairs), axis=1), axis=0)
