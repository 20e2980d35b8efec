"""A wrench about another point."""

import numpy as np

from tissue import FloatArray, Wrench

ORIGIN = np.zeros(3)


def about(wrench: Wrench, point: FloatArray) -> FloatArray:
    """Return force [N] and torque about a point [N m] of a wrench, shape (6,)."""
    x, y, z = (wrench.point - point).tolist()
    fx, fy, fz = wrench.force.tolist()
    tx, ty, tz = wrench.torque.tolist()
    return np.array((fx, fy, fz, tx + y * fz - z * fy, ty + z * fx - x * fz, tz + x * fy - y * fx))
