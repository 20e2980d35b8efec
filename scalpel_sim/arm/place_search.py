"""The search for a place from which an arm reaches a path, clear of what is there."""

import math
import pickle
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from scalpel_sim.arm.kinematics import (
    ArmPoses,
    InstrumentPath,
    Kinematics,
    Places,
    Spheres,
    distance_to_boxes,
    turns_about_z,
)
from scalpel_sim.strokes.stroke import Stroke
from tissue import BoolArray, FloatArray

MOUNT_ANGLES = (0.0, math.pi / 4.0, math.pi / 2.0)
"""Angles between stylus and blade that the search tries [rad]: scalpel handles are straight or
bent. No one angle suits both a blade that stands and one that lies."""

LINK_CLEARANCE = 0.01
"""Smallest distance of the axes of links from the boxes around these [m]."""

MOST_TRIED = 2000
"""Places, the best first, that are tried for one that is clear of other arms: of some 10,000."""

AWKWARD = 2.0
"""Subtracted from the margin of a place where a link passes through the body, or where the base
stands on a column: any place without that is better."""


class Found(NamedTuple):
    """Result of a search."""

    place: Places
    """One place."""
    mount_angle: float
    margin: float
    """Along the path: see `Placement.margin`."""
    score: float
    """Score of the place; not finite where the base cannot stand there."""


MOST_KNOWN = 64
"""Places that are kept: those of a session that varies its scenes, some kilobytes each."""

_known: dict[bytes, Found] = {}
"""Places that were found before, by what the arm was to reach, the oldest first: a search takes up
to a second, and a session prepares the same scene again and again."""


def blade_path(
    stroke: Stroke, boxes: FloatArray, edge_height: float, times: FloatArray
) -> InstrumentPath:
    """Return where the blade's body is along the stroke.

    Args:
        stroke: The stroke.
        boxes: Lowest and highest corners of what lies there [m], shape (2, 3) or (n, 2, 3).
        edge_height: How far the edge lies off the axis of the blade [m].
        times: Instants [s].
    """
    poses = [stroke.pose(t) for t in times]
    heels = np.array([pose.heel for pose in poses])
    tips = np.array([pose.tip for pose in poses])
    edges = (tips - heels) / stroke.blade_length
    backs = -np.array([pose.forward for pose in poses])
    axes = np.stack([np.cross(edges, backs), edges, backs], axis=2)
    boxes = boxes.reshape(-1, 2, 3)
    lowest = min(float(z.min()) for z in (heels[:, 2], tips[:, 2], boxes[:, 0, 2]))
    return InstrumentPath(heels - edge_height * backs, axes, lowest, boxes)


def search_place(
    measures: Kinematics,
    path: InstrumentPath,
    others: Sequence[Spheres] = (),
    *,
    at_start: bool = False,
) -> Found:
    """Return the best of all places that is clear of other arms; the best of all if none is.

    Args:
        measures: Of the arm.
        path: What it is to reach, at the instants at which the others are known.
        others: What covers them.
        at_start: Whether the arms are to be clear of each other at the first instant alone.
    """
    query = pickle.dumps((measures, path, tuple(others), at_start))
    if query not in _known:
        while len(_known) >= MOST_KNOWN:
            del _known[next(iter(_known))]
        _known[query] = _search(measures, path, others, at_start=at_start)
    return _known[query]


def _search(
    measures: Kinematics, path: InstrumentPath, others: Sequence[Spheres], *, at_start: bool
) -> Found:
    """Do `search_place`."""
    places = measures.places(path)
    scores = np.full((len(MOUNT_ANGLES), len(places.yaws)), -np.inf)
    for of_mount, angle in zip(scores, MOUNT_ANGLES, strict=True):
        if at_start:
            tried = _are_clear_at_start(measures, path, places, angle, others)
        else:
            tried = np.ones(len(places.yaws), bool)
        chosen = Places(*(values[tried] for values in places))
        of_mount[tried] = _scores(measures, path, chosen, angle)
    if at_start:
        others = ()
    order = np.argsort(-scores, axis=None, kind="stable")
    order = order[: MOST_TRIED if others else 1]
    for mount, best in zip(*np.unravel_index(order, scores.shape), strict=True):
        place = Places(*(values[best : best + 1] for values in places))
        found = Found(place, MOUNT_ANGLES[mount], 0.0, float(scores[mount, best]))
        if all(_is_clear(measures, path, found, other) for other in others):
            break
    else:
        found = found._replace(score=-math.inf)
    reached = measures.reach(*in_base(path, found.place), found.mount_angle)
    return found._replace(margin=float(reached.margin.min()))


