"""All that the split of a tetrahedron reads and writes."""

import numpy as np

from tissue.core.array_types import IntArray
from tissue.core.structs import Arrays, IntCell
from tissue.cutting.bielser_1998.case_table import CASES
from tissue.cutting.bielser_1998.mesh_records import Records, Table
from tissue.cutting.bielser_1998.node_placement import Placing
from tissue.mesh.body import Body
from tissue.mesh.changes import Change


class SplitCounts(Arrays):
    """Counts of what the scheme did since the body was made."""

    n_of_case: IntArray
    """Split tetrahedra of each case, A to E; shape (5,)."""
    n_guarded: IntCell
    """Split tetrahedra whose face nodes the guard moved."""
    n_own: IntCell
    """Face nodes that the guard made for one tetrahedron alone."""
    n_ignored: IntCell
    """Crossings with edges of tetrahedra that were split already."""


def no_counts() -> SplitCounts:
    """Return counts of nothing done so far."""
    return SplitCounts(n_of_case=np.zeros(len(CASES), np.int64), n_guarded=0, n_own=0, n_ignored=0)


class Split(Arrays):
    """All that the split of a tetrahedron reads and writes."""

    body: Body
    records: Records
    table: Table
    change: Change
    placing: Placing
    references: IntArray
    """Scratch: global node of each local node, for each part; shape (5, 14)."""
    counts: SplitCounts
    density: float
    """Density of the tissue [kg/m3]."""
