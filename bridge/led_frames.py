"""Frames that act on a tissue: bodies of an arm's model lead them, and feel what it does."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from tissue import FloatArray, Wrench


class FramePose(NamedTuple):
    """Where a frame is."""

    origin: FloatArray
    """Its origin [m], shape (3,)."""
    rotation: FloatArray
    """Its axes as columns, shape (3, 3); those of the tissue at first."""


class FrameLoad(NamedTuple):
    """What a tissue did to a frame in the last step."""

    wrench: Wrench
    """Mean wrench on it, about its origin at the end of the step."""
    n_points: int
    """Number of points of the tissue through which it acts now; 0 once it has let go."""


class FrameHold(NamedTuple):
    """How a frame holds tissue: what `tissue.Tissue.attach` takes."""

    where: str | list[int] | list[list[float]]
    """A region as text, numbers of nodes, or places in the body at rest [m]."""
    stiffness: float
    """Of all springs together [N/m]."""
    damping: float = 0.0
    """Of all dampers together [N s/m]."""
    breaks_at: float = math.inf
    """Force at which it lets go [N]."""
    origin: Sequence[float] | None = None
    """Origin of the frame [m]; None: the mean of the points."""


class FrameTie(NamedTuple):
    """How strands tie tissue to a frame: what `tissue.Tissue.tie` takes."""

    where: str | list[int] | list[list[float]]
    """What `FrameHold.where` takes: where the strands begin."""
    to: list[list[float]]
    """Where they end [m]: one place for all, or one for each."""
    stiffness: float
    """Of all strands together, along them [N/m]."""
    area: float
    """Cross-section of all strands together [m2]."""
    toughness: float
    """Energy of cutting them [J/m2]."""
    damping: float = 0.0
    """Of all of them together, along them [N s/m]."""
    rest_length: float | None = None
    """Length up to which each is slack [m]; None: the distance of its ends."""
    breaks_at: float = math.inf
    """Force of all of them at which they let go [N]."""


def plain_region(where: str | npt.ArrayLike) -> str | list[int] | list[list[float]]:
    """Return what `FrameHold.where` takes; a mask of nodes becomes their numbers."""
    if isinstance(where, str):
        return where
    array = np.asarray(where)
    if array.dtype == np.bool_:
        array = np.flatnonzero(array)
    if array.dtype.kind in "iu":
        return [int(node) for node in np.atleast_1d(array)]
    rows: list[list[float]] = np.atleast_2d(array.astype(np.float64)).tolist()
    return rows


def expect_each(poses: Sequence[FramePose], n: int) -> None:
    """Refuse poses of another number than that of the frames.

    Raises:
        ValueError: it is another one.
    """
    if len(poses) != n:
        raise ValueError(
            f"a step has poses of {len(poses)} frames, and {n} are led from here; give one for each"
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
