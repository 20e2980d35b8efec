"""The table under a body, which shows only the shadows on it."""

import numpy as np

from scalpel_sim.viewer.primitives import TriangleMesh
from tissue import FloatArray

_REACH = 6.0
"""Half width of the table in diagonals of the body: as far as its shadow can be seen."""
N_SQUARES = 48
"""Number of squares along each side. Squares that reach behind the eye are left out, so they must
be small."""


def table_below(bounds: FloatArray) -> TriangleMesh:
    """Return a level square under the middle of a body with these bounds [m], shape (2, 3)."""
    centre = bounds.mean(axis=0)
    reach = _REACH * float(np.linalg.norm(bounds[1] - bounds[0]))
    line = np.linspace(-reach, reach, N_SQUARES + 1)
    x, y = np.meshgrid(centre[0] + line, centre[1] + line, indexing="ij")
    positions = np.stack([x, y, np.full_like(x, bounds[0, 2])], axis=-1).reshape(-1, 3)
    row = np.arange(N_SQUARES)
    corner = (row[:, None] * (N_SQUARES + 1) + row).ravel()
    across, along = corner + N_SQUARES + 1, corner + 1
    triangles = np.concatenate(
        [np.stack([corner, across, across + 1], 1), np.stack([corner, across + 1, along], 1)]
    )
    return TriangleMesh(positions, triangles, np.tile([0.0, 0.0, 1.0], (len(positions), 1)))
