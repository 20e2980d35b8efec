"""When a blade is where on a planned path: at an even speed, from rest to rest."""

import math

import numpy as np

from tissue import FloatArray

SPEED_UP_TIME = 0.1
"""Time in which the blade speeds up, and slows down [s]: the arm has inertia."""

SAMPLE = 5e-3
"""Time between the poses of a planned stroke [s]. 20 of them make a ramp."""

_MOST_SAMPLES = 2000
"""Largest number of poses between the ramps: that of a stroke of 10 s. On a longer one they are
farther apart, so that a mesh in millimetres that is read as metres is soon refused for its size."""


def timed(length: float, speed: float) -> tuple[FloatArray, FloatArray]:
    """Return times [s] from 0, and the length of the path that is behind the blade then [m].

    The speed rises and falls as half a cosine, each over `SPEED_UP_TIME`; on a path too short for
    that it is lower.

    Args:
        length: Length of the path [m].
        speed: Speed between the ramps [m/s].
    """
    speed = min(speed, length / SPEED_UP_TIME)
    duration = length / speed + SPEED_UP_TIME
    ramp = np.linspace(0.0, SPEED_UP_TIME, math.ceil(SPEED_UP_TIME / SAMPLE) + 1)
    n_even = min(math.ceil((duration - 2.0 * SPEED_UP_TIME) / SAMPLE), _MOST_SAMPLES)
    even = np.linspace(SPEED_UP_TIME, duration - SPEED_UP_TIME, n_even + 1)
    # Rounded to a nanosecond, so that the ends of two parts are equal.
    times = np.unique(np.concatenate([ramp, even, duration - ramp]).round(9))
    duration = float(times[-1])
    done = np.where(
        times <= duration / 2.0,
        _ramped(times, speed),
        length - _ramped(duration - times, speed),
    )
    return times, done


def _ramped(times: FloatArray, speed: float) -> FloatArray:
    """Return the distance covered since a start from rest [m]."""
    ramp = np.minimum(times, SPEED_UP_TIME)
    gathering = (
        0.5 * speed * (ramp - SPEED_UP_TIME / math.pi * np.sin(math.pi * ramp / SPEED_UP_TIME))
    )
    return gathering + speed * (times - ramp)
