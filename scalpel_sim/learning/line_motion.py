"""Motions of the line of a task on the skin, and of the strokes that are traced along it."""

import math

import numpy as np
from msgspec import structs

from scalpel_sim.scene.task_table import TaskTable
from scalpel_sim.scoring.plan import corners_of_line, depth_direction
from scalpel_sim.strokes.kind import StrokeTable
from tissue import FloatArray, Snapshot

TRACED = "traced"
"""Kind of the strokes that move with the line."""


class LineMotion:
    """Moves a line across the direction of its depth, and turns it about that.

    The middle between its first and its last point is what it turns about; a motion is how far it
    moves along itself and to the right, seen along the depth [m], and turns clockwise [degree].

    Args:
        task: A task with a line.
        body: The body.
    """

    def __init__(self, task: TaskTable, body: Snapshot) -> None:
        self._task, self._into = task, depth_direction(task)
        self._corners = corners = corners_of_line(task, body)
        self._middle = 0.5 * (corners[0] + corners[-1])
        way = corners[-1] - corners[0]
        if not np.linalg.norm(np.cross(way, self._into)):  # it ends where it begins
            way = corners[1] - corners[0]
        along = way - float(way @ self._into) * self._into
        self._along = along / np.linalg.norm(along)
        self._across = np.cross(self._into, self._along)

    def moved(self, points: FloatArray, motion: tuple[float, float, float]) -> FloatArray:
        """Return points that are moved with the line [m], shape (n, 3)."""
        along, across, degrees = motion
        turn, offsets = math.radians(degrees), points - self._middle
        deep = np.outer(offsets @ self._into, self._into)
        flat = offsets - deep
        turned = math.cos(turn) * flat + math.sin(turn) * np.cross(self._into, flat)
        shift = along * self._along + across * self._across
        return np.asarray(self._middle + deep + turned + shift)

    def moved_task(self, motion: tuple[float, float, float]) -> TaskTable:
        """Return the task with its line moved."""
        line = self.moved(self._corners, motion).tolist()
        return structs.replace(self._task, line=[(x, y, z) for x, y, z in line])

    def moved_stroke(self, row: StrokeTable, motion: tuple[float, float, float]) -> StrokeTable:
        """Return a stroke that is moved with the line, if it is traced, else the stroke itself."""
        if row.kind != TRACED or row.points is None:
            return row
        ends = np.array(row.points)
        edge = row.edge
        if edge is not None:  # a direction turns alone
            there, origin = self.moved(np.array([edge, np.zeros(3)]), motion)
            x, y, z = (there - origin).tolist()
            edge = (x, y, z)
        points = [(x, y, z) for x, y, z in self.moved(ends, motion).tolist()]
        return structs.replace(row, points=points, edge=edge)
