"""A cut given as shares of a body: an arm leads an upright edge along a path through it."""

from typing import NamedTuple

import numpy as np

from bridge import InProcessLink, TissueFrame
from scalpel_sim.arm.placement import place
from scalpel_sim.preparation.tissue import make_tissue
from scalpel_sim.scene.scene import Scene
from scalpel_sim.simulation import Simulation
from scalpel_sim.strokes.stroke import Stroke
from tissue import BladeSegment, FloatArray, Tissue

_SPEED = 0.06
"""Speed of the blade [m/s]."""
POSE_EVERY = 1e-3
"""Distance between two poses of a stroke [m]."""
_ABOVE = 0.35
"""Height of the edge above the body, as a share of its height."""


class PlannedCut(NamedTuple):
    """A body and a path of the blade through it."""

    scene: Scene
    path: FloatArray
    """Corners of the path seen from above, as shares of the body's extent along x and y; shape
    (n, 2). Between them it runs smoothly."""
    depth: float
    """Depth of the tip below the body's upper side, as a share of its height."""
    lean: float = 0.0
    """By how much the edge leans towards +x [rad]."""


def prepare_cut(cut: PlannedCut, tissue: Tissue | None = None) -> Simulation:
    """Return the simulation of a cut, at its start: arm in place, and the scene's body or yours."""
    link = InProcessLink(tissue or make_tissue(cut.scene), cut.scene.name)
    bounds = link.describe().bounds
    stroke = _stroke(cut, bounds)
    placement = place(stroke, bounds, cut.scene.arm.preset)
    frame = TissueFrame(origin=placement.tissue_origin)
    return Simulation(placement.arm(), stroke, link, frame)


def _stroke(cut: PlannedCut, bounds: FloatArray) -> Stroke:
    """Return the stroke along the path, with the edge a little longer than it cuts deep."""
    low, high = bounds
    corners = low[:2] + cut.path * (high - low)[:2]
    path = _evenly(_smooth(corners))
    ahead = np.gradient(path, axis=0)
    ahead /= np.linalg.norm(ahead, axis=1, keepdims=True)
    height = float(high[2] - low[2])
    up = np.array([np.sin(cut.lean), 0.0, np.cos(cut.lean)])
    below, above = cut.depth * height, _ABOVE * height
    segments = []
    for (x, y), forward in zip(path, ahead, strict=True):
        at = np.array([x, y, high[2]])
        segments.append(BladeSegment(at - below * up, at + above * up, np.array([*forward, 0.0])))
    times = (
        np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))]) / _SPEED
    )
    return Stroke(times, segments, cut.scene.name)


def _smooth(corners: FloatArray) -> FloatArray:
    """Return a curve through the corners (Catmull and Rom's), shape (n, 2)."""
    if len(corners) == 2:
        return corners
    padded = np.concatenate(
        [[2.0 * corners[0] - corners[1]], corners, [2.0 * corners[-1] - corners[-2]]]
    )
    t = np.linspace(0.0, 1.0, 64, endpoint=False)[:, None]
    parts = []
    for p0, p1, p2, p3 in zip(padded, padded[1:], padded[2:], padded[3:], strict=False):
        parts.append(
            0.5
            * (
                2.0 * p1
                + (p2 - p0) * t
                + (2.0 * p0 - 5.0 * p1 + 4.0 * p2 - p3) * t**2
                + (3.0 * p1 - p0 - 3.0 * p2 + p3) * t**3
            )
        )
    return np.concatenate([*parts, corners[-1:]])


def _evenly(curve: FloatArray) -> FloatArray:
    """Return points on a curve that lie `POSE_EVERY` apart, shape (n, 2)."""
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(curve, axis=0), axis=1))])
    at = np.linspace(0.0, along[-1], max(2, int(np.ceil(along[-1] / POSE_EVERY)) + 1))
    return np.stack([np.interp(at, along, curve[:, i]) for i in range(2)], axis=1)