def spheres_along(
    measures: Kinematics, path: InstrumentPath, base: FloatArray, yaw: float, mount_angle: float
) -> Spheres:
    """Return spheres that cover an arm: its base, its links, and its stylus, at each pose.

    Args:
        measures: Of the arm.
        path: Where its instrument is.
        base: Where the arm stands, tissue frame [m], shape (3,).
        yaw: Angle by which it is turned about +z [rad].
        mount_angle: Between stylus and instrument [rad].
    """
    turn, n = turn_about_z(yaw), len(path.positions)
    reached = measures.reach((path.positions - base) @ turn, turn.T @ path.axes, mount_angle)
    bases, turns = np.broadcast_to(base, (n, 3)), np.broadcast_to(turn, (n, 3, 3))
    return measures.spheres(ArmPoses(path, reached.angles, bases, turns, mount_angle))


def _are_clear_at_start(
    measures: Kinematics,
    path: InstrumentPath,
    places: Places,
    mount_angle: float,
    others: Sequence[Spheres],
) -> BoolArray:
    """Return from which places an arm is clear of others at the first instant, shape (n_places,).

    Args:
        measures: Of the arm.
        path: Where its instrument is.
        places: The places.
        mount_angle: Between stylus and instrument [rad].
        others: What covers the others.
    """
    positions, axes = in_base(path, places)
    angles = measures.reach(positions[:, :1], axes[:, :1], mount_angle).angles[:, 0]
    first = path._replace(positions=path.positions[:1], axes=path.axes[:1])
    bases, turns = places.bases, turns_about_z(places.yaws)
    own = measures.spheres(ArmPoses(first, angles, bases, turns, mount_angle))
    clear = np.ones(len(bases), bool)
    for other in others:
        for centre, radius in zip(other.centres[0], other.radii, strict=True):
            apart = np.linalg.norm(own.centres - centre, axis=2)
            clear &= (apart >= own.radii + radius + LINK_CLEARANCE).all(axis=1)
    return clear


def _is_clear(measures: Kinematics, path: InstrumentPath, found: Found, other: Spheres) -> bool:
    """Whether an arm at a place stays clear of another one at each instant."""
    base, yaw = found.place.bases[0], float(found.place.yaws[0])
    own = spheres_along(measures, path, base, yaw, found.mount_angle)
    apart = np.linalg.norm(own.centres[:, :, None] - other.centres[:, None], axis=3)
    return bool((apart >= own.radii[:, None] + other.radii + LINK_CLEARANCE).all())


def _scores(
    measures: Kinematics, path: InstrumentPath, places: Places, mount_angle: float
) -> FloatArray:
    """Return how good each place is: the margin along the path, less `AWKWARD` where it applies."""
    positions, axes = in_base(path, places)
    reached = measures.reach(positions, axes, mount_angle)
    fit = measures.fit(path, places.bases)
    links = measures.links(reached.angles)
    turns = turns_about_z(places.yaws)
    in_tissue = np.einsum("pij,pnkj->pnki", turns, links) + places.bases[:, None, None]
    through = distance_to_boxes(in_tissue, path.boxes) < LINK_CLEARANCE
    passes = through.any(axis=(1, 2))
    score = reached.margin.min(axis=1) - AWKWARD * fit.is_awkward - AWKWARD * passes
    return np.asarray(np.where(fit.can_stand, score, -np.inf))


def in_base(path: InstrumentPath, places: Places) -> tuple[FloatArray, FloatArray]:
    """Return the path as each base sees it, shapes (n_places, n, 3) and (n_places, n, 3, 3)."""
    back = np.swapaxes(turns_about_z(places.yaws), 1, 2)
    offset = path.positions[None] - places.bases[:, None]
    return np.einsum("pij,pnj->pni", back, offset), back[:, None] @ path.axes[None]


def turn_about_z(yaw: float) -> FloatArray:
    """Return the axes of a base that is turned about +z [rad], as columns, shape (3, 3)."""
    return np.asarray(turns_about_z(np.array([yaw]))[0])
