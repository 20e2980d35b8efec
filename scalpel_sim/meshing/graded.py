"""Blocks of cells of different sizes: plain, and rounded to a lobe of an organ."""

from collections.abc import Sequence

import numpy as np

from tissue import FloatArray, TetrahedralMesh, block

ROUNDED = 0.2
"""Share by which the sides of a lobe draw in towards its corners."""

TAPERED = 0.12
"""Share by which it is narrower at the right than in the middle, and wider at the left."""

DOMED = 0.25
"""Share of its height by which it is lower at its sides than in the middle; twice at corners."""


def graded_block(
    along_x: Sequence[float], along_y: Sequence[float], along_z: Sequence[float]
) -> TetrahedralMesh:
    """Return a block whose layers of cells are of given sizes, with a corner at the origin.

    Args:
        along_x: Sizes along x [m].
        along_y: Sizes along y [m].
        along_z: Sizes along z [m].
    """
    sizes = (along_x, along_y, along_z)
    counts = [len(each) for each in sizes]
    mesh = block(counts, [float(n) for n in counts])
    places = [
        np.interp(
            mesh.positions[:, axis], np.arange(len(each) + 1), np.append(0.0, np.cumsum(each))
        )
        for axis, each in enumerate(sizes)
    ]
    return TetrahedralMesh(np.stack(places, axis=1), mesh.tetrahedra)


def lobe(
    along_x: Sequence[float], along_y: Sequence[float], along_z: Sequence[float]
) -> TetrahedralMesh:
    """Return a graded block that is rounded to a lobe of an organ.

    It is flat below, domed above, and tapers to the right. In the middle it is as high as the
    block, and its cells are of nearly the given sizes.

    Args:
        along_x: Sizes along x [m].
        along_y: Sizes along y [m].
        along_z: Sizes along z [m].
    """
    mesh = graded_block(along_x, along_y, along_z)
    return TetrahedralMesh(_rounded(mesh.positions), mesh.tetrahedra)


def _rounded(positions: FloatArray) -> FloatArray:
    """Return where the nodes of a block are in a lobe [m]."""
    size = positions.max(axis=0)
    u, v, _ = (2.0 * positions / size - 1.0).T
    x = u * (1.0 - ROUNDED * v**2)
    y = v * (1.0 - ROUNDED * u**2) * (1.0 - TAPERED * u)
    z = positions[:, 2] * (1.0 - DOMED * (u**2 + v**2))
    return np.stack([0.5 * size[0] * (1.0 + x), 0.5 * size[1] * (1.0 + y), z], axis=1)
