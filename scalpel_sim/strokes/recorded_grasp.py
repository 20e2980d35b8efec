"""Reads what a hand did with a grasper, from a CSV file."""

from itertools import pairwise
from pathlib import Path

import numpy as np

from scalpel_sim.strokes.csv_lines import StrokeError, numbered_lines, numbers_of
from scalpel_sim.strokes.grasp_motion import GraspMotion, Waypoint, edge_of_grasper
from scalpel_sim.strokes.stroke import FASTEST
from scalpel_sim.tables.values import WIDEST_OPENING

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
        edge_of_grasper(waypoint, 0.0, 1.0, name)
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
