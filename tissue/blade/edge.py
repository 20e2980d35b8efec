"""The cutting edge over a time step, and the pose of the blade at one instant of it.

An instant is a fraction of the time step: 0 at its start, 1 at its end. A kernel that Python calls
takes the `Edge` and an instant, computes the pose once, and passes it to the kernels that it calls.
"""

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from tissue.core.array_types import FloatArray
from tissue.core.jit import kernel
from tissue.core.structs import Vectors
from tissue.core.three_vectors import BladeSweep
from tissue.core.vec3 import Vec3, axpy, cross, dot, lerp, norm, scale, sub


class Edge(Vectors):
    """The cutting edge over one time step."""

    tip_t0: Vec3
    """Tip at the start of the step [m]."""
    heel_t0: Vec3
    """Heel at the start of the step [m]."""
    forward_t0: Vec3
    """Direction in which the edge cuts at the start of the step, of any length."""
    tip_t1: Vec3
    """Tip at the end of the step [m]."""
    heel_t1: Vec3
    """Heel at the end of the step [m]."""
    forward_t1: Vec3
    """Direction in which the edge cuts at the end of the step, of any length."""

    @property
    def length(self) -> float:
        """Length of the edge at the end of the step [m]."""
        numbers = self._numbers
        return math.dist(numbers[9:12], numbers[12:15])

    @property
    def travel(self) -> float:
        """Distance that the edge moves [m]: the larger one of its two ends."""
        numbers = self._numbers
        tip = math.dist(numbers[9:12], numbers[0:3])
        return max(tip, math.dist(numbers[12:15], numbers[3:6]))


NOWHERE = Edge(*(Vec3(*row) for row in ([0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]) * 2))
"""The edge of no blade."""


class BladePose(NamedTuple):
    """Position and axes of the blade at one instant."""

    tip: Vec3
    """Position of the tip [m]."""
    heel: Vec3
    """Position of the heel [m]."""
    along: Vec3
    """Unit vector along the edge, from tip to heel."""
    forward: Vec3
    """Unit vector in which the edge cuts, at right angles to the edge."""
    normal: Vec3
    """Unit normal of the blade's plane."""
    length: float
    """Length of the edge [m]."""


class BladeMotion(NamedTuple):
    """Pose of the blade at one instant, and how far the blade moves in the whole time step."""

    pose: BladePose
    """Pose at the instant."""
    tip: Vec3
    """Displacement of the tip in the time step [m]."""
    along: Vec3
    """Change of `BladePose.along` in the time step."""
    forward: Vec3
    """Change of `BladePose.forward` in the time step."""
    normal: Vec3
    """Change of `BladePose.normal` in the time step."""


class BladeCoordinates(NamedTuple):
    """A point in the axes of the blade."""

    along: float
    """Distance from the tip along the edge, positive towards the heel [m]."""
    behind: float
    """Distance behind the edge [m]."""
    across: float
    """Distance from the blade's plane, positive along its normal [m]."""


_SAME_LENGTH = 1e-3
"""Relative change in length below which an edge counts as the same. Poses in single precision, or
between two places of a turning blade, differ by less; another edge would begin another incision."""

LEAST_SINE = 1e-6
"""Sine of the angle between edge and `forward` below which the blade would cut along its edge."""


@kernel
def is_other_length(length: float, current: float) -> bool:
    """Return whether an edge of that length [m] differs from the current one; 0 is no edge."""
    return abs(length - current) > _SAME_LENGTH * length


@kernel
def is_sound(edge: Edge) -> bool:
    """Return whether a blade can move so: it has a length, faces across it, and turns little.

    False too where a number is not finite, or so large or small that its square is not.
    """
    along_t0, along_t1 = sub(edge.heel_t0, edge.tip_t0), sub(edge.heel_t1, edge.tip_t1)
    return (
        _has_plane(along_t0, edge.forward_t0)
        and _has_plane(along_t1, edge.forward_t1)
        and dot(along_t0, along_t1) > 0.0
        and dot(edge.forward_t0, edge.forward_t1) > 0.0
    )


@kernel
def _has_plane(along: Vec3, forward: Vec3) -> bool:
    across = norm(cross(along, forward))
    return math.isfinite(across) and across > LEAST_SINE * norm(along) * norm(forward)


@kernel
def pose_at(edge: Edge, when: float) -> BladePose:
    """Return the pose of the blade at an instant."""
    tip = lerp(when, edge.tip_t0, edge.tip_t1)
    heel = lerp(when, edge.heel_t0, edge.heel_t1)
    from_tip = sub(heel, tip)
    along = scale(1.0 / norm(from_tip), from_tip)
    forward = lerp(when, edge.forward_t0, edge.forward_t1)
    forward = axpy(-dot(forward, along), along, forward)
    forward = scale(1.0 / norm(forward), forward)
    return BladePose(tip, heel, along, forward, cross(forward, along), dot(from_tip, along))


@kernel
def motion_at(edge: Edge, when: float) -> BladeMotion:
    """Return the pose of the blade at an instant, and its motion in the whole time step."""
    t0, t1 = pose_at(edge, 0.0), pose_at(edge, 1.0)
    return BladeMotion(
        pose_at(edge, when),
        sub(edge.tip_t1, edge.tip_t0),
        sub(t1.along, t0.along),
        sub(t1.forward, t0.forward),
        sub(t1.normal, t0.normal),
    )


