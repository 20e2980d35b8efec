"""Lengths of a mesh that follow from the size of the body."""

from typing import NamedTuple

import numpy as np

from scalpel_sim.meshing.surface import FileSurface

N_TETRAHEDRA = 5_000
"""Tetrahedra of a mesh whose edge length was not chosen: some run in real time on two cores."""

FTETWILD_DENSITY = 1.25
"""Tetrahedra that fTetWild makes per regular ones of that edge that have the same volume."""

TOLERANCE_OF_SIZE = 0.005
"""Largest way of the surface per size of the body, the diagonal of its box. With a fifth of it a
sphere of 80,000 triangles takes ten times as long, and its worst tetrahedra are half as good."""

TOLERANCE_OF_THICKNESS = 0.2
"""The same per mean thickness: a thin plate must not close in on itself."""


class FillingSizes(NamedTuple):
    """Lengths with which a surface is filled."""

    edge_length: float
    """Of the tetrahedra [m]."""
    tolerance: float
    """Farthest that the surface may move [m]."""


def chosen_sizes(
    surface: FileSurface, edge_length: float | None, tolerance: float | None
) -> FillingSizes:
    """Return the lengths to fill a surface with; those that are None follow from its size."""
    if edge_length is None:
        edge_length = edge_for(surface.volume() / N_TETRAHEDRA)
    if tolerance is None:
        tolerance = min(
            TOLERANCE_OF_SIZE * surface.size(), TOLERANCE_OF_THICKNESS * surface.thickness()
        )
    return FillingSizes(edge_length, tolerance)


def edge_for(volume: float) -> float:
    """Return the edge [m] with which a tetrahedron of a mesh has a volume [m3] in the mean."""
    return float(np.cbrt(FTETWILD_DENSITY * 6.0 * np.sqrt(2.0) * volume))
