"""Depth to which two tetrahedra lie in each other: by the axis along which that is least."""

import itertools

import numpy as np

from tissue.core.array_types import FloatArray

_FACES = np.array([[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]])
_EDGES = np.array(list(itertools.combinations(range(4), 2)))

_PARALLEL = 1e-9
"""Sine of an angle between two edges below which they span no plane."""


def overlap_depths(ones: FloatArray, others: FloatArray) -> FloatArray:
    """Return by how much pairs of tetrahedra overlap [m], shape (n,); negative where they do not.

    Two convex bodies are apart where they are so along the normal of a face, or across an edge of
    each (the theorem of separating axes). Moved so far along that axis they only touch.

    Args:
        ones: Corners of the first of each pair [m], shape (n, 4, 3).
        others: Corners of the second, shape (n, 4, 3).
    """
    depths = np.full(len(ones), np.inf)
    for axis in _axes(ones, others):
        length = np.linalg.norm(axis, axis=1)
        along = axis / np.maximum(length, np.finfo(np.float64).tiny)[:, None]
        mine, theirs = (np.einsum("nkx,nx->nk", each, along) for each in (ones, others))
        deep = np.minimum(
            mine.max(axis=1) - theirs.min(axis=1), theirs.max(axis=1) - mine.min(axis=1)
        )
        depths = np.where(length > 0.0, np.minimum(depths, deep), depths)
    return np.asarray(depths)


def _axes(ones: FloatArray, others: FloatArray) -> list[FloatArray]:
    """Return the axes that may separate pairs, each (n, 3); zero where an axis has no direction."""
    found = [
        np.cross(each[:, j] - each[:, i], each[:, k] - each[:, i])
        for each in (ones, others)
        for i, j, k in _FACES
    ]
    mine, theirs = ([each[:, j] - each[:, i] for i, j in _EDGES] for each in (ones, others))
    for a, b in itertools.product(mine, theirs):
        axis = np.cross(a, b)
        sizes = np.linalg.norm(a, axis=1) * np.linalg.norm(b, axis=1)
        is_plane = np.linalg.norm(axis, axis=1) > _PARALLEL * sizes
        found.append(np.where(is_plane[:, None], axis, 0.0))
    return found
