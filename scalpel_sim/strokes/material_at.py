"""Which material is at places of a body as it lies."""

import itertools

import numpy as np

from tissue import FloatArray, IntArray, Snapshot

_ROUNDING = 1e-9
"""Barycentric weight by which a place may miss a tetrahedron and still be in it."""


def tetrahedra_at(places: FloatArray, body: Snapshot) -> tuple[IntArray, FloatArray]:
    """Return a tetrahedron that holds each place, or -1, and the weights of the place in it.

    Args:
        places: In the body as it lies [m], shape (n, 3).
        body: The body.

    Returns:
        Tetrahedra, shape (n,), and barycentric weights, shape (n, 4): 0 where there is none.
    """
    from scipy.spatial import cKDTree  # 0.2 s, and only here

    corners = body.positions[body.tetrahedra]
    centres = corners.mean(axis=1)
    radii = np.linalg.norm(corners - centres[:, None], axis=2).max(axis=1)
    near = cKDTree(places).query_ball_point(centres, radii)
    tetrahedra = np.repeat(np.arange(len(near)), [len(found) for found in near])
    candidates = np.array(list(itertools.chain.from_iterable(near)), np.int64)
    sides = np.swapaxes(corners[tetrahedra, 1:] - corners[tetrahedra, :1], 1, 2)
    offsets = places[candidates] - corners[tetrahedra, 0]
    others = np.linalg.solve(sides, offsets[:, :, None])[:, :, 0]
    weights = np.column_stack((1.0 - others.sum(axis=1), others))
    inside = weights.min(axis=1) >= -_ROUNDING
    holders, shares = np.full(len(places), -1), np.zeros((len(places), 4))
    holders[candidates[inside]] = tetrahedra[inside]
    shares[candidates[inside]] = weights[inside]
    return holders, shares
