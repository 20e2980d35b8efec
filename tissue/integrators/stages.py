"""Scratch of a Runge-Kutta step."""

from tissue.core.array_types import FloatArray
from tissue.core.simd import room_for_points
from tissue.core.structs import Arrays


class Stages(Arrays):
    """Positions, velocities and accelerations within a step, each of shape (capacity, 3)."""

    positions: FloatArray
    """Positions of the second stage, and of the third where that is at the same instant [m]."""
    last_positions: FloatArray
    """Positions of the last stage [m]."""
    velocities: FloatArray
    """Velocities of the second stage, then of the last [m/s]."""
    change: FloatArray
    """Velocities of the third stage less those of the second [m/s]."""
    external: FloatArray
    """Forces of the blade on nodes [N]: zero everywhere but at those that it acts on."""
    loads: FloatArray
    """Loads on nodes [N], constant in a step."""
    a1: FloatArray
    """Accelerations of the first stage [m/s2]."""
    a2: FloatArray
    """Accelerations of the second stage [m/s2]."""
    start_positions: FloatArray
    """Positions before the step [m], where the loss in damped stages is counted."""
    start_velocities: FloatArray
    """Velocities before the step [m/s], where the loss in damped stages is counted."""


def new_stages(n_nodes: int) -> Stages:
    """Return scratch for that many nodes."""
    return Stages(**{name: room_for_points(n_nodes) for name in Stages.__annotations__})
