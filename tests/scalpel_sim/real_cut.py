"""A block that the tissue engine has cut, as the pictures of a run show it."""

import functools
import itertools

import numpy as np

from tissue import BladeSegment, BladeSweep, Surface, Tissue, block, fixed_nodes

DT = 1e-3
"""Time step [s]."""

SPEED = 0.25
"""Speed of the blade [m/s]."""

STRETCH = 1.1
"""Factor by which the held sides are pulled apart, so that the cut opens."""


@functools.cache
def cut_tissue() -> tuple[Surface, Surface, Surface]:
    """Return the surface of a block, 40 x 60 x 40 mm, before, in the middle of, and after a cut.

    An upright blade moves through it from front to back, along the middle.
    """
    mesh = block()
    sides = fixed_nodes(mesh, "left,right")
    tissue = Tissue(mesh, fixed=sides, positions=mesh.positions * [STRETCH, 1.0, 1.0])
    whole = halfway = tissue.surface()
    along = np.arange(-0.01, 0.1, SPEED * DT)
    for i, (before, after) in enumerate(itertools.pairwise(along)):
        tissue.step(BladeSweep(_blade(before), _blade(after)), DT)
        if i == len(along) // 2:
            halfway = tissue.surface()
    return whole, halfway, tissue.surface()


def _blade(y: float) -> BladeSegment:
    """Return an upright blade that cuts along y, off the nodes of the grid."""
    x = 0.0213 * STRETCH
    return BladeSegment(
        tip=np.array([x, y, -0.02]), heel=np.array([x, y, 0.06]), forward=np.array([0.0, 1.0, 0.0])
    )
