"""Counts what the paper's scheme did to a mesh, and what it left behind."""

import numpy as np

from tissue.cutting.bielser_1998.case_table import CASES
from tissue.cutting.bielser_1998.crossings import Waiting
from tissue.cutting.bielser_1998.cut_edge_code import bit_of
from tissue.cutting.bielser_1998.mesh_records import NO_NODE, NOT_CUT, WHOLE_STILL, Records, Table
from tissue.cutting.bielser_1998.template_1_to_17 import N_CHILDREN
from tissue.cutting.bielser_1998.workspace import SplitCounts
from tissue.mesh.body import Body
from tissue.mesh.nonconforming import HANGING
from tissue.types import SchemeStatistics


def statistics(
    body: Body, records: Records, table: Table, waiting: Waiting, counts: SplitCounts
) -> SchemeStatistics:
    """Return what the scheme did so far and what it left behind, in O(initial mesh).

    Args:
        body: The body as it is now.
        records: Records of the initial mesh.
        table: The lookup table.
        waiting: Tetrahedra that the blade has not left.
        counts: Counts since the body was made.
    """
    is_split = records.first_child != WHOLE_STILL
    codes = np.zeros(len(is_split), np.int64)
    for e in range(6):
        is_edge_cut = records.crossed_at[records.edges_of[:, e]] != NOT_CUT
        codes |= is_edge_cut.astype(np.int64) << bit_of(e)
    unsupported = ~is_split & (codes > 0) & (table.case[codes] < 0) & (waiting.is_listed == 0)
    beside_whole = np.zeros(len(records.edges), dtype=bool)
    beside_whole[records.edges_of[~is_split]] = True
    has_node = records.edge_nodes[:, 0] != NO_NODE
    hanging_faces = np.unique(body.links[: len(is_split)][body.links[: len(is_split)] <= HANGING])
    n_cut = int(is_split.sum())
    return SchemeStatistics(
        n_cut=n_cut,
        n_of_case={case: int(counts.n_of_case[i]) for i, case in enumerate(CASES)},
        paper_count=len(is_split) + N_CHILDREN * n_cut,
        n_hanging_edge_nodes=int((has_node & beside_whole).sum()),
        n_hanging_face_nodes=len(hanging_faces) + counts.n_own,
        n_guarded=counts.n_guarded,
        n_own_face_nodes=counts.n_own,
        n_unsupported=int(unsupported.sum()),
        n_waiting=waiting.n_listed,
        n_ignored_crossings=counts.n_ignored,
    )
