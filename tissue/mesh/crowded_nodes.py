"""Nodes with more tetrahedra around them than searches have room for."""

import numpy as np

from tissue.core.array_types import IntArray
from tissue.mesh.star import LARGEST_STAR


def crowding_of(tetrahedra: IntArray) -> str | None:
    """Return what is wrong where more than `LARGEST_STAR` tetrahedra share a node; None: nothing.

    `tetrahedra`: shape (n_tets, 4).
    """
    counts = np.bincount(tetrahedra.ravel())
    if counts.max() <= LARGEST_STAR:
        return None
    return (
        f"node {counts.argmax()} has {counts.max()} tetrahedra around it; there may be "
        f"{LARGEST_STAR}. Mesh the body anew: ordinary meshes have 60 at most"
    )
