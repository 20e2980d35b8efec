"""All that a score compares with: plan, parts to be spared, limits. It never changes in a run."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from scalpel_sim.errors import UsageError, unknown
from scalpel_sim.scene.task_table import SpareTable, TaskTable
from scalpel_sim.scoring.plan import Plan, StationSearch, plan_of, plan_of_line
from scalpel_sim.scoring.sampled_surface import PLAN_SPACING, SurfaceSearch, sampled_triangles
from scalpel_sim.strokes.skin import BodySkin
from scalpel_sim.strokes.stroke import Stroke
from tissue import FloatArray, IntArray, Snapshot, boundary_faces
from tissue.support import labels_of_part

_MOST_PLACES = 50_000
"""Places on the surface of a part that is to be spared, about, at most."""


class SparedPart(NamedTuple):
    """A part of the body that is to stay whole."""

    name: str
    """Its name."""
    labels: tuple[int, ...]
    """Its labels."""
    margin: float
    """Distance from it that no cut may come below [m]."""
    search: SurfaceSearch
    """Distances from its surface at rest."""


class StrainLimit(NamedTuple):
    """A strain of a part of the body that is not to be passed."""

    name: str | None
    """Name of the part; None: of all that has no limit of its own."""
    limit: float
    """Largest principal Green-Lagrange strain."""
    tetrahedra: IntArray
    """Tetrahedra of the part before any cut, shape (n,)."""
    centres: FloatArray
    """Their middles in the body at rest [m], shape (n, 3)."""
    volumes: FloatArray
    """Their volumes at rest [m3], shape (n,)."""


class Yardstick(NamedTuple):
    """The plan and the limits of a task, in the body at rest."""

    task: TaskTable
    """The task."""
    plan: Plan | None
    """Its plan; None where neither the task nor a stroke says what is to be cut."""
    plan_search: SurfaceSearch | None
    """Distances from it."""
    station_search: StationSearch | None
    """Finds the depth of a cut below stations; None without a line on the skin."""
    spared: tuple[SparedPart, ...]
    """Parts that are to stay whole."""
    strains: tuple[StrainLimit, ...]
    """Limits of strain."""
    target: tuple[int, ...]
    """Labels of the target; none where there is none."""

    def force_limit(self, instrument: str) -> float | None:
        """Return the force of an instrument that counts as no excess [N]; None: any."""
        for row in self.task.limits:
            if row.instrument == instrument and row.force is not None:
                return row.force
        return self.task.success.force


def yardstick_of(
    task: TaskTable, stroke: Stroke, body: Snapshot, names: Mapping[int, str]
) -> Yardstick:
    """Return what a run of a task is compared with.

    Args:
        task: The task.
        stroke: The strokes of the scene in turn, tissue frame.
        body: The body before them, as it lies, tissue frame.
        names: Names of its labels.

    Raises:
        UsageError: the plan is nowhere in the body, or it has no part of a name.
    """
    plan = plan_of(task, stroke, body)
    if plan is None:
        _expect_no_plan_needed(task)
    return Yardstick(
        task,
        plan,
        *_searches(task, plan),
        tuple(_spared(row, _labels_of(row.label, names, "spare"), body) for row in task.spare),
        _strain_limits(task, body, names),
        () if task.target is None else _labels_of(task.target, names, "target"),
    )


def with_line(yardstick: Yardstick, task: TaskTable, body: Snapshot, skin: BodySkin) -> Yardstick:
    """Return a yardstick with another line; what else is compared is the same.

    Args:
        yardstick: Of a task that has a line.
        task: The task, with the other line.
        body: The body before any cut.
        skin: Its skin at rest.

    Raises:
        UsageError: the line misses the body.
    """
    plan = plan_of_line(task, body, skin)
    search, stations = _searches(task, plan)
    return yardstick._replace(task=task, plan=plan, plan_search=search, station_search=stations)


def _searches(
    task: TaskTable, plan: Plan | None
) -> tuple[SurfaceSearch | None, StationSearch | None]:
    """Return what finds distances from a plan, and depths below its stations."""
    if plan is None:
        return None, None
    search = SurfaceSearch(plan.surface)
    if not len(plan.stations):
        return search, None
    return search, StationSearch(plan.stations, plan.into, task.tolerance)


def _expect_no_plan_needed(task: TaskTable) -> None:
    """Refuse conditions of a plan where there is none."""
    for key in ("covered", "off_plan", "path_error", "depth_error"):
        if getattr(task.success, key) is not None:
            raise UsageError(
                f"[task] success has {key}, and there is no plan: give a line and a depth, or a "
                "surface, for no stroke says what it is to cut"
            )


def _labels_of(name: str, names: Mapping[int, str], key: str) -> tuple[int, ...]:
    """Return the labels of a part: those of that name; or of a body, with those of its parts.

    Raises:
        UsageError: there is none; the message lists them.
    """
    if not names:
        raise UsageError(f"[task] {key} names '{name}', and the body has no [[label]]")
    try:
        return tuple(labels_of_part(list(names), names, name))
    except ValueError as error:
        raise UsageError(f"[task] {key}: {unknown('label', name, names.values())}") from error


def _spared(row: SpareTable, labels: tuple[int, ...], body: Snapshot) -> SparedPart:
    """Return a part that is to stay whole."""
    is_mine = np.isin(body.labels, labels)
    corners = body.rest_positions[boundary_faces(body.tetrahedra[is_mine])]
    sides = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = 0.5 * float(np.linalg.norm(sides, axis=1).sum())
    # Parts of a triangle are about half the square of their longest side.
    spacing = max(PLAN_SPACING, (2.0 * area / _MOST_PLACES) ** 0.5)
    search = SurfaceSearch(sampled_triangles(corners, spacing), spacing)
    return SparedPart(row.label, labels, row.margin, search)


def _strain_limits(
    task: TaskTable, body: Snapshot, names: Mapping[int, str]
) -> tuple[StrainLimit, ...]:
    """Return the limits of strain; that of no label is of what has none of its own."""
    rows = [row for row in task.limits if row.strain is not None]
    own = {
        row.label: _labels_of(row.label, names, "limits") for row in rows if row.label is not None
    }
    corners = body.rest_positions[body.tetrahedra]
    volumes = np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1])) / 6.0
    found = []
    for row in rows:
        if row.label is None:
            is_mine = ~np.isin(body.labels, [label for labels in own.values() for label in labels])
        else:
            is_mine = np.isin(body.labels, own[row.label])
        mine = np.flatnonzero(is_mine)
        assert row.strain is not None
        middles = corners[mine].mean(axis=1)
        found.append(StrainLimit(row.label, row.strain, mine, middles, volumes[mine]))
    return tuple(found)
