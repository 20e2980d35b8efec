"""Strokes of a blade without an arm: poses of the edge, one for each frame."""

import itertools
from collections.abc import Callable, Iterator, Sequence

import numpy as np

from tissue import BladeSegment, BladeSweep, FloatArray, StepResult, TetrahedralMesh, Tissue

DT = 1e-3
"""Length of a frame [s]."""

SPEED = 0.25
"""Speed of the blade [m/s]."""

OVERRUN = 0.03
"""Least distance by which a stroke continues behind the body [m]: the blade drags tissue along."""

Y, Z = np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0])

Stroke = list[BladeSegment]


def pose(tip: Sequence[float], heel: Sequence[float], forward: Sequence[float]) -> BladeSegment:
    """Return the edge between two points [m] that faces in direction `forward`."""
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
    """Perform a stroke of the blade; return the result of each frame."""
    return [tissue.step(sweep, dt) for sweep in sweeps(stroke)]


def along_y(start: float, stop: float, speed: float = SPEED) -> FloatArray:
    """Return the y of the blade in each frame [m]."""
    n = int(np.ceil(abs(stop - start) / (speed * DT)))
    return np.linspace(start, stop, n + 1)


def upright(
    x: float, start: float, stop: float, low: float, high: float, speed: float = SPEED
) -> Stroke:
    """Return a stroke along y of an upright edge at `x`, from height `low` to `high` [m]."""
    direction = 1.0 if stop > start else -1.0
    return [
        pose((x, y, low), (x, y, high), (0.0, direction, 0.0)) for y in along_y(start, stop, speed)
    ]


def _through(
    mesh: TetrahedralMesh, pose_at: Callable[[float], tuple[FloatArray, FloatArray, FloatArray]]
) -> Stroke:
    """Return the stroke from front to back of an edge that is longer than the body is high.

    `pose_at` gives the middle of the edge and the unit vectors along it and forward, for a share of
    the depth of the body. The stroke continues behind the body: the blade drags tissue along.
    """
    low, high = mesh.positions.min(axis=0), mesh.positions.max(axis=0)
    depth = high[1] - low[1]
    half = 0.5 * float(np.linalg.norm((high - low)[1:])) + 0.3 * (high - low)[2]
    stroke = []
    for y in along_y(low[1] - 0.25 * depth, high[1] + 0.75 * depth + OVERRUN):
        middle, along, forward = pose_at((y - low[1]) / depth)
        stroke.append(pose(middle - half * along, middle + half * along, forward))
    return stroke


def straight(mesh: TetrahedralMesh, at: float = 0.5) -> Stroke:
    """Return the stroke of an upright blade straight through, at a share of the body's width."""
    low, high = mesh.positions.min(axis=0), mesh.positions.max(axis=0)

    def pose_at(share: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        middle = low + np.array([at, share, 0.5]) * (high - low)
        return middle, Z, Y

    return _through(mesh, pose_at)


def slanted(mesh: TetrahedralMesh, lean: float = 0.35, rake: float = 0.3) -> Stroke:
    """Return the straight stroke of a blade that leans sideways and forwards [rad]."""
    low, high = mesh.positions.min(axis=0), mesh.positions.max(axis=0)
    along = np.array([np.sin(lean), np.sin(rake), np.cos(lean)])
    along /= np.linalg.norm(along)

    def pose_at(share: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        return low + np.array([0.5, share, 0.5]) * (high - low), along, Y

    return _through(mesh, pose_at)


def curved(mesh: TetrahedralMesh, bow: float = 0.12) -> Stroke:
    """Return the stroke of an upright blade in an arc that bows out by a share of the width."""
    low, high = mesh.positions.min(axis=0), mesh.positions.max(axis=0)
    width, depth = (high - low)[:2]

    def pose_at(share: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        at = 0.5 + bow * np.sin(np.pi * min(max(share, 0.0), 1.0))
        slope = bow * width * np.pi * np.cos(np.pi * min(max(share, 0.0), 1.0)) / depth
        forward = np.array([slope, 1.0, 0.0])
        inside = 0.0 <= share <= 1.0
        x = at if inside else 0.5 + slope * depth / width * (share if share < 0.0 else share - 1.0)
        middle = low + np.array([x, share, 0.5]) * (high - low)
        return middle, Z, forward / np.linalg.norm(forward)

    return _through(mesh, pose_at)


THROUGH = {"straight": straight, "slanted": slanted, "curved": curved}
