"""Counts what the paper's scheme did to a mesh, and what it left behind."""

import numpy as np

from tissue.core.array_types import IntArray
from tissue.cutting.bielser_1998.case_table import CASES
from tissue.cutting.bielser_1998.crossings import Waiting
from tissue.cutting.bielser_1998.cut_edge_code import bit_of
from tissue.cutting.bielser_1998.mesh_records import NO_NODE, NOT_CUT, WHOLE_STILL, Records, Table
from tissue.cutting.bielser_1998.template_1_to_17 import N_CHILDREN
from tissue.cutting.bielser_1998.workspace import N_GUARDED, N_OF_CASE, N_OWN
from tissue.mesh.body import Body
from tissue.mesh.nonconforming import HANGING
from tissue.types import SchemeStatistics


def statistics(
    body: Body, records: Records, table: Table, waiting: Waiting, tally: IntArray, n_ignored: int
) -> SchemeStatistics:
    """Count; takes a look at the whole initial mesh."""
    is_split = records.first_child != WHOLE_STILL
    codes = np.zeros(len(is_split), np.int64)
    for e in range(6):
        is_cut = records.crossed_at[records.edges_of[:, e]] != NOT_CUT
        codes |= is_cut.astype(np.int64) << bit_of(e)
    unsupported = ~is_split & (codes > 0) & (table.case[codes] < 0) & (waiting.is_listed == 0)
    beside_whole = np.zeros(len(records.edges), dtype=bool)
    beside_whole[records.edges_of[~is_split]] = True
    has_node = records.edge_nodes[:, 0] != NO_NODE
    hanging_faces = np.unique(body.links[: len(is_split)][body.links[: len(is_split)] <= HANGING])
    n_cut = int(is_split.sum())
    n_own = int(tally[N_OWN])
    return SchemeStatistics(
        n_cut=n_cut,
        n_of_case={case: int(tally[N_OF_CASE + i]) for i, case in enumerate(CASES)},
        paper_count=len(is_split) + N_CHILDREN * n_cut,
        n_hanging_edge_nodes=int((has_node & beside_whole).sum()),
        n_hanging_face_nodes=len(hanging_faces) + n_own,
        n_guarded=int(tally[N_GUARDED]),
        n_own_face_nodes=n_own,
        n_unsupported=int(unsupported.sum()),
        n_waiting=int(waiting.n[0]),
        n_ignored_crossings=n_ignored,
    )
