"""The area that a stroke is to cut, in the body at rest, as areas of cuts are counted."""

import itertools

import numpy as np

from scalpel_sim.strokes.stroke import Stroke
from tissue import FloatArray, Snapshot

_POSES, _PLACES = 400, 100
"""Poses of a stroke, and places along its edge, at which the body is looked up."""

_GOLDEN = 0.5 * (5.0**0.5 - 1.0)
"""By which the places move from pose to pose, as a share of their distance: on average they meet
the ends of a body as thin as a sheet, and never twice at the same height."""

_ROUNDING = 1e-9
"""Barycentric weight by which a place may miss a tetrahedron and still be in it."""


def asked_area(stroke: Stroke, body: Snapshot) -> float | None:
    """Return the area that a stroke is to cut [m2], at rest; None for one that says nothing of it.

    It is what the edge passes on its way forward if the body does not give way. What is passed
    twice counts twice.

    Args:
        stroke: In the tissue frame.
        body: The body as it lies before the stroke, tissue frame.
    """
    if stroke.asked is None:
        return None
    return sum(_area_between(stroke, body, *interval) for interval in stroke.asked)


def _area_between(stroke: Stroke, body: Snapshot, start: float, end: float) -> float:
    """Return the area that a stroke is to cut between two instants [m2]."""
    poses = [stroke.pose(t) for t in np.linspace(start, end, _POSES)]
    places, areas = [], []
    for i, (before, after) in enumerate(itertools.pairwise(poses)):
        shares = (np.arange(_PLACES) + i * _GOLDEN % 1.0) / _PLACES
        tip, heel = 0.5 * (before.tip + after.tip), 0.5 * (before.heel + after.heel)
        edge, forward = heel - tip, before.forward + after.forward
        forward = forward / np.linalg.norm(forward)
        motion = 0.5 * (after.tip + after.heel - before.tip - before.heel)
        ahead = max(float(motion @ forward), 0.0) / _PLACES
        places.append(tip + shares[:, None] * edge)
        areas.append(np.broadcast_to(ahead * np.cross(edge, forward), (_PLACES, 3)))
    at_rest = _areas_at_rest(np.concatenate(places), np.concatenate(areas), body)
    return float(np.linalg.norm(at_rest, axis=1).sum())


def _areas_at_rest(places: FloatArray, areas: FloatArray, body: Snapshot) -> FloatArray:
    """Return area vectors in the body at rest [m2]; zero outside the body. Shape (n, 3).

    Args:
        places: Where they are in the body as it lies [m], shape (n, 3).
        areas: Area vectors there [m2], shape (n, 3).
        body: The body.
    """
    from scipy.spatial import cKDTree  # 0.2 s, and only here

    corners = body.positions[body.tetrahedra]
    rest = body.rest_positions[body.tetrahedra]
    lying = np.swapaxes(corners[:, 1:] - corners[:, :1], 1, 2)
    centres = corners.mean(axis=1)
    radii = np.linalg.norm(corners - centres[:, None], axis=2).max(axis=1)
    near = cKDTree(places).query_ball_point(centres, radii)
    holder = np.full(len(places), -1)
    tetrahedra = np.repeat(np.arange(len(near)), [len(found) for found in near])
    candidates = np.array(list(itertools.chain.from_iterable(near)), np.int64)
    offsets = places[candidates] - corners[tetrahedra, 0]
    weights = np.einsum("nij,nj->ni", np.linalg.inv(lying)[tetrahedra], offsets)
    inside = (weights >= -_ROUNDING).all(axis=1) & (weights.sum(axis=1) <= 1.0 + _ROUNDING)
    holder[candidates[inside]] = tetrahedra[inside]
    held = np.flatnonzero(holder >= 0)
    gradients = lying @ np.linalg.inv(np.swapaxes(rest[:, 1:] - rest[:, :1], 1, 2))
    found = gradients[holder[held]]
    at_rest = np.zeros_like(areas)
    # Nanson's formula: area at rest = transposed gradient x area / ratio of volumes.
    at_rest[held] = np.einsum("nji,nj->ni", found, areas[held]) / np.linalg.det(found)[:, None]
    return at_rest
