"""Strokes whose path a row or a file gives."""

from itertools import pairwise

import numpy as np

from scalpel_sim.strokes.csv_lines import StrokeError
from scalpel_sim.strokes.drawn import (
    KEYS_OF_PATH,
    SAME_POINT,
    edge_direction,
    led_along,
    missing_points,
)
from scalpel_sim.strokes.kind import LyingBody, StrokeTable, stroke_kind
from scalpel_sim.strokes.stroke import Stroke, from_csv
from scalpel_sim.strokes.timing import SAMPLE
from tissue import BladeSegment, FloatArray

_PER_LEG = 200
"""Points of a spline between two of those that it is given by."""


@stroke_kind(
    "the tip goes along straight lines from point to point, and rests at each corner while "
    "the blade turns",
    *KEYS_OF_PATH,
    problem=missing_points,
)
def points(row: StrokeTable, body: LyingBody) -> Stroke:
    """Return a stroke along straight lines through the points of its row."""
    corners = np.array(row.points)
    corners[-1] += _farther(row, corners)
    return led_along(row, corners)


@stroke_kind(
    "the tip goes along a smooth curve through the points, without a stop",
    *KEYS_OF_PATH,
    problem=missing_points,
)
def spline(row: StrokeTable, body: LyingBody) -> Stroke:
    """Return a stroke along a smooth curve through the points of its row, without a stop."""
    curve = _spline(np.array(row.points))
    if row.farther > 0.0:
        curve = np.vstack([curve, curve[-1] + _farther(row, curve)])
    return led_along(row, curve, rests=False)


def _farther(row: StrokeTable, points: FloatArray) -> FloatArray:
    """Return how far a path may go on beyond its last point [m], shape (3,)."""
    last = points[-1] - points[-2]
    length = float(np.linalg.norm(last))
    if length <= SAME_POINT:
        raise StrokeError("the last two points of the stroke are the same; leave one out")
    return np.asarray(row.farther / length * last)


def _spline(points: FloatArray) -> FloatArray:
    """Return points close together on a cubic spline through some, by chord length [m]."""
    from scipy.interpolate import CubicSpline  # 0.2 s, and only here

    chords = np.linalg.norm(np.diff(points, axis=0), axis=1)
    if (chords <= SAME_POINT).any():
        raise StrokeError("two points of the spline in turn are the same; leave one out")
    at = np.append(0.0, np.cumsum(chords))
    fine = np.unique(np.concatenate([np.linspace(a, b, _PER_LEG + 1) for a, b in pairwise(at)]))
    return np.asarray(CubicSpline(at, points)(fine))


def _no_single_point(row: StrokeTable) -> str | None:
    n_points = len(row.points or ())
    return None if n_points == 1 else f"has {n_points} points; it has one"


@stroke_kind(
    "the tip goes in along the edge, and out again",
    ("points", "length", "depth", "forward"),
    ("edge", "speed"),
    problem=_no_single_point,
)
def stab(row: StrokeTable, body: LyingBody) -> Stroke:
    """Return a stroke in along the edge at the point of its row, and out again."""
    assert row.points is not None and row.depth is not None
    point = np.array(row.points[0])
    inside = point - row.depth * edge_direction(row)
    return led_along(row, np.array([point, inside, point]), asks=False)


@stroke_kind(
    "the blade rests with its tip at a point, where it cuts nothing, while other hands work; "
    "`pause` says for how long",
    ("points", "length", "forward"),
    ("edge",),
    problem=_no_single_point,
    cuts=False,
    meets=False,
)
def rest(row: StrokeTable, body: LyingBody) -> Stroke:
    """Return a stroke that stays at the point of its row."""
    assert row.points is not None and row.length is not None and row.forward is not None
    tip = np.array(row.points[0])
    pose = BladeSegment(tip, tip + row.length * edge_direction(row), np.array(row.forward))
    return Stroke([0.0, SAMPLE], [pose, pose], row.kind)


@stroke_kind("poses over time, from a CSV file ([command line](command_line.md))", ("file",))
def recorded(row: StrokeTable, body: LyingBody) -> Stroke:
    """Return the stroke in the file of its row."""
    assert row.file is not None
    return from_csv(row.file)
