"""Move nodes where three labels or more meet onto the line, or to the point, where they meet."""

import itertools
from collections.abc import Callable

import numpy as np

from tissue.core.array_types import BoolArray, FloatArray, IntArray
from tissue.mesh.faces import OUTWARD, sorted_faces
from tissue.mesh.validation import quality
from tissue.types import TetrahedralMesh

DepthFunction = Callable[[FloatArray, IntArray], FloatArray]
"""Points [m], shape (n, 3), and a label for each, to how deep each is in the shape of that label,
shape (n,). A point belongs to the label with the largest; label 0 is what is outside of all."""

_LEAST_MEETING = 3
"""Number of labels, with the outside, from which on a node is moved: where two meet, nodes are on
the border already."""

_STEPS = 12
"""Number of Newton's steps to the border. Each is short where borders bend within a cell."""

_LONGEST_STEP = 0.3
"""Longest step, as a share of the spacing: farther away a border looks otherwise."""

_DIFFERENCE = 1e-4
"""Step of the differences that give slopes of depths, as a share of the spacing."""

_FLATTEST = 1e-3
"""Slope across which two borders count as one, as a share of the steepest: there a node moves
onto the border and not along it."""

_KEPT_QUALITY = 0.15
"""Quality that the tetrahedra around a moved node keep, if they had it: about the least that
stuffing one shape leaves."""

_HALVINGS = 4
"""Number of times that a way is halved before its node stays where it is."""


def moved_to_borders(mesh: TetrahedralMesh, depth: DepthFunction, spacing: float) -> FloatArray:
    """Return the positions of nodes [m] with those moved that should be where labels meet.

    A lattice gives each tetrahedron a label, but what a node on a surface separates depends on its
    neighbours: without this, teeth of one label stick into the other where a border ends in the
    skin.

    Args:
        mesh: Tetrahedra with labels from 1 on; what is outside of all has label 0.
        depth: How deep points are in each shape.
        spacing: Edge of a lattice cell [m].
    """
    meeting = _labels_at_nodes(mesh)
    chosen = np.flatnonzero(meeting.sum(axis=1) >= _LEAST_MEETING)
    if not len(chosen):
        return mesh.positions
    way = np.zeros_like(mesh.positions)
    way[chosen] = (
        _onto_borders(mesh.positions[chosen], meeting[chosen], depth, spacing)
        - mesh.positions[chosen]
    )
    return _as_far_as_kept(mesh, way)


def _labels_at_nodes(mesh: TetrahedralMesh) -> BoolArray:
    """Return which labels meet at each node, shape (n_nodes, n_labels + 1); 0 is the outside."""
    assert mesh.labels is not None
    meeting = np.zeros((len(mesh.positions), int(mesh.labels.max()) + 1), dtype=bool)
    meeting[mesh.tetrahedra, mesh.labels[:, None]] = True
    faces = sorted_faces(mesh.tetrahedra)
    tetrahedra, local = np.divmod(faces.halves[faces.starts[faces.counts == 1]], 4)
    meeting[np.take_along_axis(mesh.tetrahedra[tetrahedra], OUTWARD[local], axis=1), 0] = True
    return meeting


def _onto_borders(
    points: FloatArray, meeting: BoolArray, depth: DepthFunction, spacing: float
) -> FloatArray:
    """Return the places next to points [m] where the labels that meet there are equally deep."""

    def uneven(at: FloatArray) -> FloatArray:
        """Return by how much deeper each point is in labels than on their mean; 0 in others."""
        depths = np.stack(
            [depth(at, np.full(len(at), label)) for label in range(meeting.shape[1])], axis=1
        )
        mean = np.sum(depths, axis=1, where=meeting) / meeting.sum(axis=1)
        return np.where(meeting, depths - mean[:, None], 0.0)

    aside = _DIFFERENCE * spacing * np.eye(3)
    for _ in range(_STEPS):
        slopes = np.stack(
            [(uneven(points + h) - uneven(points - h)) / (2.0 * np.linalg.norm(h)) for h in aside],
            axis=2,
        )
        inverse = np.linalg.pinv(slopes, rcond=_FLATTEST)
        step = -np.einsum("nij,nj->ni", inverse, uneven(points))
        length = np.linalg.norm(step, axis=1, keepdims=True)
        points = points + step * np.minimum(
            1.0, _LONGEST_STEP * spacing / np.maximum(length, 1e-30)
        )
    return points


def _as_far_as_kept(mesh: TetrahedralMesh, way: FloatArray) -> FloatArray:
    """Return the positions moved along ways [m], each so far that its tetrahedra stay good."""
    tetrahedra = mesh.tetrahedra
    least = np.minimum(quality(mesh.positions, tetrahedra), _KEPT_QUALITY)
    for n_halvings in itertools.count():
        positions = mesh.positions + way
        is_worse = quality(positions, tetrahedra) < least
        if not is_worse.any():
            return positions
        way[np.unique(tetrahedra[is_worse])] *= 0.5 if n_halvings < _HALVINGS else 0.0
    raise AssertionError("unreachable: where no node moves, none is worse")
