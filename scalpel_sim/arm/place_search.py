"""The search for a place from which a PHANTOM-like arm reaches a path, clear of what is there."""

import math
import pickle
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from scalpel_sim.arm.inverse_kinematics import Geometry, reach, separate_components
from scalpel_sim.strokes.stroke import Stroke
from tissue import BoolArray, FloatArray

YAWS = np.arange(24) * (2.0 * math.pi / 24)
"""Directions from the base to the stroke that the search tries [rad]."""

DISTANCES, HEIGHTS = np.linspace(0.25, 1.0, 11), np.linspace(-0.7, 0.7, 13)
"""Distances of the middle of the stroke from the axis of the waist, and heights over the shoulder,
that the search tries, as fractions of the length of the stretched arm."""

MOUNT_ANGLES = (0.0, math.pi / 4.0, math.pi / 2.0)
"""Angles between stylus and blade that the search tries [rad]: scalpel handles are straight or
bent. No one angle suits both a blade that stands and one that lies."""

BASE_RADIUS = 0.08
"""Radius about the axis of the waist in which neither body nor board must lie [m]."""

LINK_CLEARANCE = 0.01
"""Smallest distance of the axes of upper arm and forearm from the boxes around these [m]."""

LINK_RADIUS = 0.02
"""Radius of the spheres that cover upper arm, forearm and stylus [m]: capsules of 8 mm, of which
every quarter of the length has a point."""

MOST_TRIED = 2000
"""Places, the best first, that are tried for one that is clear of other arms: of some 10,000."""

TABLE_ROUNDING = 1e-9
"""Height by which a base that stands on a table may be off it [m]."""

TABLE_CLEARANCE = 0.01
"""Distance of the table from the lowest point of blade and body [m]: the blade passes beneath the
body."""

AWKWARD = 2.0
"""Subtracted from the margin of a place where a link passes through the body, or where the base
stands on a column: any place without that is better."""


class Spheres(NamedTuple):
    """Spheres that cover an arm along its way, at some instants. Tissue frame."""

    centres: FloatArray
    """Their centres [m], shape (n_instants, n, 3)."""
    radii: FloatArray
    """Their radii [m], shape (n,)."""


class InstrumentPath(NamedTuple):
    """Poses of the blade's body along a stroke, tissue frame."""

    positions: FloatArray
    """Origin of the blade's body [m], shape (n, 3)."""
    axes: FloatArray
    """Axes of the blade's body as columns, shape (n, 3, 3)."""
    lowest: float
    """Lowest height of the blade along the stroke, and of what lies there [m]."""
    boxes: FloatArray
    """Lowest and highest corners of what lies there: tissue, a table's board [m], (n, 2, 3)."""
    table: float | None = None
    """Height of a table that is there [m]; None: it is where the arm needs it."""


class Places(NamedTuple):
    """Candidate places of the base, relative to the middle of the stroke; arrays of one shape."""

    yaws: FloatArray
    distances: FloatArray
    heights: FloatArray
    """Height of the middle of the stroke over the base's underside [m]."""


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
    measures: Geometry,
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
    measures: Geometry, path: InstrumentPath, others: Sequence[Spheres], *, at_start: bool
) -> Found:
    """Do `search_place`."""
    length = measures.upper + measures.forearm + measures.neck
    heights = HEIGHTS * length + measures.shoulder
    if path.table is not None:  # the base may stand on it
        heights = np.append(heights, _middle(path)[2] - path.table)
    grid = np.meshgrid(YAWS, DISTANCES * length, heights, indexing="ij")
    places = Places(*(values.ravel() for values in grid))
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
    reached = reach(measures, *in_base(path, found.place), found.mount_angle)
    return found._replace(margin=float(reached.margin.min()))


