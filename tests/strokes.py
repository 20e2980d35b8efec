"""Strokes of a blade that is moved by itself, without an arm: poses of the edge, one a frame."""

import itertools
from collections.abc import Callable, Iterator, Sequence

import numpy as np

from tissue import BladeSegment, BladeSweep, FloatArray, StepResult, TetrahedralMesh, Tissue

DT = 1e-3
"""A frame [s]."""

SPEED = 0.25
"""Of the blade [m/s]."""

DRAGGED = 0.03
"""How far a blade goes on behind the body at least [m], for it drags tissue along."""

Y, Z = np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0])

Stroke = list[BladeSegment]


def pose(tip: Sequence[float], heel: Sequence[float], forward: Sequence[float]) -> BladeSegment:
    """Return the edge between two points [m], facing that way."""
    ahead = np.array(forward, dtype=np.float64)
    return BladeSegment(
        np.array(tip, dtype=np.float64),
        np.array(heel, dtype=np.float64),
        ahead / np.linalg.norm(ahead),
    )


def sweeps(stroke: Stroke) -> Iterator[BladeSweep]:
    """Yield the motion from each pose to the next."""
    for before, after in itertools.pairwise(stroke):
        yield BladeSweep(before, after)


def make(tissue: Tissue, stroke: Stroke, dt: float = DT) -> list[StepResult]:
    """Let the blade do its stroke; return what each frame did."""
    return [tissue.step(sweep, dt) for sweep in sweeps(stroke)]


def along_y(start: float, stop: float, speed: float = SPEED) -> FloatArray:
    """Return where the blade is along y in each frame [m]."""
    n = int(np.ceil(abs(stop - start) / (speed * DT)))
    return np.linspace(start, stop, n + 1)


def upright(
    x: float, start: float, stop: float, low: float, high: float, speed: float = SPEED
) -> Stroke:
    """Return a stroke along y of an upright edge at `x`, from height `low` to `high` [m]."""
    way = 1.0 if stop > start else -1.0
    return [pose((x, y, low), (x, y, high), (0.0, way, 0.0)) for y in along_y(start, stop, speed)]


def _through(
    mesh: TetrahedralMesh, place: Callable[[float], tuple[FloatArray, FloatArray, FloatArray]]
) -> Stroke:
    """Return the stroke of an edge longer than the body is high, through it from front to back.

    `place` gives, for a share of the way through, the middle of the edge and the unit vectors along
    it and forward. The stroke goes on behind the body, for the blade drags tissue along.
    """
    low, high = mesh.positions.min(axis=0), mesh.positions.max(axis=0)
    depth = high[1] - low[1]
    half = 0.5 * float(np.linalg.norm((high - low)[1:])) + 0.3 * (high - low)[2]
    stroke = []
    for y in along_y(low[1] - 0.25 * depth, high[1] + 0.75 * depth + DRAGGED):
        middle, along, forward = place((y - low[1]) / depth)
        stroke.append(pose(middle - half * along, middle + half * along, forward))
    return stroke


def straight(mesh: TetrahedralMesh, at: float = 0.5) -> Stroke:
    """Return an upright blade going straight through, at that share of the body's width."""
    low, high = mesh.positions.min(axis=0), mesh.positions.max(axis=0)

    def place(share: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        middle = low + np.array([at, share, 0.5]) * (high - low)
        return middle, Z, Y

    return _through(mesh, place)


def slanted(mesh: TetrahedralMesh, lean: float = 0.35, rake: float = 0.3) -> Stroke:
    """Return a blade that leans sideways and forwards [rad], going straight through."""
    low, high = mesh.positions.min(axis=0), mesh.positions.max(axis=0)
    along = np.array([np.sin(lean), np.sin(rake), np.cos(lean)])
    along /= np.linalg.norm(along)

    def place(share: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        return low + np.array([0.5, share, 0.5]) * (high - low), along, Y

    return _through(mesh, place)


def curved(mesh: TetrahedralMesh, bow: float = 0.12) -> Stroke:
    """Return an upright blade going through in an arc that bows out by a share of the width."""
    low, high = mesh.positions.min(axis=0), mesh.positions.max(axis=0)
    width, depth = (high - low)[:2]

    def place(share: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        at = 0.5 + bow * np.sin(np.pi * min(max(share, 0.0), 1.0))
        slope = bow * width * np.pi * np.cos(np.pi * min(max(share, 0.0), 1.0)) / depth
        forward = np.array([slope, 1.0, 0.0])
        inside = 0.0 <= share <= 1.0
        x = at if inside else 0.5 + slope * depth / width * (share if share < 0.0 else share - 1.0)
        middle = low + np.array([x, share, 0.5]) * (high - low)
        return middle, Z, forward / np.linalg.norm(forward)

    return _through(mesh, place)


THROUGH = {"straight": straight, "slanted": slanted, "curved": curved}
