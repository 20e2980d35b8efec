"""Random strokes across a body, for benchmarks of what many cuts cost."""

import numpy as np

from tissue import BladeSegment, Tissue

STROKE_DT = 1e-3
"""Time step of the strokes [s]."""
STROKE_FLOOR = -0.02
"""Height of the floor on which pieces land that the strokes cut off [m]."""


def random_stroke(tissue: Tissue, random: np.random.Generator) -> list[BladeSegment]:
    """Return a stroke across the body at a random position, direction, lean, depth and speed.

    One pose of the edge for each time step.
    """
    low, high = tissue.bounds
    centre, extent = (low + high) / 2.0, high - low
    yaw, lean = random.uniform(0.0, 2.0 * np.pi), random.uniform(-0.5, 0.5)
    direction = np.array([np.cos(yaw), np.sin(yaw), 0.0])
    side = np.array([-direction[1], direction[0], 0.0])
    up = np.cos(lean) * np.array([0.0, 0.0, 1.0]) + np.sin(lean) * side
    middle = centre + side * random.uniform(-0.35, 0.35) * extent[:2].min()
    middle[2] = high[2] - random.uniform(0.1, 0.6) * extent[2]
    half = 0.5 * float(np.linalg.norm(extent[:2])) + 0.01
    speed = random.uniform(0.1, 0.3)
    along = np.arange(-half, half, speed * STROKE_DT)
    return [
        BladeSegment(tip, tip + (extent[2] + 0.02) * up, direction)
        for tip in (middle + s * direction for s in along)
    ]
