"""A stroke: the path of a blade over time, in the tissue frame."""

from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

import mujoco
import numpy as np

from scalpel_sim.strokes.csv_lines import StrokeError, numbered_lines, numbers_of
from scalpel_sim.strokes.guard import Guard
from scalpel_sim.strokes.skin_course import SkinCourse
from scalpel_sim.vectors import cross_rows
from tissue import BladeSegment, FloatArray

_SAME_LENGTH = 0.01
"""Fraction by which the blade's length may vary along a stroke: what rounding in a file leaves."""

FASTEST = 2.0
"""Highest speed of a blade [m/s]. No hand cuts faster; times in milliseconds or positions in
millimetres do."""

_COLUMNS = ("t", "tip_x", "tip_y", "tip_z", "heel_x", "heel_y", "heel_z")
FORWARD_COLUMNS = ("forward_x", "forward_y", "forward_z")
_ENGAGED_COLUMN = "engaged"

LED_COLUMNS = (*_COLUMNS, *FORWARD_COLUMNS, _ENGAGED_COLUMN)
"""Columns of a stroke that was led by hand."""


class Stroke:
    """The path of a blade over time, in the tissue frame.

    Between two poses the middle of the edge moves on a straight line and the blade turns about one
    axis, both evenly: the path is continuous, and as smooth as the poses are dense.

    Args:
        times: When the blade is where [s], shape (n,), increasing. Only differences matter: the
            stroke starts at the first.
        segments: The n poses, n >= 2. `forward` is made orthogonal to the edge.
        name: For messages and reports.
        asked: Intervals in which the edge passes what it is to cut [s]; None where it is not known.
        guards: What may end each of the strokes in turn otherwise; none where nothing may.
        course: The line on the skin that it follows as that lies; None: it goes as planned.
        is_led: Whether a person leads it, or has led it.

    Raises:
        StrokeError: fewer than two poses; a number that is not finite; times that do not increase;
            an edge of no length or of changing length; a `forward` along the edge; a blade faster
            than `FASTEST`. The message counts poses from 0.
    """

    def __init__(
        self,
        times: Sequence[float] | FloatArray,
        segments: Sequence[BladeSegment],
        name: str = "",
        *,
        asked: Sequence[tuple[float, float]] | None = None,
        guards: Sequence[Guard] = (),
        course: SkinCourse | None = None,
        is_led: bool = False,
    ) -> None:
        self.name = name
        self.guards = tuple(guards)
        """Guards that may end each of the strokes in turn; none where there are none."""
        self.course = course
        """The line on the skin that it follows as that lies, of one stroke alone; those of several
        in turn are in their guards."""
        self.is_led = is_led
        """Whether a person leads it, or has led it: the arm then stands where it reaches all
        around the body, wherever that stroke goes."""
        self.asked = asked
        """Intervals in which the edge passes what it is to cut [s]; None where it is not known."""
        given = np.array(times, np.float64)
        if given.shape != (len(segments),) or len(given) < 2:
            raise StrokeError(
                f"a stroke has {len(given)} times and {len(segments)} poses; it needs as many of "
                "one as of the other, and at least two"
            )
        self.start = segments[0]
        """The first pose, as it was given."""
        tips, heels, forwards = (np.array(part, np.float64) for part in zip(*segments, strict=True))
        if not tips.shape == heels.shape == forwards.shape == (len(segments), 3):
            raise StrokeError("tip, heel and forward of every pose are three numbers each")
        _check(given, tips, heels, forwards)
        self.times = given - given[0]
        """Times of the poses [s], from 0; shape (n,)."""
        middles, rotations, lengths = poses_of_edges(tips, heels, forwards)
        self.blade_length = float(lengths[0])
        """From heel to tip [m]."""
        self.path = np.column_stack(
            [
                self.times[:-1],
                self.times[1:],
                np.full(len(given) - 1, 0.5 * self.blade_length),
                rotations[:-1],
                [_turn(*pair) for pair in pairwise(rotations)],
                middles[:-1],
                np.diff(middles, axis=0),
            ]
        )
        """The way from each pose to the next: its first and last instant [s], half the length of
        the edge [m], the rotation at its start (w, x, y, z), the rotation vector of its turn [rad]
        in that frame, the middle of the edge at its start [m], and its move [m]; (n - 1, 16)."""

    @property
    def duration(self) -> float:
        """Time that the stroke takes [s]."""
        return float(self.times[-1])

    def pose(self, t: float) -> BladeSegment:
        """Return the blade's pose at time `t` [s]. It rests before the start and after the end."""
        # Not above: what only lists scenes starts without the compiler.
        from scalpel_sim.strokes.path import pose_on_path

        return BladeSegment(*map(np.array, pose_on_path(float(t), self.path)))

    def poses(self, count: int) -> list[BladeSegment]:
        """Return `count` poses, evenly in time, the first and the last included."""
        return [self.pose(t) for t in np.linspace(0.0, self.duration, count)]


