"""Frames and rigid geoms that act on a tissue.

Bodies of an arm's model drive them, and feel what the tissue does to them.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from tissue import FloatArray, IntArray, Wrench

TissueRegion = str | IntArray | FloatArray
"""A region of tissue as text, numbers of nodes (n,), or places in the body at rest [m], (n, 3)."""


class FramePose(NamedTuple):
    """Pose of a frame."""

    origin: FloatArray
    """Origin of the frame [m], shape (3,)."""
    rotation: FloatArray
    """Axes of the frame as columns, shape (3, 3); at first the axes of the tissue."""


class FrameLoad(NamedTuple):
    """Load of a tissue on a frame in the last step."""

    wrench: Wrench
    """Mean wrench on the frame, about its origin at the end of the step."""
    n_points: int
    """Number of points of the tissue through which it acts now; 0 after its release."""


class FrameAttachment(NamedTuple):
    """Attachment of a frame to tissue: what `tissue.Tissue.attach` takes."""

    where: TissueRegion
    """A region as text, numbers of nodes, or places in the body at rest [m]."""
    stiffness: float
    """Total stiffness of the springs [N/m]."""
    damping: float = 0.0
    """Total damping of the springs [N s/m]."""
    breaks_at: float = math.inf
    """Force at which the frame releases the tissue [N]."""
    origin: FloatArray | None = None
    """Origin of the frame [m]; None: the mean of the points."""


class FrameTie(NamedTuple):
    """Fibres that tie tissue to a frame: what `tissue.Tissue.tie` takes."""

    where: TissueRegion
    """Where the fibres begin; as `FrameAttachment.where`."""
    to: FloatArray
    """Where the fibres end [m], shape (n, 3): one place for all, or one for each."""
    stiffness: float
    """Total stiffness of the fibres along them [N/m]."""
    area: float
    """Total cross-section of the fibres [m2]."""
    toughness: float
    """Energy of cutting a fibre [J/m2]."""
    damping: float = 0.0
    """Total damping of the fibres along them [N s/m]."""
    rest_length: float | None = None
    """Length up to which each is slack [m]; None: the distance of its ends."""
    breaks_at: float = math.inf
    """Total force of the fibres at which they break [N]."""


def plain_region(where: str | npt.ArrayLike) -> TissueRegion:
    """Return a region as `FrameAttachment.where` takes it; a mask becomes numbers of nodes."""
    if isinstance(where, str):
        return where
    array = np.asarray(where)
    if array.dtype == np.bool_:
        array = np.flatnonzero(array)
    if array.dtype.kind in "iu":
        return np.atleast_1d(array).astype(np.int64)
    return np.atleast_2d(array.astype(np.float64))


def expect_each(poses: Sequence[FramePose], n: int) -> None:
    """Refuse poses of another number than that of the frames.

    Raises:
        ValueError: it is another one.
    """
    if len(poses) != n:
        raise ValueError(
            f"a step has poses of {len(poses)} frames, and {n} are driven from here; give one for "
            "each"
        )


def combined_loads(
    parts: Sequence[Sequence[FrameLoad]], seconds: Sequence[float]
) -> list[FrameLoad]:
    """Return the mean loads over several steps, about the origins in the last of them.

    Args:
        parts: The loads on all frames in each step.
        seconds: How long each lasted [s].
    """
    last = parts[-1]
    if len(parts) == 1:
        return list(last)
    return [
        FrameLoad(mean_wrench([part[i].wrench for part in parts], seconds), last[i].n_points)
        for i in range(len(last))
    ]


def mean_wrench(wrenches: Sequence[Wrench], seconds: Sequence[float]) -> Wrench:
    """Return the mean of wrenches over time, about the point of the last."""
    point, total = wrenches[-1].point, sum(seconds)
    force, torque = np.zeros(3), np.zeros(3)
    for wrench, duration in zip(wrenches, seconds, strict=True):
        share = duration / total
        force += share * wrench.force
        torque += share * wrench.about(point).torque
    return Wrench(force, torque, point)


class GeomPoses(NamedTuple):
    """Poses of geoms."""

    origins: FloatArray
    """Origin of each geom [m], shape (n, 3)."""
    rotations: FloatArray
    """Axes of each geom as columns, shape (n, 3, 3)."""


class GeomLoads(NamedTuple):
    """Loads of a tissue on geoms in the last step."""

    forces: FloatArray
    """Mean force on each geom [N], shape (n, 3)."""
    torques: FloatArray
    """Mean torque on each geom about its origin at the end of the step [N m], shape (n, 3)."""


NO_GEOMS = GeomPoses(np.zeros((0, 3)), np.zeros((0, 3, 3)))
"""Poses of no geoms."""


def no_geom_loads(n: int) -> GeomLoads:
    """Return the loads on `n` geoms that nothing touches."""
    return GeomLoads(np.zeros((n, 3)), np.zeros((n, 3)))


NO_GEOM_LOADS = no_geom_loads(0)
"""Loads on no geoms."""


def expect_pose_of_each(poses: GeomPoses, n: int) -> None:
    """Refuse poses of another number than that of the geoms.

    Raises:
        ValueError: it is another one.
    """
    if poses.origins.shape != (n, 3) or poses.rotations.shape != (n, 3, 3):
        raise ValueError(
            f"there are origins {poses.origins.shape} and rotations {poses.rotations.shape}, and "
            f"{n} geoms are driven from here: they have the shapes ({n}, 3) and ({n}, 3, 3)"
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
