"""The area that a stroke is to cut, in the body at rest, as areas of cuts are counted."""

import itertools

import numpy as np

from scalpel_sim.strokes.material_at import tetrahedra_at
from scalpel_sim.strokes.stroke import Stroke
from tissue import FloatArray, Snapshot

_POSES, _PLACES = 400, 100
"""Poses of a stroke, and places along its edge, at which the body is looked up."""

_GOLDEN = 0.5 * (5.0**0.5 - 1.0)
"""By which the places move from pose to pose, as a share of their distance: on average they meet
the ends of a body as thin as a sheet, and never twice at the same height."""


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
    holder, _ = tetrahedra_at(places, body)
    held = np.flatnonzero(holder >= 0)
    corners, rest = (
        part[body.tetrahedra[holder[held]]] for part in (body.positions, body.rest_positions)
    )
    lying = np.swapaxes(corners[:, 1:] - corners[:, :1], 1, 2)
    found = lying @ np.linalg.inv(np.swapaxes(rest[:, 1:] - rest[:, :1], 1, 2))
    at_rest = np.zeros_like(areas)
    # Nanson's formula: area at rest = transposed gradient x area / ratio of volumes.
    at_rest[held] = np.einsum("nji,nj->ni", found, areas[held]) / np.linalg.det(found)[:, None]
    return at_rest
