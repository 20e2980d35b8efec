"""`SkinCourse`: the line on the skin that a stroke follows as it lies, and when it is where."""

from typing import NamedTuple

import numpy as np

from tissue import FloatArray, IntArray, Snapshot

_INSIDE = -1e-9
"""Barycentric weight from which on a place is still in the tetrahedron that has held it."""

_ANY = -1
"""Label of a place that has been in no tetrahedron yet: those of a body are 0 or more."""

_ROUNDING = 1e-6
"""Share by which a place may be outside of the sphere around a tetrahedron that holds it."""


class SkinCourse(NamedTuple):
    """Places on the skin above the tip, in the order in which it is to come to them."""

    times: FloatArray
    """When the tip is to be below each, on the clock of the strokes [s], shape (n,)."""
    at_rest: FloatArray
    """Where they are in the body at rest [m], shape (n, 3)."""
    lying: FloatArray
    """Where they were in the body as it lay when the stroke was planned [m], shape (n, 3)."""
    speed: float
    """Speed of the tip between its ramps [m/s]."""

    def __repr__(self) -> str:
        """Return a short text: the path of the stroke tells one course from another."""
        return f"SkinCourse({len(self.times)} places)"

    def moved_by(self, seconds: float) -> "SkinCourse":
        """Return it on a clock that is ahead [s]."""
        return self._replace(times=self.times + seconds)

    def displacements(self, body: Snapshot, holders: IntArray) -> FloatArray:
        """Return how far the places have moved since the stroke was planned [m], shape (n, 3).

        Args:
            body: The body as it is.
            holders: Tetrahedron that has held each place, or -1; written. Shape (n,).
        """
        tetrahedra, at_rest = body.tetrahedra, body.rest_positions
        known = np.flatnonzero((holders >= 0) & (holders < len(tetrahedra)))
        weights = np.full((len(holders), 4), -np.inf)
        weights[known] = _weights(self.at_rest[known], at_rest[tetrahedra[holders[known]]])
        lost = np.flatnonzero(weights.min(axis=1) < _INSIDE)
        if len(lost):
            labels = np.where(holders[lost] < 0, _ANY, body.labels[np.maximum(holders[lost], 0)])
            holders[lost], weights[lost] = _held(self.at_rest[lost], labels, body)
        now = np.einsum("nk,nkx->nx", weights, body.positions[tetrahedra[holders]])
        return np.asarray(now - self.lying)


def _held(places: FloatArray, labels: IntArray, body: Snapshot) -> tuple[IntArray, FloatArray]:
    """Return the tetrahedra that places at rest are in, or least outside of, and the weights there.

    Args:
        places: In the body at rest [m], shape (n, 3).
        labels: Label of each, or `_ANY`: what a cut makes of a tetrahedron keeps its label.
        body: The body.
    """
    corners = body.rest_positions[body.tetrahedra]
    centres = corners.mean(axis=1)
    radii = np.linalg.norm(corners - centres[:, None], axis=2).max(axis=1) * (1.0 + _ROUNDING)
    holders, weights = np.empty(len(places), np.int64), np.empty((len(places), 4))
    for k, (place, label) in enumerate(zip(places, labels.tolist(), strict=True)):
        distances = np.linalg.norm(centres - place, axis=1)
        is_near = distances <= radii
        if label != _ANY:
            is_near &= body.labels == label
        near = np.flatnonzero(is_near) if is_near.any() else np.array([np.argmin(distances)])
        found = _weights(np.repeat(place[None], len(near), axis=0), corners[near])
        best = int(np.argmax(found.min(axis=1)))
        holders[k], weights[k] = near[best], found[best]
    return holders, weights


def _weights(places: FloatArray, corners: FloatArray) -> FloatArray:
    """Return barycentric weights of places, each in a tetrahedron; shape (n, 4).

    Args:
        places: The places [m], shape (n, 3).
        corners: Corners of the tetrahedron of each [m], shape (n, 4, 3).
    """
    sides = np.swapaxes(corners[:, 1:] - corners[:, :1], 1, 2)
    others = np.linalg.solve(sides, (places - corners[:, 0])[:, :, None])[:, :, 0]
    return np.column_stack((1.0 - others.sum(axis=1), others))
