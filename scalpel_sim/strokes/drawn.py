"""Strokes whose tip goes along points that are given."""

import math
from itertools import pairwise

import numpy as np

from scalpel_sim.strokes.csv_lines import StrokeError
from scalpel_sim.strokes.kind import UNTIL_THROUGH, StrokeTable
from scalpel_sim.strokes.stroke import Stroke
from scalpel_sim.strokes.timing import SAMPLE, SPEED_UP_TIME, timed
from tissue import BladeSegment, FloatArray

KEYS_OF_PATH = (
    ("points", "length"),
    ("edge", "forward", "slicing_ratio", "saw_amplitude", "saw_frequency", "speed", *UNTIL_THROUGH),
)
"""Keys that a stroke along points needs, and that it may have."""

_UP = (0.0, 0.0, 1.0)

_TURN_RATE = 2.0 * math.pi
"""Rate at which the blade turns about its tip at a corner of a path [rad/s]: half a second for a
right angle and a ramp would be slow, a tenth would throw the tissue about."""

_PER_SAW = 40
"""Poses in a period of a saw: a line between two of them is within 0.4 % of the amplitude."""

SAME_POINT = 1e-9
"""Distance [m] below which two points of a path in turn are one, and give no direction."""


def missing_points(row: StrokeTable) -> str | None:
    """Return that a path has too few points; None where it has enough."""
    return None if len(row.points or ()) >= 2 else "has one point; it needs two or more"


def led_along(
    row: StrokeTable, points: FloatArray, *, rests: bool = True, asks: bool = True
) -> Stroke:
    """Return the stroke of a blade whose tip goes along points.

    Args:
        row: Gives length, edge, direction, speed, and motion along the edge.
        points: Corners of the path of the tip [m], shape (n, 3).
        rests: Whether the blade rests at each corner, and turns there; else it passes.
        asks: Whether the whole path is to be cut; else that is not known.

    Raises:
        StrokeError: no blade can follow it; the message says why.
    """
    assert row.length is not None
    edge = edge_direction(row)
    forwards = _forwards(points, edge, row.forward)
    times, tips, directions = _led(points, forwards, row.tip_speed, rests=rests)
    times, tips, directions = _along_edge(row, edge, times, tips, directions)
    poses = [
        BladeSegment(tip, tip + row.length * edge, forward)
        for tip, forward in zip(tips, directions, strict=True)
    ]
    asked = [(0.0, float(times[-1]))] if asks else None
    return Stroke(times, poses, row.kind, asked=asked)


def edge_direction(row: StrokeTable) -> FloatArray:
    """Return the direction from tip to heel, a unit vector of shape (3,).

    Raises:
        StrokeError: its length is 0.
    """
    edge = np.array(row.edge or _UP)
    if not edge.any():
        raise StrokeError("the edge of the stroke is [0, 0, 0]; it is the direction tip to heel")
    return np.asarray(edge / np.linalg.norm(edge))


def _forwards(
    points: FloatArray, edge: FloatArray, given: tuple[float, float, float] | None
) -> FloatArray:
    """Return the direction in which the edge cuts on each leg of a path, shape (n - 1, 3)."""
    if given is not None:
        return np.tile(np.array(given), (len(points) - 1, 1))
    moves = np.diff(points, axis=0)
    across = moves - np.outer(moves @ edge, edge)
    lengths = np.linalg.norm(across, axis=1)
    still = lengths <= SAME_POINT
    if still.any():
        leg = int(np.argmax(still))
        raise StrokeError(
            f"from point {leg + 1} to point {leg + 2} the blade does not move across its edge; "
            "give the direction in which it cuts as forward, or another edge"
        )
    return np.asarray(across / lengths[:, None])


def _led(
    points: FloatArray, forwards: FloatArray, speed: float, *, rests: bool
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return times [s], positions of the tip [m] and directions of the cut along a path.

    Args:
        points: Corners of the path [m], shape (n, 3).
        forwards: Direction of the cut on each leg, shape (n - 1, 3).
        speed: Speed between the ramps [m/s].
        rests: Whether the blade rests at each corner, and turns there; else it passes.
    """
    if not rests:
        along = np.append(0.0, np.linalg.norm(np.diff(points, axis=0), axis=1).cumsum())
        times, done = timed(float(along[-1]), speed)
        at_points = np.vstack([forwards[:1], 0.5 * (forwards[:-1] + forwards[1:]), forwards[-1:]])
        return times, _interpolated(done, along, points), _interpolated(done, along, at_points)
    legs = [(np.zeros(1), points[:1], forwards[:1])]
    for (start, end), forward in zip(pairwise(points), forwards, strict=True):
        now, tip, before = (part[-1:] for part in legs[-1])
        turn = seconds_to_turn(before[0], forward)
        if turn > 0.0:
            now = now + turn
            legs.append((now, tip, forward[None]))
        when, done = timed(float(np.linalg.norm(end - start)), speed)
        tips = start + done[1:, None] / done[-1] * (end - start)
        legs.append((now + when[1:], tips, np.tile(forward, (len(tips), 1))))
    times, tips, directions = (np.concatenate(parts) for parts in zip(*legs, strict=True))
    return times, tips, directions


def _along_edge(
    row: StrokeTable, edge: FloatArray, times: FloatArray, tips: FloatArray, forwards: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Add the motion along the edge of a slice or a saw."""
    if row.slicing_ratio is not None:
        steps = np.diff(tips, axis=0)
        along = np.append(
            0.0, np.linalg.norm(steps - np.outer(steps @ edge, edge), axis=1).cumsum()
        )
        # In the middle of its way the tip is where the points say.
        tips = tips + np.outer(row.slicing_ratio * (along - 0.5 * along[-1]), edge)
    if row.saw_amplitude is not None and row.saw_frequency is not None:
        n = math.ceil((times[-1] - times[0]) * max(1.0 / SAMPLE, _PER_SAW * row.saw_frequency))
        fine = np.union1d(times, np.linspace(times[0], times[-1], n + 1))
        fine = fine[np.append(True, np.diff(fine) > 1e-9)]
        tips, forwards = _interpolated(fine, times, tips), _interpolated(fine, times, forwards)
        to_ends = np.minimum(fine - fine[0], fine[-1] - fine)
        grown = np.minimum(to_ends / SPEED_UP_TIME, 1.0)
        saw = row.saw_amplitude * grown * np.sin(2.0 * np.pi * row.saw_frequency * fine)
        tips, times = tips + np.outer(saw, edge), fine
    return times, tips, forwards


def _interpolated(at: FloatArray, known: FloatArray, rows: FloatArray) -> FloatArray:
    """Return rows at places between those where they are known, shape (n, 3)."""
    return np.stack([np.interp(at, known, rows[:, k]) for k in range(3)], axis=1)


def seconds_to_turn(a: FloatArray, b: FloatArray) -> float:
    """Return the time in which a blade turns about its edge from one direction to another [s]."""
    angle = float(np.arctan2(np.linalg.norm(np.cross(a, b)), a @ b))
    return max(angle / _TURN_RATE, SAMPLE) if angle > 0.0 else 0.0
