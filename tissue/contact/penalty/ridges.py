"""`Ridges`: the edges that can touch other edges, kept true to motion and cuts.

Two bodies meet first with a node and a face, or with two ridges (`feature_edges`). Ridges go by
3 * place + k: edge `k` of the face in a place of `Faces`.
"""

import numpy as np

from tissue.contact.faces import NO_FACE, Faces
from tissue.contact.feature_edges import face_across, is_ridge
from tissue.contact.penalty.near_pairs import NearPairs
from tissue.contact.penalty.ridge_grid import RidgeGrid, new_ridge_grid
from tissue.core.array_types import FloatArray, IntArray, SlotArray
from tissue.core.jit import kernel
from tissue.core.simd import WIDTH, aligned, room_for_points
from tissue.core.structs import Arrays, IntCell
from tissue.mesh.body import CUT, Body
from tissue.mesh.faces import OUTWARD


class Ridges(Arrays):
    """The ridges of the active faces."""

    n_ridges: IntCell
    """Number of ridges."""
    listed: IntArray
    """The ridges, shape (3 * face capacity,)."""
    is_one: IntArray
    """1 if an edge is a ridge that its face lists, else 0; shape (3 * face capacity,)."""
    is_of_cut: IntArray
    """1 if one of the two faces of a ridge was made by a cut, else 0; shape (3 * face
    capacity,)."""
    dirty_at: IntArray
    """Update of the pairs in which each edge was last paired anew, shape (3 * face capacity,)."""
    first_pair: IntArray
    """Where the pairs of each ridge begin in `RidgePairs.of_ridge`, shape (3 * face capacity +
    2,)."""
    way: FloatArray
    """Sum of the ways of the ends of each ridge as it was last computed [m], shape (3 * face
    capacity,)."""
    node: IntArray
    """Ends of each ridge, shape (3 * face capacity, 2)."""
    tip: IntArray
    """Third nodes of its two faces: that which lists it, and that across; shape (3 * face
    capacity, 2)."""
    low: FloatArray
    """Lowest corner of the box around each ridge and its balls [m], shape (3 * face capacity,
    3)."""
    high: FloatArray
    """Highest corner of that box [m], shape (3 * face capacity, 3)."""
    outward: FloatArray
    """Vector out of the body at each ridge, with its nodes where they were when they were paired:
    the sum of the unit normals of its two faces; shape (3 * face capacity, 3)."""
    eight: SlotArray
    """Scratch: eight ridges, their first ends and their second ones; shape (24,)."""
    reach: FloatArray
    """Scratch: the radius of the larger ball of the ends of each [m], shape (8,)."""
    grid: RidgeGrid
    """The ridges by their boxes."""


def new_ridges(n_faces: int) -> Ridges:
    """Return no ridges, with room for those of `n_faces`."""
    n = 3 * n_faces
    of_edges = ("listed", "is_one", "is_of_cut", "dirty_at")
    return Ridges(
        n_ridges=0,
        **{name: np.zeros(n, np.int64) for name in of_edges},
        first_pair=np.zeros(n + 2, np.int64),
        way=np.zeros(n),
        node=np.zeros((n, 2), np.int64),
        tip=np.zeros((n, 2), np.int64),
        low=np.zeros((n, 3)),
        high=np.zeros((n, 3)),
        outward=room_for_points(n),
        eight=np.zeros(3 * WIDTH, np.int32),
        reach=aligned(WIDTH),
        grid=new_ridge_grid(n),
    )


@kernel
def find_changed_ridges(ridges: Ridges, pairs: NearPairs, faces: Faces, body: Body) -> None:
    """Judge the edges of faces that changed, and of those beside them.

    Args:
        ridges: Written.
        pairs: Faces that changed are dirty in this update, and no others yet.
        faces: The faces that may touch.
        body: Adjacency, and the body at rest.
    """
    for at in range(faces.n_places):
        if pairs.dirty_at[at] != pairs.n_updates:
            continue
        _judge_edges(ridges, pairs, faces, body, at)
        face = faces.face[at]
        if face == NO_FACE:
            continue
        for k in range(3):
            beside = _place_of(faces, face_across(body, face // 4, face % 4, k)[0])
            if (
                beside >= 0
                and pairs.is_active[beside] == 1
                and pairs.dirty_at[beside] != pairs.n_updates
            ):
                _judge_edges(ridges, pairs, faces, body, beside)


@kernel
def _place_of(faces: Faces, face: int) -> int:
    """Return the place of a face, or -1; `face` may be -1."""
    return int(faces.place[face // 4, face % 4]) if face >= 0 else -1


@kernel
def _judge_edges(ridges: Ridges, pairs: NearPairs, faces: Faces, body: Body, at: int) -> None:
    """Find out which edges of the face in place `at` are ridges that it lists."""
    for k in range(3):
        edge = 3 * at + k
        if ridges.is_one[edge] == 1:
            ridges.dirty_at[edge] = pairs.n_updates
        ridges.is_one[edge] = 0
        if pairs.is_active[at] == 0:
            continue
        face = faces.face[at]
        t, f = face // 4, face % 4
        across, tip = face_across(body, t, f, k)
        a, b = pairs.triangle[at, k], pairs.triangle[at, (k + 1) % 3]
        beside = _place_of(faces, across)
        # Both faces have the edge, one of them from its lower node to its higher.
        has_other = beside >= 0 and pairs.is_active[beside] == 1
        if (a > b and has_other) or not is_ridge(body, t, f, k):
            continue
        own_tip = body.tetrahedra[t, OUTWARD[f, (k + 2) % 3]]
        ridges.is_one[edge] = 1
        ridges.dirty_at[edge] = pairs.n_updates
        ridges.node[edge, 0], ridges.node[edge, 1] = a, b
        ridges.tip[edge, 0] = own_tip
        ridges.tip[edge, 1] = tip if tip >= 0 else own_tip
        is_other_cut = across >= 0 and body.links[across // 4, across % 4] == CUT
        ridges.is_of_cut[edge] = 1 if body.links[t, f] == CUT or is_other_cut else 0