def poses_of_edges(
    tips: FloatArray, heels: FloatArray, forwards: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the middles of edges [m], their rotations (w, x, y, z), and their lengths [m].

    Args:
        tips: Shape (n, 3), as the others.
        heels: The other ends [m].
        forwards: Directions in which they cut; only the part across the edge counts.
    """
    edges = tips - heels
    lengths = np.linalg.norm(edges, axis=1)
    return (tips + heels) / 2.0, _quaternions(edges / lengths[:, None], forwards), lengths


def from_csv(path: str | Path) -> Stroke:
    """Read a stroke from a CSV file: one pose per line, in metres and seconds, tissue frame.

    The first line names the columns: `t, tip_x, tip_y, tip_z, heel_x, heel_y, heel_z` and, if
    wanted, `forward_x, forward_y, forward_z`, in any order. Without the latter the blade cuts
    in the direction in which it moves. Empty lines, and lines that start with #, are skipped.
    A stroke that was led by hand has a last column, `engaged`: whether the hand led the blade.

    Raises:
        StrokeError: no such file, or one that is no such table; the message names file and line.
    """
    path = Path(path)
    numbered = numbered_lines(path, "stroke", _COLUMNS)
    columns = _columns(path, *numbered[0])
    table = np.array([numbers_of(path, *line, columns) for line in numbered[1:]])
    if len(table) < 2:
        raise StrokeError(f"{path} has {len(table)} poses; a stroke needs at least two")
    times, tips, heels = table[:, 0], table[:, 1:4], table[:, 4:7]
    if len(columns) >= len(_COLUMNS) + len(FORWARD_COLUMNS):
        forwards = table[:, 7:10]
    else:
        forwards = _forwards_of_motion(path, tips, heels)
    try:
        segments = [BladeSegment(*pose) for pose in zip(tips, heels, forwards, strict=True)]
        return Stroke(times, segments, path.stem, is_led=len(columns) == len(LED_COLUMNS))
    except _PoseError as error:
        raise StrokeError(f"{path}, line {numbered[1 + error.pose][0]}: {error.problem}") from error


class _PoseError(StrokeError):
    """Fault of one pose, so that a reader can name its line."""

    def __init__(self, pose: int, problem: str) -> None:
        super().__init__(f"pose {pose} of the stroke: {problem}")
        self.pose = pose
        self.problem = problem


def _check(times: FloatArray, tips: FloatArray, heels: FloatArray, forwards: FloatArray) -> None:
    """Refuse the first pose that a blade cannot take."""
    finite = np.isfinite(np.column_stack([times, tips, heels, forwards])).all(axis=1)
    if not finite.all():
        raise _PoseError(int(np.argmin(finite)), "a number is not finite")
    steps = np.diff(times)
    if (steps <= 0.0).any():
        i = int(np.argmax(steps <= 0.0)) + 1
        raise _PoseError(i, f"time {times[i]:g} s follows {times[i - 1]:g} s; times must increase")
    edges = tips - heels
    lengths = np.linalg.norm(edges, axis=1)
    if (lengths == 0.0).any():
        raise _PoseError(int(np.argmin(lengths)), "tip and heel coincide: the blade has no length")
    off = np.abs(lengths - lengths[0]) > _SAME_LENGTH * lengths[0]
    if off.any():
        i = int(np.argmax(off))
        raise _PoseError(
            i,
            f"the blade is {1e3 * lengths[i]:.4g} mm long, and was {1e3 * lengths[0]:.4g} mm at "
            "the start; a blade does not stretch",
        )
    across = np.cross(edges, forwards)
    along = np.linalg.norm(across, axis=1) <= 1e-3 * lengths * np.linalg.norm(forwards, axis=1)
    if along.any():
        raise _PoseError(
            int(np.argmax(along)), "forward is zero or runs along the edge; a blade cuts across it"
        )
    speeds = np.maximum(*(np.linalg.norm(np.diff(end, axis=0), axis=1) for end in (tips, heels)))
    speeds /= steps
    if (speeds > FASTEST).any():
        i = int(np.argmax(speeds > FASTEST)) + 1
        raise _PoseError(
            i,
            f"the blade arrives here at {speeds[i - 1]:.3g} m/s, and {FASTEST:g} m/s is the limit; "
            "are the times in seconds and the positions in metres?",
        )


def _quaternions(edges: FloatArray, forwards: FloatArray) -> FloatArray:
    """Return the rotations (w, x, y, z) of a blade body whose +y is the edge and -z is forward.

    Args:
        edges: Unit vectors from heel to tip, shape (n, 3).
        forwards: Shape (n, 3); only the part across the edge counts.
    """
    across = forwards - (forwards * edges).sum(axis=1, keepdims=True) * edges
    backs = -across / np.linalg.norm(across, axis=1, keepdims=True)
    axes = np.stack([cross_rows(edges, backs), edges, backs], axis=2)
    quaternions = np.empty((len(edges), 4))
    for quaternion, matrix in zip(quaternions, axes, strict=True):
        mujoco.mju_mat2Quat(quaternion, matrix.ravel())
    return quaternions


def _turn(before: FloatArray, after: FloatArray) -> FloatArray:
    """Return the rotation vector, in the frame of `before`, that leads to `after`."""
    turn = np.zeros(3)
    if not np.array_equal(before, after):  # a blade at rest is not turned by rounding
        mujoco.mju_subQuat(turn, after, before)
    return turn


def _columns(path: Path, number: int, header: list[str]) -> list[int]:
    """Return where each of the columns is, in the order in which they are used."""
    names = [name.lower() for name in header]
    wanted = _COLUMNS + (FORWARD_COLUMNS if set(FORWARD_COLUMNS) & set(names) else ())
    if _ENGAGED_COLUMN in names:
        wanted = LED_COLUMNS
    if sorted(names) != sorted(wanted):
        raise StrokeError(
            f"{path}, line {number}: the columns are '{','.join(header)[:200]}'; wanted "
            f"{','.join(_COLUMNS)} and, if the blade does not cut in the direction of motion, "
            f"{','.join(FORWARD_COLUMNS)}, and {_ENGAGED_COLUMN} too if a hand has led it"
        )
    return [names.index(name) for name in wanted]


def _forwards_of_motion(path: Path, tips: FloatArray, heels: FloatArray) -> FloatArray:
    """Return the direction in which the middle of the edge moves, across the edge, at each pose.

    Where the blade rests, or only slides along itself, it keeps the direction that it had before,
    or at the start the first one that it will have.
    """
    edges = (tips - heels) / np.maximum(np.linalg.norm(tips - heels, axis=1, keepdims=True), 1e-12)
    moves = np.gradient((tips + heels) / 2.0, axis=0)
    moves -= (moves * edges).sum(axis=1, keepdims=True) * edges
    lengths = np.linalg.norm(moves, axis=1)
    moving = lengths > 1e-3 * lengths.max(initial=0.0)
    if not moving.any():
        raise StrokeError(
            f"{path}: the blade never moves across its edge, so the file must give the direction "
            f"in which it cuts, in columns {','.join(FORWARD_COLUMNS)}"
        )
    last = np.maximum.accumulate(np.where(moving, np.arange(len(moves)), -1))
    return np.asarray(moves[np.where(last < 0, int(np.argmax(moving)), last)])