@kernel
def displacement_of(motion: BladeMotion, p: Vec3) -> Vec3:
    """Return how far the point of the blade that is at `p` [m] moves in the time step [m]."""
    pose = motion.pose
    r = sub(p, pose.tip)
    moved = axpy(dot(r, pose.along), motion.along, motion.tip)
    moved = axpy(dot(r, pose.forward), motion.forward, moved)
    return axpy(dot(r, pose.normal), motion.normal, moved)


@kernel
def sample_point(pose: BladePose, k: int, n: int) -> Vec3:
    """Return the position of sample `k` of `n` along the edge [m]."""
    return lerp(k / (n - 1.0), pose.tip, pose.heel)


@kernel
def sample_displacement(edge: Edge, k: int, n: int) -> Vec3:
    """Return how far sample `k` of `n` along the edge moves in the time step [m]."""
    # The ends are interpolated as at any other instant: they may differ by rounding from t0, t1.
    tip_t0, heel_t0 = lerp(0.0, edge.tip_t0, edge.tip_t1), lerp(0.0, edge.heel_t0, edge.heel_t1)
    tip_t1, heel_t1 = lerp(1.0, edge.tip_t0, edge.tip_t1), lerp(1.0, edge.heel_t0, edge.heel_t1)
    share = k / (n - 1.0)
    return sub(lerp(share, tip_t1, heel_t1), lerp(share, tip_t0, heel_t0))


@kernel
def blade_coordinates(pose: BladePose, p: Vec3) -> BladeCoordinates:
    """Return point `p` [m] in the axes of the blade."""
    r = sub(p, pose.tip)
    return BladeCoordinates(dot(r, pose.along), -dot(r, pose.forward), dot(r, pose.normal))


def edge_of(sweep: BladeSweep) -> Edge:
    """Return the cutting edge over a step; `begin_blade_step` checks what it is.

    Raises:
        ValueError: tip, heel or forward are not three numbers each.
    """
    try:
        return Edge.of_numbers(sweep.t0.numbers + sweep.t1.numbers)
    except (AttributeError, TypeError, ValueError):
        return edge_or_error(sweep)


def edge_or_error(sweep: BladeSweep) -> Edge:
    """Return the cutting edge over a step, where a blade can move so.

    Raises:
        ValueError: a number is not finite, the blade has no length, it would cut along itself, or
            it turns by more than a right angle.
    """
    points, directions = [], []
    for when, segment in (("start", sweep.t0), ("end", sweep.t1)):
        tip, heel, forward = map(_three_numbers, segment)
        if tip is None or heel is None or forward is None:
            rows = [np.asarray(part, dtype=np.float64).tolist() for part in segment]
            raise ValueError(
                f"the blade at the {when} of the step is {rows}; tip, heel and forward are three "
                "finite numbers each"
            )
        x, y, z = heel.x - tip.x, heel.y - tip.y, heel.z - tip.z
        u, v, w = forward
        length = math.hypot(x, y, z)
        if not length > 0.0:
            raise ValueError(
                f"the blade at the {when} of the step has no length: {[[*tip], [*heel]]}"
            )
        across = math.hypot(y * w - z * v, z * u - x * w, x * v - y * u)
        if not across > LEAST_SINE * length * math.hypot(u, v, w):
            raise ValueError(
                f"the blade at the {when} of the step cuts along its own edge: forward is "
                f"{[*forward]}, from tip to heel is {[x, y, z]}"
            )
        points += [tip, heel, forward]
        directions.append((x, y, z))
    edge = Edge(*points)
    (x, y, z), (u, v, w) = directions
    (a, b, c), (f, g, h) = edge.forward_t0, edge.forward_t1
    if not (x * u + y * v + z * w > 0.0 and a * f + b * g + c * h > 0.0):
        expect_small_turn(np.array(directions), np.array([edge.forward_t0, edge.forward_t1]))
    return edge


def _three_numbers(part: npt.ArrayLike) -> Vec3 | None:
    """Return three finite numbers as plain floats; None where they are not that."""
    array = np.asarray(part, dtype=np.float64)
    if array.shape != (3,):
        return None
    x, y, z = array.tolist()
    # A sum is finite only where all are, and is faster to test.
    is_finite = math.isfinite(x + y + z) or all(map(math.isfinite, (x, y, z)))
    return Vec3(x, y, z) if is_finite else None


def expect_small_turn(along: FloatArray, forward: FloatArray) -> None:
    """Check that the blade turns by less than a right angle from each place to the next.

    Between two places it is interpolated; halfway round it would have no direction.

    Args:
        along: From tip to heel, shape (n_places, 3).
        forward: Where it faces, shape (n_places, 3).

    Raises:
        ValueError: it turns further.
    """
    for what, direction in (("edge", along), ("forward", forward)):
        wrong = np.flatnonzero(~((direction[1:] * direction[:-1]).sum(axis=1) > 0.0))
        if len(wrong):
            i = int(wrong[0])
            raise ValueError(
                f"the blade's {what} turns by a right angle or more in one step, from "
                f"{direction[i].tolist()} to {direction[i + 1].tolist()}; turn it in smaller steps"
            )
