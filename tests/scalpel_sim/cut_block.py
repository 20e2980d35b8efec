"""A block of tetrahedra that is cut down the middle, to be drawn."""

import numpy as np

from tissue import FloatArray, Surface, block
from tissue.mesh.faces import boundary_faces


def cut_block(gap: float, cells: tuple[int, int, int] = (4, 6, 4)) -> Surface:
    """Return the surface of a block cut at its middle x, with a gap [m] at the top of the cut.

    Without a gap it is whole: the faces in the middle are inside, and not part of the surface.
    """
    mesh = block(cells, (0.04, 0.06, 0.04))
    middle = mesh.positions[:, 0].mean()
    is_right = mesh.positions[mesh.tetrahedra, 0].mean(axis=1) > middle
    n_nodes = len(mesh.positions)
    tetrahedra = np.where(
        is_right[:, None] & (gap > 0.0), mesh.tetrahedra + n_nodes, mesh.tetrahedra
    )
    rest = np.concatenate([mesh.positions, mesh.positions])
    triangles = boundary_faces(tetrahedra)
    is_cut = (np.abs(rest[triangles, 0] - middle) < 1e-9).all(axis=1)
    return Surface(_pulled_apart(rest, n_nodes, middle, gap), rest, triangles, is_cut)


def _pulled_apart(rest: FloatArray, n_left: int, middle: float, gap: float) -> FloatArray:
    """Return positions of a body whose left and right parts are moved apart, most at the top."""
    side = np.where(np.arange(len(rest)) < n_left, -1.0, 1.0)
    height = (rest[:, 2] - rest[:, 2].min()) / np.ptp(rest[:, 2])
    reach = 1.0 - np.abs(rest[:, 0] - middle) / np.abs(rest[:, 0] - middle).max()
    moved = rest.copy()
    moved[:, 0] += 0.5 * gap * side * height * reach
    return moved
