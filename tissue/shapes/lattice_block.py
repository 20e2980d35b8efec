"""Rectangular blocks of a body-centred lattice, whose tetrahedra bend better than a block's.

The lattice has the corners of cubic cells and their centres (Labelle and Shewchuk 2007, as in
`tissue.shapes.isosurface_stuffing`). Two cells side by side have four tetrahedra around the line
between their centres; a square of the surface has two, with its diagonal turned from square to
square, so that no direction is preferred.
"""

from collections.abc import Sequence

import numpy as np

from tissue.core.array_types import IntArray
from tissue.shapes.block import checked_cells, checked_size
from tissue.types import TetrahedralMesh

_TETRAHEDRA_IN_CELL = 12
"""Tetrahedra of a cell: six sides with two each, or with half of four."""


def lattice_block(
    cells: Sequence[int] = (4, 6, 4), size: Sequence[float] = (0.04, 0.06, 0.04)
) -> TetrahedralMesh:
    """Return a block of `cells` in x, y and z with a node in the middle of each.

    With as many tetrahedra as a `block` its error in bending is 0.6 to 0.7 of that of the block,
    and the time step is the same. Twice as many belong to a cell of the same size.

    Args:
        cells: Number of cells along x, y and z.
        size: Edges of the block along x, y and z [m]; its lowest corner is at the origin.

    Raises:
        ValueError: `cells` are not three whole numbers of at least 1, `size` not three finite
            positive numbers, or there would be more than `tissue.shapes.block.MAX_TETRAHEDRA`.
    """
    counts = np.array(checked_cells(cells, _TETRAHEDRA_IN_CELL))
    edges = np.array(checked_size(size))
    corners = np.indices(tuple(counts + 1)).reshape(3, -1).T
    centres = np.indices(tuple(counts)).reshape(3, -1).T + 0.5
    positions = np.concatenate([corners, centres]) / counts * edges
    tetrahedra = [part for axis in range(3) for part in _across_sides(counts, axis)]
    return TetrahedralMesh(positions, np.concatenate(tetrahedra))


def _across_sides(counts: IntArray, axis: int) -> list[IntArray]:
    """Return the tetrahedra at the sides of cells that are normal to an axis.

    Args:
        counts: Number of cells along x, y and z, shape (3,).
        axis: The axis.
    """
    n_corners = int(np.prod(counts + 1))
    unit = np.eye(3, dtype=np.int64)
    u, v = (axis + 1) % 3, (axis + 2) % 3
    shape = counts + unit[axis]
    lowest = np.indices(tuple(shape)).reshape(3, -1).T
    # Corners of each side, counter-clockwise seen from high on the axis.
    around = np.stack([lowest, lowest + unit[u], lowest + unit[u] + unit[v], lowest + unit[v]])
    corner = np.ravel_multi_index(tuple(np.moveaxis(around, 2, 0)), tuple(counts + 1))
    height = lowest[:, axis]
    is_low, is_high = height == 0, height == counts[axis]
    cell_above = n_corners + np.ravel_multi_index(
        tuple(np.minimum(lowest, counts - 1).T), tuple(counts)
    )
    cell_below = n_corners + np.ravel_multi_index(
        tuple(np.maximum(lowest - unit[axis], 0).T), tuple(counts)
    )
    inside = ~(is_low | is_high)
    tetrahedra = [
        np.stack(
            [cell_below, cell_above, corner[k], corner[(k + 1) % 4]], axis=1
        )[inside]
        for k in range(4)
    ]  # fmt: skip
    # The diagonal of a side begins at its lowest corner, or at the next one.
    is_turned = lowest.sum(axis=1) % 2 == 1
    a, b, c, d = (np.where(is_turned, corner[(k + 1) % 4], corner[k]) for k in range(4))
    for first, second, third in ((a, b, c), (a, c, d)):
        tetrahedra.append(np.stack([cell_below, first, second, third], axis=1)[is_high])
        tetrahedra.append(np.stack([cell_above, first, third, second], axis=1)[is_low])
    return tetrahedra
