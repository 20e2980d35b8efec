"""Where a hand may lead an instrument: the body and some room around it."""

import math

import numpy as np

from scalpel_sim.scene_parts.scene import Scene
from scalpel_sim.strokes.stroke import Stroke
from tissue import BladeSegment, FloatArray

ROOM = 0.02
"""Room around the body for the tip of a blade [m]: enough to lift it out and set it on elsewhere.
The larger of the arms reaches it around every body of the scenes whose blade stands upright; with
30 mm it would have little room left in its joints."""

ROOM_OF_GRASPER = 0.06
"""Room around the body for the tip of a grasper [m]: enough to lift what it holds, and to lay it
down beside the body."""


def workspace(
    start: BladeSegment, bounds: FloatArray, lowest: float, room: float = ROOM
) -> FloatArray:
    """Return the lowest and the highest place of the middle of the edge [m], shape (2, 3).

    There the tip is in the body, or a little beside or above it, with the edge as at the start; the
    start lies in it wherever it is.

    Args:
        start: The pose of the blade at the start, tissue frame; of a grasper, its pads as an edge.
        bounds: Lowest and highest corner of the body [m], shape (2, 3).
        lowest: Height of what lies under the body [m]; minus infinity: nothing.
        room: How far the tip may be beside the body or above it [m].
    """
    low, high = bounds[0] - room, bounds[1] + room
    low[2] = max(low[2], lowest)
    to_middle = 0.5 * (start.heel - start.tip)
    return np.stack([np.minimum(low, start.tip), np.maximum(high, start.tip)]) + to_middle


def workspace_in(
    scene: Scene, start: BladeSegment, bounds: FloatArray, room: float = ROOM
) -> FloatArray:
    """Return the workspace around the body of a scene: not under its table or floor.

    Args:
        scene: The scene.
        start: See `workspace`, as the rest.
        bounds: Lowest and highest corner of the body [m].
        room: How far the tip may be beside it [m].
    """
    stops = [height for height in (scene.table, scene.floor) if height is not None]
    return workspace(start, bounds, max(stops, default=-math.inf), room)


def resting_stroke(start: BladeSegment) -> Stroke:
    """Return the stroke of a blade that rests until a hand leads it."""
    return Stroke([0.0, 1.0], [start, start], "live hand", is_led=True)
