"""Several strokes in turn, with pauses, and the way of the blade through the air between them."""

import itertools
from collections.abc import Sequence

import numpy as np

from scalpel_sim.strokes.csv_lines import StrokeError
from scalpel_sim.strokes.stroke import Stroke
from scalpel_sim.strokes.timing import SAMPLE, timed
from tissue import BladeSegment, FloatArray, TetrahedralMesh

_SPEED = 0.1
"""Speed of the middle of the blade through the air [m/s]."""

_CLEARANCE = 5e-3
"""Distance from the body that the blade keeps on its way [m]: tissue that was cut may stand out."""

_ROUNDING = 1e-6
"""Share by which a blade may be shorter than a stroke needs: rounding of a file's digits."""

Poses = list[tuple[float, BladeSegment]]
"""Instants [s] and poses."""


def in_turn(
    strokes: Sequence[Stroke], rests: Sequence[tuple[float, float]], mesh: TetrahedralMesh
) -> Stroke:
    """Return one stroke that does several, and rests before and after each.

    From stroke to stroke the blade is drawn out along its edge if it is in the body, raised above
    it, led over, and lowered. It is as long as the longest of the strokes needs; its tip is where
    each says.

    Args:
        strokes: At least one.
        rests: How long the blade rests before and after each [s].
        mesh: The body as it lies before the first, tissue frame [m].

    Raises:
        StrokeError: a blade would be too fast.
    """
    if len(strokes) == 1 and not any(rests[0]):
        return strokes[0]
    length = max(stroke.blade_length for stroke in strokes)
    box = mesh.positions.min(axis=0) - _CLEARANCE, mesh.positions.max(axis=0) + _CLEARANCE
    poses: Poses = []
    asked, guards = [], []
    for stroke, (wait, pause) in zip(strokes, rests, strict=True):
        own = [(t, _lengthened(stroke.pose(t), length)) for t in stroke.times.tolist()]
        start = 0.0
        if poses:
            start, last = poses[-1]
            way = _way(last, own[0][1], box)
            poses += [(start + t, pose) for t, pose in way[1:]]
            start = poses[-1][0]
            if wait == 0.0:
                own = own[1:]
        begin = start
        if wait > 0.0:
            poses += [] if poses else [(0.0, own[0][1])]
            start += wait
        poses += [(start + t, pose) for t, pose in own]
        guards += [each.moved_by(start, pause)._replace(begin=begin) for each in stroke.guards]
        asked += [(start + a, start + b) for a, b in stroke.asked or ()]
        if pause > 0.0:
            poses.append((poses[-1][0] + pause, poses[-1][1]))
    times, segments = zip(*poses, strict=True)
    name = ", ".join(stroke.name for stroke in strokes)
    return Stroke(np.array(times), segments, name, asked=asked or None, guards=guards)


def lengthened(stroke: Stroke, length: float) -> Stroke:
    """Return the stroke of a longer blade, whose tip is at the same places.

    Args:
        stroke: The stroke.
        length: Length of the blade [m].

    Raises:
        StrokeError: the blade is shorter than the stroke needs.
    """
    if length < stroke.blade_length * (1.0 - _ROUNDING):
        raise StrokeError(
            f"the blade is {1e3 * length:.3g} mm long, and the stroke '{stroke.name}' needs "
            f"{1e3 * stroke.blade_length:.3g} mm; give the arm a longer blade, or choose a "
            "shallower stroke"
        )
    times = stroke.times.tolist()
    poses = [_lengthened(stroke.pose(t), length) for t in times]
    return Stroke(times, poses, stroke.name, asked=stroke.asked, guards=stroke.guards)


def through_air(start: BladeSegment, end: BladeSegment, bounds: FloatArray) -> Stroke:
    """Return the way of a blade from a pose to another one, out of a body and above it.

    Args:
        start: Where it is.
        end: Where it goes.
        bounds: Lowest and highest corner of the body [m], shape (2, 3).
    """
    way = _way(start, end, (bounds[0] - _CLEARANCE, bounds[1] + _CLEARANCE))
    if len(way) == 1:  # it is there
        way = [*way, (SAMPLE, end)]
    times, poses = zip(*way, strict=True)
    return Stroke(times, poses)


def _lengthened(pose: BladeSegment, length: float) -> BladeSegment:
    """Return the pose of a blade of another length, whose tip is at the same place."""
    edge = pose.heel - pose.tip
    return pose._replace(heel=pose.tip + length / np.linalg.norm(edge) * edge)


def _way(start: BladeSegment, end: BladeSegment, box: tuple[FloatArray, FloatArray]) -> Poses:
    """Return instants from 0 and poses on the way through the air, at rest at each corner."""
    out, above = _withdrawn(start, box)
    back, over = _withdrawn(end, box)
    corners = [start, out, above, over, back, end]
    poses: Poses = [(0.0, start)]
    for a, b in itertools.pairwise(corners):
        distance = max(float(np.linalg.norm(b.tip - a.tip)), float(np.linalg.norm(b.heel - a.heel)))
        if distance == 0.0:
            continue
        times, done = timed(distance, _SPEED)
        leg = Stroke([0.0, distance / _SPEED], [a, b])
        begun = poses[-1][0]
        poses += [
            (begun + float(t), leg.pose(s / _SPEED))
            for t, s in zip(times[1:], done[1:], strict=True)
        ]
    return poses


def _withdrawn(
    pose: BladeSegment, box: tuple[FloatArray, FloatArray]
) -> tuple[BladeSegment, BladeSegment]:
    """Return a pose drawn out of a box along its edge, where it is in it, and one raised above."""
    low, high = box
    edge = pose.heel - pose.tip
    edge = edge / np.linalg.norm(edge)
    out = pose
    if _meets(pose, low, high):
        with np.errstate(divide="ignore", invalid="ignore"):
            ways = np.where(edge > 0.0, (high - pose.tip) / edge, (low - pose.tip) / edge)
        out = _moved(pose, max(float(np.nanmin(np.where(edge == 0.0, np.inf, ways))), 0.0) * edge)
    lowest = min(out.tip[2], out.heel[2])
    return out, _moved(out, np.array([0.0, 0.0, max(float(high[2] - lowest), 0.0)]))


def _moved(pose: BladeSegment, by: FloatArray) -> BladeSegment:
    """Return a pose that is moved [m]."""
    return pose._replace(tip=pose.tip + by, heel=pose.heel + by)


def _meets(pose: BladeSegment, low: FloatArray, high: FloatArray) -> bool:
    """Whether an edge meets a box: the slabs of Kay and Kajiya."""
    direction = pose.heel - pose.tip
    with np.errstate(divide="ignore", invalid="ignore"):
        ends = np.stack([(low - pose.tip) / direction, (high - pose.tip) / direction])
    is_along = direction == 0.0
    if ((pose.tip < low) | (pose.tip > high))[is_along].any():
        return False
    near = ends.min(axis=0)[~is_along].max()
    far = ends.max(axis=0)[~is_along].min()
    return bool(max(near, 0.0) <= min(far, 1.0))
