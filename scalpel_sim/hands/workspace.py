"""Where a hand may lead the blade: the body and some room around it, which the arm reaches."""

import math

import numpy as np

from scalpel_sim.scene_parts.scene import Scene
from scalpel_sim.strokes.stroke import Stroke
from tissue import BladeSegment, FloatArray

ROOM = 0.02
"""Room around the body for the tip [m]: enough to lift the blade out and set it on elsewhere. The
larger of the arms reaches it around every scene; with 30 mm it would have little room left in its
joints."""

_CORNERS = ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 1, 1), (1, 1, 1), (1, 0, 1), (0, 0, 1))
"""Corners of a box in an order in which each is beside the next: 0 is low, 1 is high."""


def workspace(start: BladeSegment, bounds: FloatArray, lowest: float) -> FloatArray:
    """Return the lowest and the highest place of the middle of the edge [m], shape (2, 3).

    There the tip is in the body, or at most `ROOM` beside or above it, with the edge as at the
    start; the start lies in it wherever it is.

    Args:
        start: The pose of the blade at the start, tissue frame.
        bounds: Lowest and highest corner of the body [m], shape (2, 3).
        lowest: Height of what lies under the body [m]; minus infinity: nothing.
    """
    low, high = bounds[0] - ROOM, bounds[1] + ROOM
    low[2] = max(low[2], lowest)
    to_middle = 0.5 * (start.heel - start.tip)
    return np.stack([np.minimum(low, start.tip), np.maximum(high, start.tip)]) + to_middle


def workspace_in(scene: Scene, start: BladeSegment, bounds: FloatArray) -> FloatArray:
    """Return the workspace around the body of a scene: not under its table or floor.

    Args:
        scene: The scene.
        start: See `workspace`.
        bounds: See `workspace`.
    """
    stops = [height for height in (scene.table, scene.floor) if height is not None]
    return workspace(start, bounds, max(stops, default=-math.inf))


def resting_stroke(start: BladeSegment) -> Stroke:
    """Return the stroke of a blade that rests until a hand leads it."""
    return Stroke([0.0, 1.0], [start, start], "live hand", is_led=True)


def tour_of(workspace: FloatArray, start: BladeSegment) -> Stroke:
    """Return a stroke from the start to all corners of a workspace, one a second.

    Args:
        workspace: See `workspace`.
        start: The pose of the blade at the start; it keeps its direction.
    """
    middle = 0.5 * (start.tip + start.heel)
    places = [middle, *(workspace[np.array(corner), np.arange(3)] for corner in _CORNERS)]
    poses = [
        start._replace(tip=start.tip + (place - middle), heel=start.heel + (place - middle))
        for place in places
    ]
    return Stroke(np.arange(float(len(poses))), poses, "live hand", is_led=True)
