"""The motion of a grasper over time: where its pads are, how it is turned, how far it is open.

It is given by waypoints, or by a CSV file of what a hand did.
"""

from bisect import bisect_right
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import mujoco
import numpy as np

from scalpel_sim.strokes.csv_lines import StrokeError, numbered_lines, numbers_of
from scalpel_sim.strokes.stroke import FASTEST, Stroke
from scalpel_sim.strokes.timing import SAMPLE
from scalpel_sim.tables.values import WIDEST_OPENING
from scalpel_sim.vectors import cross_rows
from tissue import BladeSegment, FloatArray

GRASP_COLUMNS = (
    "t",
    *("x", "y", "z"),
    *("approach_x", "approach_y", "approach_z"),
    *("across_x", "across_y", "across_z"),
    "opening",
    "engaged",
)
"""Columns of the motion of a grasper that was led by hand: those of a row of `motion`, and whether
the hand led it."""

_LEAST_SINE = 1e-3
"""Sine of the angle between shaft and jaws below which they are along one line, by rounding."""


class Waypoint(NamedTuple):
    """Where a grasper rests at an instant, tissue frame."""

    time: float
    """When it is there [s]."""
    at: Sequence[float]
    """Where the middle between the pads is [m]."""
    approach: Sequence[float]
    """Direction in which shaft and pads point."""
    across: Sequence[float]
    """Direction in which the jaws open, which is made orthogonal to it."""
    opening: float
    """Distance between the pads [m]."""


class GraspMotion:
    """The motion of a grasper from waypoint to waypoint, at rest at each.

    In between position, turn and opening follow the polynomial of least jerk (Flash and Hogan 1985,
    J. Neuroscience 5:1688), as the hands of people do. Where a person leads it, or has led it, each
    frame of a motion has a waypoint, and in between it is even.

    Args:
        waypoints: At least one, in the order of time. Before the first it is there.
        name: For messages.
        is_led: Whether a person leads it, or has led it.

    Raises:
        StrokeError: times do not increase, a direction is zero or along another, or a part of the
            grasper would be too fast.
    """

    def __init__(
        self, waypoints: Sequence[Waypoint], name: str = "grasper", *, is_led: bool = False
    ) -> None:
        if not waypoints:
            raise StrokeError(f"the motion of '{name}' has no waypoint")
        first, last = waypoints[0], waypoints[-1]
        if first.time > 0.0:
            waypoints = [first._replace(time=0.0), *waypoints]
        if last.time == 0.0:
            waypoints = [*waypoints, last._replace(time=SAMPLE)]
        for i, (before, after) in enumerate(pairwise(waypoints)):
            if after.time <= before.time:
                raise StrokeError(
                    f"the motion of '{name}': time {after.time:g} s follows {before.time:g} s in "
                    f"waypoint {i + 2}; times must increase"
                )
        self.name = name
        self.is_led = is_led
        """Whether a person leads it, or has led it: its arm then stands where it reaches around the
        body, wherever that motion goes."""
        self.start = waypoints[0]
        """Where it is at first."""
        openings = [waypoint.opening for waypoint in waypoints]
        self.pads = min(openings), max(openings)
        """Smallest and largest distance of the pads in it [m]; of one that rests until it is led,
        those of its script."""
        self.waypoints = tuple(waypoints)
        """Where it is when; see `Waypoint`."""
        self._times = [waypoint.time for waypoint in waypoints]
        self._poses = [_pose(waypoint, name) for waypoint in waypoints]

    @property
    def duration(self) -> float:
        """When it is at the last waypoint [s]."""
        return self._times[-1]

    def opening(self, t: float) -> float:
        """Return the distance between the pads at time `t` [s], in m."""
        i = bisect_right(self._times, t)
        if i == 0 or i == len(self._times):
            return self.waypoints[min(i, len(self._times) - 1)].opening
        before, after = self.waypoints[i - 1], self.waypoints[i]
        share = (t - before.time) / (after.time - before.time)
        share = share if self.is_led else least_jerk(share)
        return before.opening + share * (after.opening - before.opening)

    def stroke(self, behind: float, ahead: float) -> Stroke:
        """Return the motion as that of an edge along the shaft, which a hand can follow.

        Args:
            behind: From the middle between the pads to its heel [m].
            ahead: From there to its tip [m].

        Raises:
            StrokeError: an end of the edge would be too fast.
        """
        name = f"motion of '{self.name}'"
        if self.is_led:  # what was recorded keeps its bits
            edges = [_edge(pose, behind, ahead) for pose in self._poses]
            return Stroke(self._times, edges, name, is_led=True)
        times, poses = [self._times[0]], [_edge(self._poses[0], behind, ahead)]
        for (begin, end), legs in zip(pairwise(self._times), pairwise(self._poses), strict=True):
            is_still = all(np.array_equal(a, b) for a, b in zip(*legs, strict=True))
            n = 1 if is_still else max(2, round((end - begin) / SAMPLE))
            for k in range(1, n + 1):
                times.append(begin + (end - begin) * k / n)
                poses.append(_edge(_between(*legs, least_jerk(k / n)), behind, ahead))
        return Stroke(times, poses, name)

    def at_rest(self) -> "GraspMotion":
        """Return the motion of a grasper that rests at the start of this one, until it is led."""
        rest = GraspMotion([self.start], self.name, is_led=True)
        rest.pads = self.pads
        return rest


