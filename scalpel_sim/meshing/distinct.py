"""A tetrahedral mesh in which everything is there once, and faces one way."""

from typing import TYPE_CHECKING

import numpy as np

from tissue import BoolArray, FloatArray, IntArray

if TYPE_CHECKING:
    from tissue import TetrahedralMesh


def distinct(mesh: "TetrahedralMesh", nearness: float) -> tuple["TetrahedralMesh", list[str]]:
    """Return a mesh of distinct nodes and of tetrahedra that face one way, and lines on it.

    Args:
        mesh: The mesh as a file has it.
        nearness: Distance below which two nodes are one [m].
    """
    used, tets = np.unique(mesh.tetrahedra, return_inverse=True)
    positions, tets = mesh.positions[used], tets.reshape(-1, 4)
    notes = []
    if n_unused := len(mesh.positions) - len(used):
        notes.append(f"dropped {n_unused} nodes that no tetrahedron used")
    cells = np.round((positions - positions.min(axis=0)) / nearness)
    _, first, place = np.unique(cells, axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.empty(len(order), dtype=np.int64)
    rank[order] = np.arange(len(order))
    if n_merged := len(positions) - len(first):
        notes.append(f"merged {n_merged} nodes with others in the same place")
    positions, tets = positions[first[order]], rank[place.ravel()][tets]
    kept = _kept(tets, notes)
    tets = tets[kept]
    labels = None if mesh.labels is None else mesh.labels[kept]
    tets, n_turned = _turned(positions, tets)
    if n_turned:
        notes.append(f"put the nodes of {n_turned} tetrahedra in the order of the others")
    return mesh._replace(positions=positions, tetrahedra=tets, labels=labels), notes


def _kept(tets: IntArray, notes: list[str]) -> IntArray:
    """Return which tetrahedra have four different nodes, each once, and add lines to `notes`."""
    in_order = np.sort(tets, axis=1)
    whole = np.flatnonzero(~(in_order[:, 1:] == in_order[:, :-1]).any(axis=1))
    if n_less := len(tets) - len(whole):
        notes.append(f"dropped {n_less} tetrahedra with fewer than four places")
    _, first = np.unique(in_order[whole], axis=0, return_index=True)
    if n_again := len(whole) - len(first):
        notes.append(f"dropped {n_again} tetrahedra that were there twice")
    kept: IntArray = whole[np.sort(first)]
    return kept


def _turned(positions: FloatArray, tets: IntArray) -> tuple[IntArray, int]:
    """Return tetrahedra that lie on both sides of each face, and how many were turned for that.

    A tetrahedron that is inside out since its nodes are in the wrong place, not in the wrong order,
    has a negative volume afterwards.
    """
    from tissue.support import components, signed_volumes, sorted_faces

    n, faces = len(tets), sorted_faces(tets)
    a, b = faces.halves[faces.starts[faces.counts == 2][:, None] + [0, 1]].T
    # As it is (t) or turned (n + t): neighbours are as they are or turned together, or not.
    is_same = _is_even(tets, a) != _is_even(tets, b)
    a, b, other = a // 4, b // 4, np.where(is_same, 0, n)
    pairs = np.concatenate([np.c_[a, b + other], np.c_[a + n, (b + n + other) % (2 * n)]])
    n_groups, group = components(2 * n, pairs)
    volumes = signed_volumes(positions, tets)
    total = np.bincount(group, np.r_[volumes, -volumes], n_groups)
    turned = total[group[n:]] > total[group[:n]]
    return np.where(turned[:, None], tets[:, [0, 1, 3, 2]], tets), int(turned.sum())


def _is_even(tets: IntArray, halves: IntArray) -> BoolArray:
    """Return whether sorting the nodes of a face takes an even number of swaps."""
    from tissue.support import OUTWARD

    a, b, c = np.take_along_axis(tets[halves // 4], OUTWARD[halves % 4], axis=1).T
    is_even: BoolArray = (a < b) ^ (b < c) ^ (a < c)
    return is_even
