"""All that the split of a tetrahedron reads and writes."""

from tissue.core.array_types import IntArray
from tissue.core.structs import Arrays
from tissue.cutting.bielser_1998.mesh_records import Records, Table
from tissue.cutting.bielser_1998.node_placement import Placing
from tissue.mesh.body import Body
from tissue.mesh.changes import Change

N_OF_CASE, N_GUARDED, N_OWN = 0, 5, 6
"""Places in `Split.tally`: split tetrahedra of cases A to E, those whose nodes the guard moved, and
face nodes that it made for one tetrahedron alone."""
N_TALLIES = 7


class Split(Arrays):
    """What a split reads and writes."""

    body: Body
    records: Records
    table: Table
    change: Change
    placing: Placing
    references: IntArray
    """Scratch: global node of each local node, for each part; shape (5, 14)."""
    tally: IntArray
    """Counts since the body was made, shape (N_TALLIES,)."""
    density: float
    """[kg/m3]."""