def spheres_along(
    measures: Geometry, path: InstrumentPath, base: FloatArray, yaw: float, mount_angle: float
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
    reached = reach(measures, (path.positions - base) @ turn, turn.T @ path.axes, mount_angle)
    bases, turns = np.broadcast_to(base, (n, 3)), np.broadcast_to(turn, (n, 3, 3))
    return _spheres(measures, path, reached.angles, bases, turns, mount_angle)


def _spheres(
    measures: Geometry,
    path: InstrumentPath,
    angles: FloatArray,
    bases: FloatArray,
    turns: FloatArray,
    mount_angle: float,
) -> Spheres:
    """Return spheres that cover an arm at n poses, or at one pose from n bases.

    Args:
        measures: Of the arm.
        path: The poses, or the one.
        angles: Of the joints [rad], shape (n, 6).
        bases: Where the arm stands, tissue frame [m], shape (n, 3).
        turns: Axes of the base as columns, shape (n, 3, 3).
        mount_angle: Between stylus and instrument [rad].
    """
    c, s = math.cos(mount_angle), math.sin(mount_angle)
    stylus = path.axes @ np.array([0.0, c, -s])
    gimbal = path.positions - measures.neck * stylus
    along = np.stack([gimbal - d * stylus for d in (0.0, 0.03, 0.06)], axis=1)
    column = np.multiply.outer(np.linspace(0.0, measures.shoulder, 4), [0.0, 0.0, 1.0])
    links = _links(measures, angles) @ np.swapaxes(turns, 1, 2)
    parts = [
        (bases[:, None] + column, BASE_RADIUS),
        (bases[:, None] + links, LINK_RADIUS),
        (np.broadcast_to(along, (len(bases), *along.shape[1:])), LINK_RADIUS),
    ]
    return Spheres(
        np.concatenate([centres for centres, _ in parts], axis=1),
        np.concatenate([np.full(centres.shape[1], radius) for centres, radius in parts]),
    )


def _are_clear_at_start(
    measures: Geometry,
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
    angles = reach(measures, positions[:, 0], axes[:, 0], mount_angle).angles
    first = path._replace(positions=path.positions[:1], axes=path.axes[:1])
    bases, turns = base_of(path, places), _turns(places.yaws)
    own = _spheres(measures, first, angles, bases, turns, mount_angle)
    clear = np.ones(len(bases), bool)
    for other in others:
        for centre, radius in zip(other.centres[0], other.radii, strict=True):
            apart = np.linalg.norm(own.centres - centre, axis=2)
            clear &= (apart >= own.radii + radius + LINK_CLEARANCE).all(axis=1)
    return clear


def _is_clear(measures: Geometry, path: InstrumentPath, found: Found, other: Spheres) -> bool:
    """Whether an arm at a place stays clear of another one at each instant."""
    base, yaw = base_of(path, found.place)[0], float(found.place.yaws[0])
    own = spheres_along(measures, path, base, yaw, found.mount_angle)
    apart = np.linalg.norm(own.centres[:, :, None] - other.centres[:, None], axis=3)
    return bool((apart >= own.radii[:, None] + other.radii + LINK_CLEARANCE).all())


def _scores(
    measures: Geometry, path: InstrumentPath, places: Places, mount_angle: float
) -> FloatArray:
    """Return how good each place is: the margin along the path, less `AWKWARD` where it applies."""
    positions, axes = in_base(path, places)
    reached = reach(measures, positions, axes, mount_angle)
    base = base_of(path, places)
    stands_beside = _distance_to_boxes(base[:, :2], path.boxes[..., :2]) >= BASE_RADIUS
    if path.table is None:
        on_column = base[:, 2] > path.lowest - TABLE_CLEARANCE
    else:
        stands_beside &= base[:, 2] >= path.table - TABLE_ROUNDING
        on_column = base[:, 2] > path.table + TABLE_ROUNDING
    links = _links(measures, reached.angles)
    in_tissue = np.einsum("pij,pnkj->pnki", _turns(places.yaws), links) + base[:, None, None]
    through = _distance_to_boxes(in_tissue, path.boxes) < LINK_CLEARANCE
    score = reached.margin.min(axis=1) - AWKWARD * on_column - AWKWARD * through.any(axis=(1, 2))
    return np.asarray(np.where(stands_beside, score, -np.inf))


def base_of(path: InstrumentPath, places: Places) -> FloatArray:
    """Return where the base stands, tissue frame [m], shape (n_places, 3)."""
    outward = _turns(places.yaws)[:, :, 1]
    adjacent = _middle(path) - places.distances[:, None] * outward
    return np.asarray(adjacent - np.multiply.outer(places.heights, [0.0, 0.0, 1.0]))


def in_base(path: InstrumentPath, places: Places) -> tuple[FloatArray, FloatArray]:
    """Return the path as each base sees it, shapes (n_places, n, 3) and (n_places, n, 3, 3)."""
    back = np.swapaxes(_turns(places.yaws), 1, 2)
    offset = path.positions[None] - base_of(path, places)[:, None]
    return np.einsum("pij,pnj->pni", back, offset), back[:, None] @ path.axes[None]


def _middle(path: InstrumentPath) -> FloatArray:
    """Return the middle of the box around the positions along the path [m], shape (3,)."""
    return np.asarray((path.positions.min(axis=0) + path.positions.max(axis=0)) / 2.0)


def turn_about_z(yaw: float) -> FloatArray:
    """Return the axes of a base that is turned about +z [rad], as columns, shape (3, 3)."""
    return np.asarray(_turns(np.array([yaw]))[0])


def _turns(yaws: FloatArray) -> FloatArray:
    """Return rotations about z, shape (n, 3, 3)."""
    c, s, zero = np.cos(yaws), np.sin(yaws), np.zeros_like(yaws)
    return np.stack([c, -s, zero, s, c, zero, zero, zero, zero + 1.0], axis=1).reshape(-1, 3, 3)


def _links(measures: Geometry, angles: FloatArray) -> FloatArray:
    """Return points along upper arm and forearm in the frame of the base, shape (..., 8, 3)."""
    waist, shoulder, elbow, *_ = separate_components(angles)[..., None]
    level = shoulder + elbow - measures.bend
    upper = measures.upper * np.array([0.25, 0.5, 0.75, 1.0, 1.0, 1.0, 1.0, 1.0])
    forearm = measures.forearm * np.array([0.0, 0.0, 0.0, 0.0, 0.25, 0.5, 0.75, 1.0])
    out = upper * np.cos(shoulder) + forearm * np.cos(level)
    up = measures.shoulder + upper * np.sin(shoulder) + forearm * np.sin(level)
    return np.stack([-np.sin(waist) * out, np.cos(waist) * out, up], axis=-1)


def _distance_to_boxes(points: FloatArray, boxes: FloatArray) -> FloatArray:
    """Return how far points are from the nearest box [m]; 0 inside."""
    apart = [
        np.linalg.norm(np.maximum(np.maximum(low - points, points - high), 0.0), axis=-1)
        for low, high in boxes
    ]
    return np.asarray(np.min(apart, axis=0))
