"""A cut along a line on the skin: the tip follows it at one depth, and the edge turns with it.

The path is that in a body that does not give way; its course is the line, which the blade follows
as that lies: see `instruments.line_pursuit`.

heel |          | |          the edge stands along the depth, and what it sweeps is the line
     |    __----+-+----      on the skin, drawn out to the depth
-----+----      | |    ----- skin
 tip |    __----+-+----
     +----                   depth
"""

from typing import NamedTuple

import numpy as np

from scalpel_sim.strokes.drawn import edge_direction, missing_points, seconds_to_turn
from scalpel_sim.strokes.kind import LyingBody, StrokeTable, stroke_kind
from scalpel_sim.strokes.kinds.incision import usual_depth
from scalpel_sim.strokes.skin import BodySkin
from scalpel_sim.strokes.skin_course import SkinCourse
from scalpel_sim.strokes.skin_line import SkinLine, lines_on_skin
from scalpel_sim.strokes.stroke import Stroke
from scalpel_sim.strokes.timing import timed
from tissue import BladeSegment, FloatArray

_TURN_OVER = 1.5e-3
"""Half the length of line over which the edge turns where it passes a bend [m]."""

_GAP = 4e-3
"""Height above the skin at which the tip starts, and ends [m]: as that of an incision."""

_BEYOND = 1e-3
"""Way that the tip goes on beyond the line [m]: tissue at the edge gives way by about so much
before it parts, so that the cut ends that far behind the edge."""

_BACK = 0.01
"""Way for which the blade has time at the end of the line, before it is drawn out [m]: it goes back
as far as it has dragged the tissue along there, some 6 mm in liver."""

_REACH, _LEAST_REACH = 3.0, 0.01
"""Length of the blade in depths, and at least above the skin [m]: tissue beside the edge rises."""


class _Leg(NamedTuple):
    """A part of the way that the tip goes without a stop."""

    tips: FloatArray
    """Where it goes [m], shape (n, 3)."""
    forwards: FloatArray
    """Direction of the cut there, shape (n, 3)."""

    @property
    def along(self) -> FloatArray:
        """Length of the way to each place [m], shape (n,)."""
        return np.append(0.0, np.linalg.norm(np.diff(self.tips, axis=0), axis=1).cumsum())

    @property
    def length(self) -> float:
        """Length of the whole way [m]."""
        return float(self.along[-1])


@stroke_kind(
    "a cut along a line on the skin: the tip goes in along the edge at the first point, follows "
    "the line, as it lies then, at one depth while the edge turns with it, goes back with the "
    "tissue that it has dragged along, and is drawn out",
    ("points",),
    ("depth", "edge", "length", "speed"),
    problem=missing_points,
)
def traced(row: StrokeTable, body: LyingBody) -> Stroke:
    """Return a cut along a line on the skin.

    The points are places at rest, as in the mesh: so they mean the same material however the body
    lies. They are moved onto the skin along the edge, and so is the straight line between them.

    Raises:
        StrokeError: a point or the line between two misses the skin, or the skin is too steep.
    """
    edge = edge_direction(row)
    depth = usual_depth(body.mesh) if row.depth is None else row.depth
    skin = BodySkin.of(body.mesh, body.rest)
    rise = (depth + _GAP) * edge
    lines = lines_on_skin(np.array(row.points), skin, edge)
    ways = [line.lying for line in lines]
    ways[-1] = _beyond(ways[-1])
    legs = [_leg(way - depth * edge) for way in ways]
    first, last = legs[0], legs[-1]
    into = _Leg(np.stack([first.tips[0] + rise, first.tips[0]]), first.forwards[[0, 0]])
    out = _Leg(np.stack([last.tips[-1], last.tips[-1] + rise]), last.forwards[[-1, -1]])
    path = _followed([into, *legs, out], row.tip_speed)
    length = max(_REACH * depth, depth + _LEAST_REACH) if row.length is None else row.length
    poses = [
        BladeSegment(tip, tip + length * edge, forward)
        for tip, forward in zip(path.tips, path.forwards, strict=True)
    ]
    asked = [(0.0, path.begun[-1])]
    course = _course(lines, ways, path.begun[1:-1], row.tip_speed)
    return Stroke(path.times, poses, row.kind, asked=asked, course=course)


def _course(
    lines: list[SkinLine], ways: list[FloatArray], begun: list[float], speed: float
) -> SkinCourse:
    """Return where the skin is above the tip, and when. Beyond the line that is its last place.

    Args:
        lines: The line on the skin, parted at its corners.
        ways: The same as the tip goes, shape (n, 3) each.
        begun: When the tip begins to go along each [s].
        speed: Speed between the ramps [m/s].
    """
    whens = []
    for way, begin in zip(ways, begun, strict=True):
        along = _Leg(way, way).along
        times, done = timed(float(along[-1]), speed)
        whens.append(begin + np.interp(along, done, times))
    last = lines[-1]
    return SkinCourse(
        np.concatenate(whens),
        np.vstack([*(line.at_rest for line in lines), last.at_rest[-1:]]),
        np.vstack([*(line.lying for line in lines), last.lying[-1:]]),
        speed,
    )


def _beyond(line: FloatArray) -> FloatArray:
    """Return a line that goes on straight by `_BEYOND`."""
    way = line[-1] - line[-2]
    return np.vstack([line, line[-1] + _BEYOND / np.linalg.norm(way) * way])


def _leg(line: FloatArray) -> _Leg:
    """Return the way of the tip along a line, with the direction of the cut at each place.

    Where the line bends, the edge turns over `_TURN_OVER` before and after.
    """
    along = np.append(0.0, np.linalg.norm(np.diff(line, axis=0), axis=1).cumsum())
    ends = (np.clip(along + shift, 0.0, along[-1]) for shift in (_TURN_OVER, -_TURN_OVER))
    ahead, behind = (
        np.stack([np.interp(at, along, line[:, k]) for k in range(3)], axis=1) for at in ends
    )
    forwards = ahead - behind
    return _Leg(line, forwards / np.linalg.norm(forwards, axis=1)[:, None])


class _Path(NamedTuple):
    """The way of the tip over time."""

    times: FloatArray
    """When it is where [s], shape (n,)."""
    tips: FloatArray
    """Where it is then [m], shape (n, 3)."""
    forwards: FloatArray
    """Direction of the cut then, shape (n, 3)."""
    begun: list[float]
    """When each leg begins [s]."""


def _followed(legs: list[_Leg], speed: float) -> _Path:
    """Return the way along legs. Between them the tip rests, and the blade turns.

    Before the last one it has time to go back.

    Args:
        legs: Each begins where the one before it ends.
        speed: Speed between the ramps [m/s].
    """
    times, tips, forwards = [np.zeros(1)], [legs[0].tips[:1]], [legs[0].forwards[:1]]
    begun = []
    for leg in legs:
        now, rest = times[-1][-1:], seconds_to_turn(forwards[-1][-1], leg.forwards[0])
        if leg is legs[-1]:
            rest += _BACK / speed
        if rest > 0.0:
            now = now + rest
            times, tips, forwards = (
                [*times, now],
                [*tips, leg.tips[:1]],
                [*forwards, leg.forwards[:1]],
            )
        begun.append(float(now[0]))
        along = leg.along
        when, done = timed(leg.length, speed)
        times.append(now + when[1:])
        for rows, known in ((tips, leg.tips), (forwards, leg.forwards)):
            rows.append(
                np.stack([np.interp(done[1:], along, known[:, k]) for k in range(3)], axis=1)
            )
    return _Path(np.concatenate(times), np.concatenate(tips), np.concatenate(forwards), begun)
