"""Rigid geoms that touch a tissue: bodies of an arm's model lead them, and feel what it does."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from tissue import FloatArray


class GeomPoses(NamedTuple):
    """Where geoms are."""

    origins: FloatArray
    """Origin of each [m], shape (n, 3)."""
    rotations: FloatArray
    """Axes of each as columns, shape (n, 3, 3)."""


class GeomLoads(NamedTuple):
    """What a tissue did to geoms in the last step."""

    forces: FloatArray
    """Mean force on each [N], shape (n, 3)."""
    torques: FloatArray
    """Mean torque on each about its origin at the end of the step [N m], shape (n, 3)."""


NO_GEOMS = GeomPoses(np.zeros((0, 3)), np.zeros((0, 3, 3)))
"""Where no geoms are."""


def no_geom_loads(n: int) -> GeomLoads:
    """Return the loads on `n` geoms that nothing touches."""
    return GeomLoads(np.zeros((n, 3)), np.zeros((n, 3)))


NO_GEOM_LOADS = no_geom_loads(0)
"""What a tissue does to no geoms."""


def expect_pose_of_each(poses: GeomPoses, n: int) -> None:
    """Refuse poses of another number than that of the geoms.

    Raises:
        ValueError: it is another one.
    """
    if poses.origins.shape != (n, 3) or poses.rotations.shape != (n, 3, 3):
        raise ValueError(
            f"there are origins {poses.origins.shape} and rotations {poses.rotations.shape}, and "
            f"{n} geoms are led from here: they have the shapes ({n}, 3) and ({n}, 3, 3)"
        )


def mean_geom_loads(
    parts: Sequence[GeomLoads], origins: Sequence[FloatArray], seconds: Sequence[float]
) -> GeomLoads:
    """Return the mean loads over several steps, about the origins at the end of the last.

    Args:
        parts: The loads on all geoms in each step.
        origins: Origins of the geoms at the end of each step [m].
        seconds: How long each lasted [s].
    """
    if len(parts) == 1:
        return parts[0]
    total, last = sum(seconds), origins[-1]
    mean = no_geom_loads(len(last))
    for part, at, duration in zip(parts, origins, seconds, strict=True):
        share = duration / total
        mean.forces[:] += share * part.forces
        mean.torques[:] += share * (part.torques + np.cross(at - last, part.forces))
    return mean
