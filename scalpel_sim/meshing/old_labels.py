"""Labels of a mesh that is filled anew: those of the old tetrahedra in the same places."""

from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial import cKDTree

from tissue import FloatArray, IntArray

if TYPE_CHECKING:
    from tissue import TetrahedralMesh

NEAR_TETRAHEDRA = 24
"""Old tetrahedra by whose middles a place is near, among which that around it is sought."""

PLACES = np.vstack([np.full((1, 4), 0.25), 0.15 + 0.4 * np.eye(4)])
"""Places in a new tetrahedron whose labels are counted, as shares of its nodes."""


def with_old_labels(
    new: "TetrahedralMesh", old: "TetrahedralMesh"
) -> tuple["TetrahedralMesh", tuple[str, ...]]:
    """Return a mesh with the labels of another one of the same body, and lines on them.

    A new tetrahedron has the label of most of the places in it, so that a border between two labels
    moves by up to an element. A place has the label of the old tetrahedron around it.

    Args:
        new: The mesh, without labels.
        old: The mesh with labels; some of its tetrahedra may be flat or inside out.
    """
    if old.labels is None:
        return new, ()
    from tissue.support import signed_volumes

    numbers, index = np.unique(old.labels, return_inverse=True)
    corners = new.positions[new.tetrahedra]
    votes = np.zeros((len(corners), len(numbers)))
    for shares in PLACES:
        own = index[_around(np.tensordot(corners, shares, axes=(1, 0)), old)]
        votes[np.arange(len(corners)), own] += 1.0
    labels = numbers[votes.argmax(axis=1)]
    made = new._replace(labels=labels, label_names=dict(old.label_names))
    if len(numbers) == 1:
        return made, ()
    before = np.bincount(index, signed_volumes(old.positions, old.tetrahedra))
    volumes = signed_volumes(new.positions, new.tetrahedra)
    changes = [
        f"{old.label_names.get(number, number)} "
        f"{volumes[labels == number].sum() / volume - 1.0:+.1%}"
        for number, volume in zip(numbers.tolist(), before.tolist(), strict=True)
    ]
    note = "labels are those of the old tetrahedra in the same places; volumes of them changed by "
    return made, (note + ", ".join(changes),)


def _around(points: FloatArray, mesh: "TetrahedralMesh") -> IntArray:
    """Return the tetrahedron around each point, or that which the point is outside of by least."""
    corners = mesh.positions[mesh.tetrahedra]
    n_near = min(NEAR_TETRAHEDRA, len(corners))
    near = cKDTree(corners.mean(axis=1)).query(points, k=n_near)[1].reshape(len(points), -1)
    best: IntArray = near[:, 0].copy()
    depth = np.full(len(points), -np.inf)
    for k in range(n_near):
        a, b, c, d = corners[near[:, k]].swapaxes(0, 1)
        whole = _volumes(a, b, c, d)
        flat = np.abs(whole) < np.finfo(np.float64).tiny
        parts = np.stack(
            [
                _volumes(points, b, c, d),
                _volumes(a, points, c, d),
                _volumes(a, b, points, d),
                _volumes(a, b, c, points),
            ]
        )
        inside = np.where(flat, -np.inf, (parts / np.where(flat, 1.0, whole)).min(axis=0))
        best, depth = np.where(inside > depth, near[:, k], best), np.maximum(depth, inside)
    return best


def _volumes(a: FloatArray, b: FloatArray, c: FloatArray, d: FloatArray) -> FloatArray:
    """Return six times the volumes of tetrahedra."""
    volumes: FloatArray = np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a)
    return volumes