def edge_of_grasper(waypoint: Waypoint, behind: float, ahead: float, name: str) -> BladeSegment:
    """Return the edge along the shaft at a waypoint: see `GraspMotion.stroke`.

    Raises:
        StrokeError: its directions are along one line, or one is zero.
    """
    return _edge(_pose(waypoint, name), behind, ahead)


def least_jerk(s: float) -> float:
    """Return the share of a way that is done after a share of its time, from rest to rest."""
    return s * s * s * (10.0 + s * (-15.0 + 6.0 * s))


class _Pose(NamedTuple):
    at: FloatArray
    turn: FloatArray
    """Quaternion of axes across, along the shaft, and across both, tissue frame."""


def _pose(waypoint: Waypoint, name: str) -> _Pose:
    """Return a waypoint as position and rotation."""
    y, x = np.array(waypoint.approach, float), np.array(waypoint.across, float)
    sizes = np.linalg.norm(y), np.linalg.norm(x)
    z = cross_rows(x, y)
    if not np.linalg.norm(z) > _LEAST_SINE * sizes[0] * sizes[1]:
        raise StrokeError(
            f"the motion of '{name}' at {waypoint.time:g} s: approach {list(waypoint.approach)} "
            f"and across {list(waypoint.across)} must be two directions, not along one line"
        )
    y, z = y / sizes[0], z / np.linalg.norm(z)
    turn = np.empty(4)
    mujoco.mju_mat2Quat(turn, np.stack([cross_rows(y, z), y, z], axis=1).ravel())
    return _Pose(np.array(waypoint.at, float), turn)


def _between(before: _Pose, after: _Pose, share: float) -> _Pose:
    """Return the pose at a share of the way, turned about one axis."""
    turn, way = before.turn.copy(), np.empty(3)
    mujoco.mju_subQuat(way, after.turn, before.turn)
    mujoco.mju_quatIntegrate(turn, way, share)
    return _Pose(before.at + share * (after.at - before.at), turn)


def _edge(pose: _Pose, behind: float, ahead: float) -> BladeSegment:
    """Return the edge along the shaft at a pose."""
    axes = np.empty(9)
    mujoco.mju_quat2Mat(axes, pose.turn)
    _, y, z = axes.reshape(3, 3).T
    return BladeSegment(pose.at + ahead * y, pose.at - behind * y, -z)


def grasp_from_csv(path: str | Path, name: str) -> GraspMotion:
    """Read the motion of a grasper: a pose and an opening per line, in metres and seconds.

    Args:
        path: The file; its first line names the columns `GRASP_COLUMNS`, in any order.
        name: Name of the grasper.

    Raises:
        StrokeError: no such file, or one that is no such table; the message names file and line.
    """
    path = Path(path)
    (first, header), *lines = numbered_lines(path, f"motion of grasper '{name}'", GRASP_COLUMNS)
    names = [cell.lower() for cell in header]
    if sorted(names) != sorted(GRASP_COLUMNS):
        raise StrokeError(
            f"{path}, line {first}: the columns are '{','.join(header)[:200]}'; wanted "
            f"{','.join(GRASP_COLUMNS)}"
        )
    columns = [names.index(column) for column in GRASP_COLUMNS]
    if not lines:
        raise StrokeError(f"{path} has no row; a motion needs at least one")
    found = []
    for number, cells in lines:
        row = numbers_of(path, number, cells, columns)
        waypoint = Waypoint(row[0], row[1:4], row[4:7], row[7:10], row[10])
        problem = _problem(waypoint, name)
        if problem is not None:
            raise StrokeError(f"{path}, line {number}: {problem}")
        found.append(waypoint)
    for (number, _), (before, after) in zip(lines[1:], pairwise(found), strict=True):
        problem = _problem_between(before, after)
        if problem is not None:
            raise StrokeError(f"{path}, line {number}: {problem}")
    return GraspMotion(found, name, is_led=True)


def _problem(waypoint: Waypoint, name: str) -> str | None:
    """Return why no grasper can be like that; None where it can."""
    if waypoint.time < 0.0:
        return f"time is {waypoint.time:g} s; it must not be negative"
    if not 0.0 <= waypoint.opening <= WIDEST_OPENING:
        return f"opening is {waypoint.opening:g} m; it must lie between 0 and {WIDEST_OPENING} m"
    try:
        _pose(waypoint, name)
    except StrokeError as error:
        return str(error)
    return None


def _problem_between(before: Waypoint, after: Waypoint) -> str | None:
    """Return why no grasper can go from one row to the next; None where it can."""
    passed = after.time - before.time
    if passed <= 0.0:
        return f"time {after.time:g} s follows {before.time:g} s; times must increase"
    way = np.subtract(after.at, before.at)
    speed = float(np.linalg.norm(way)) / passed
    if speed > FASTEST:
        return (
            f"the grasper arrives here at {speed:.3g} m/s, and {FASTEST:g} m/s is the limit; are "
            "the times in seconds and the positions in metres?"
        )
    return None
