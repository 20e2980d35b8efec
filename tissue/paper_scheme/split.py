"""All that the split of a tetrahedron reads and writes."""

from tissue.arrays import Arrays
from tissue.body import Body
from tissue.cut import Change
from tissue.paper_scheme.placing import Placing
from tissue.paper_scheme.records import Records, Table
from tissue.types import IntArray

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
