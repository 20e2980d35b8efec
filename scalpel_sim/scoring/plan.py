"""The plan of a task: the surface that is to be cut, as places in the body at rest.

It is given as a line on the skin and a depth, as a surface, or by the strokes of the scene: then it
is what the edge passes on its way forward if the body does not give way.
"""

import itertools
import math
import zipfile
from pathlib import Path
from typing import NamedTuple

import numpy as np

from scalpel_sim.errors import UsageError
from scalpel_sim.scene.task_table import DOWN, TaskTable
from scalpel_sim.scoring.sampled_surface import PLAN_SPACING, SampledSurface, sampled_triangles
from scalpel_sim.strokes.asked import PassedPlaces, tetrahedra_at
from scalpel_sim.strokes.skin import BodySkin
from scalpel_sim.strokes.stroke import Stroke
from tissue import FloatArray, IntArray, Snapshot, TetrahedralMesh
from tissue.support import deepen, place_tree

PLAN_SUFFIX = ".npz"
"""Suffix of a file of a plan."""

STATION = 1e-3
"""Distance between two stations along a line, at which depths are compared [m]."""

_MOST_POSES = 20_000
"""Poses of a stroke that are looked at, at most: of a saw that goes far back and forth."""

_LEAST_TURN = 0.5
"""Length of the mean of unit normals above which a surface faces one way, about."""


class Plan(NamedTuple):
    """A surface to be cut, in the body at rest."""

    surface: SampledSurface
    """Places in the body on the surface."""
    into: FloatArray
    """Unit vector in which depth is measured, shape (3,)."""
    line: FloatArray
    """Where the surface meets the skin, in order [m], shape (n, 3): for drawing. None of a surface
    from a file."""
    stations: FloatArray
    """Places of the line, `STATION` apart, at which depths are compared [m], shape (k, 3)."""
    depths: FloatArray
    """Planned depths below the stations [m], shape (k,)."""

    @property
    def area(self) -> float:
        """Area of the surface [m2]."""
        return float(self.surface.areas.sum())

    def write(self, path: Path) -> None:
        """Write the plan as a NumPy archive, which `surface` of a task may name.

        Raises:
            OSError: the system refuses.
        """
        with path.open("wb") as file:
            np.savez(file, allow_pickle=False, **self.surface._asdict(), **self._asdict_of_line())

    def _asdict_of_line(self) -> dict[str, FloatArray]:
        """Return the arrays besides those of the surface, by name."""
        return {name: array for name, array in self._asdict().items() if name != "surface"}


class StationSearch:
    """Finds the station that a place is below.

    Args:
        stations: Places on the skin [m], shape (k, 3), one at least.
        into: Unit vector in which depth is measured.
        aside: Distance from the line, seen along the depth, up to which a place counts [m].
    """

    def __init__(self, stations: FloatArray, into: FloatArray, aside: float) -> None:
        self._into, self._heights = into, stations @ into
        self._reach = math.hypot(aside, 0.5 * STATION)
        self._seen = place_tree(_seen_along(stations, into))

    def deepen(self, points: FloatArray, depths: FloatArray) -> None:
        """Write how deep the deepest of some places is below each station, where that is more.

        Args:
            points: In the body at rest [m], shape (n, 3).
            depths: Written [m], shape (k,).
        """
        deepen(self._seen, self._into, self._heights, self._reach, points, depths)


def plan_of(task: TaskTable, stroke: Stroke, body: Snapshot) -> Plan | None:
    """Return the plan of a task; None where neither it nor a stroke says what is to be cut.

    Args:
        task: The task.
        stroke: The strokes of the scene in turn, tissue frame.
        body: The body as it lies before them, tissue frame.

    Raises:
        UsageError: the line or the surface is nowhere in the body.
    """
    if task.line is not None:
        return plan_of_line(task, body, skin_at_rest(body))
    if task.surface is not None:
        path = Path(task.surface)
        return _read(path) if path.suffix == PLAN_SUFFIX else _plan_of_surface(task, path, body)
    if stroke.asked is None:
        return None
    return _plan_of_stroke(task, stroke, body)


def _read(path: Path) -> Plan:
    """Return a plan that `Plan.write` has written.

    Raises:
        UsageError: there is no such file, or it holds no plan.
    """
    try:
        with np.load(path, allow_pickle=False) as file:
            surface = SampledSurface(*(file[name] for name in SampledSurface._fields))
            return Plan(surface, *(file[name] for name in Plan._fields[1:]))
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile) as error:
        raise UsageError(f"[task] surface: {path} holds no plan of a run ({error})") from error


def plan_of_line(task: TaskTable, body: Snapshot, skin: BodySkin) -> Plan:
    """Return the sheet below a line on the skin.

    Args:
        task: A task with a line.
        body: The body.
        skin: Its skin: see `skin_at_rest`.

    Raises:
        UsageError: the line misses the body.
    """
    assert task.line is not None and task.depth is not None
    into = depth_direction(task)
    corners = corners_of_line(task, body)
    middles, ways = [], []
    for start, end in itertools.pairwise(corners):
        way = end - start - float((end - start) @ into) * into
        n = max(math.ceil(float(np.linalg.norm(way)) / PLAN_SPACING), 1)
        middles.append(start + np.outer((np.arange(n) + 0.5) / n, end - start))
        ways.append(np.repeat(way[None] / n, n, axis=0))
    line = _on_skin(np.concatenate(middles), skin, into)
    steps = np.concatenate(ways)
    widths = np.linalg.norm(steps, axis=1)
    n_deep = math.ceil(task.depth / PLAN_SPACING)
    deep = (np.arange(n_deep) + 0.5) * task.depth / n_deep
    places = (line[:, None] + deep[None, :, None] * into).reshape(-1, 3)
    normals = np.repeat(np.cross(steps, into) / widths[:, None], n_deep, axis=0)
    areas = np.repeat(widths * task.depth / n_deep, n_deep)
    return _plan(SampledSurface(places, normals, areas), line, into, body)


def corners_of_line(task: TaskTable, body: Snapshot) -> FloatArray:
    """Return the points of the line of a task, some of them above the body [m], shape (n, 3)."""
    assert task.line is not None
    high = float(body.rest_positions[:, 2].max())
    return np.array([(*point, high) if len(point) == 2 else point for point in task.line])


def depth_direction(task: TaskTable) -> FloatArray:
    """Return the unit vector in which the depth of a line is measured, shape (3,)."""
    return _unit(task.into or DOWN)


def _on_skin(places: FloatArray, skin: BodySkin, into: FloatArray) -> FloatArray:
    """Return where the skin is over or under places of the line [m], shape (n, 3)."""
    found = skin.entered_along(places, into)
    if found.faces.min() < 0:
        at = ", ".join(f"{1e3 * x:.1f}" for x in places[found.faces.argmin()])
        raise UsageError(
            f"[task] line misses the body at ({at}) mm: along the depth, "
            f"{[round(float(x), 3) for x in into]}, no skin is over or under it"
        )
    return skin.rest_places(found)


def _plan_of_surface(task: TaskTable, path: Path, body: Snapshot) -> Plan:
    """Return the surface of an STL file, as far as it is in the body."""
    import trimesh  # 0.3 s, and only here

    try:
        mesh = trimesh.load_mesh(path)
        corners = np.asarray(mesh.triangles, float)
    except Exception as error:  # whatever its readers raise
        raise UsageError(f"[task] surface: {path} cannot be read as a surface ({error})") from error
    if len(corners) == 0:
        raise UsageError(f"[task] surface: {path} has no triangles")
    sampled = sampled_triangles(corners)
    return _plan(sampled, np.zeros((0, 3)), _unit(task.into or DOWN), body)


def _plan_of_stroke(task: TaskTable, stroke: Stroke, body: Snapshot) -> Plan:
    """Return what the edge passes on its way forward, in the body at rest."""
    assert stroke.asked is not None
    passed = PassedPlaces(2.0 * PLAN_SPACING)
    places, areas, poses = list[FloatArray](), list[FloatArray](), list[IntArray]()
    for start, end in stroke.asked:
        for pose in _passed(stroke, start, end):
            is_first = passed.pass_by(pose.places)
            places.append(pose.places[is_first])
            areas.append(np.repeat(pose.area[None], int(is_first.sum()), axis=0))
            poses.append(np.full(int(is_first.sum()), len(poses)))
        passed.pause()
    at, vectors = np.concatenate(places), np.concatenate(areas)
    holder, weights = tetrahedra_at(at, body)
    is_in = (holder >= 0) & vectors.any(axis=1)
    corners = body.tetrahedra[holder[is_in]]
    at_rest = np.einsum("nk,nkx->nx", weights[is_in], body.rest_positions[corners])
    vectors = _vectors_at_rest(vectors[is_in], corners, body)
    sizes = np.linalg.norm(vectors, axis=1)
    if len(sizes) == 0:
        raise UsageError("[task] has no line or surface, and the strokes pass through no tissue")
    # Places go from the tip to the heel: of each pose the last is where the edge enters.
    pose_of = np.concatenate(poses)[is_in]
    line = at_rest[np.append(np.flatnonzero(np.diff(pose_of)), len(pose_of) - 1)]
    normals = vectors / sizes[:, None]
    into = _unit(task.into) if task.into else _into_skin(line, normals, body)
    return _plan(SampledSurface(at_rest, normals, sizes), line, into, body)


class _PassedPose(NamedTuple):
    """Places that the edge passes from one pose to the next."""

    places: FloatArray
    """Along the edge, from the tip to the heel [m], shape (n, 3)."""
    area: FloatArray
    """Area vector of each [m2], shape (3,); 0 where the edge goes back."""


def _passed(stroke: Stroke, start: float, end: float) -> list[_PassedPose]:
    """Return what the edge passes between two instants, `PLAN_SPACING` apart both ways."""
    times = np.linspace(start, end, 1001)
    ends = np.array([(pose.tip, pose.heel) for pose in map(stroke.pose, times.tolist())])
    way = np.linalg.norm(np.diff(ends, axis=0), axis=2).max(axis=1)
    along = np.append(0.0, np.cumsum(way))
    n = min(max(math.ceil(float(along[-1]) / PLAN_SPACING), 1), _MOST_POSES)
    instants = np.interp(np.linspace(0.0, along[-1], n + 1), along, times)
    poses = [stroke.pose(t) for t in instants.tolist()]
    n_places = max(math.ceil(stroke.blade_length / PLAN_SPACING), 1)
    shares = (np.arange(n_places) + 0.5)[:, None] / n_places
    found = []
    for before, after in itertools.pairwise(poses):
        tip, heel = 0.5 * (before.tip + after.tip), 0.5 * (before.heel + after.heel)
        forward = before.forward + after.forward
        forward = forward / np.linalg.norm(forward)
        motion = 0.5 * (after.tip + after.heel - before.tip - before.heel)
        ahead = max(float(motion @ forward), 0.0) / n_places
        edge = heel - tip
        found.append(_PassedPose(tip + shares * edge, ahead * np.cross(edge, forward)))
    return found


def _vectors_at_rest(vectors: FloatArray, corners: IntArray, body: Snapshot) -> FloatArray:
    """Return area vectors in the body at rest, after Nanson [m2], shape (n, 3).

    Args:
        vectors: In the body as it lies [m2], shape (n, 3).
        corners: Nodes of the tetrahedra that they are in, shape (n, 4).
        body: The body.
    """
    lying, rest = body.positions[corners], body.rest_positions[corners]
    now = np.swapaxes(lying[:, 1:] - lying[:, :1], 1, 2)
    gradient = now @ np.linalg.inv(np.swapaxes(rest[:, 1:] - rest[:, :1], 1, 2))
    found = np.einsum("nji,nj->ni", gradient, vectors)
    return np.asarray(found / np.linalg.det(gradient)[:, None])


def _plan(surface: SampledSurface, line: FloatArray, into: FloatArray, body: Snapshot) -> Plan:
    """Return the plan of a surface, of which only what is in the body counts.

    Raises:
        UsageError: nothing of it is.
    """
    at_rest = body._replace(positions=body.rest_positions)
    holder, _ = tetrahedra_at(surface.points, at_rest)
    kept = SampledSurface(*(each[holder >= 0] for each in surface))
    if len(kept.points) == 0:
        raise UsageError("[task]: nothing of the planned surface is in the body")
    stations, depths = _stations(line, into), np.zeros(0)
    if len(stations):
        search = StationSearch(stations, into, PLAN_SPACING)
        depths = np.full(len(stations), -np.inf)
        search.deepen(kept.points, depths)
        depths += 0.5 * PLAN_SPACING
        is_planned = depths > PLAN_SPACING
        stations, depths = stations[is_planned], depths[is_planned]
    return Plan(kept, into, line, stations, depths)


def _stations(line: FloatArray, into: FloatArray) -> FloatArray:
    """Return places on a line, `STATION` apart as seen along the depth [m], shape (k, 3)."""
    if len(line) < 2:
        return line[:1]
    steps = np.linalg.norm(np.diff(_seen_along(line, into), axis=0), axis=1)
    along = np.append(0.0, np.cumsum(steps))
    n = max(int(along[-1] / STATION), 1)
    at = (np.arange(n) + 0.5) * along[-1] / n
    return np.stack([np.interp(at, along, line[:, k]) for k in range(3)], axis=1)


def _seen_along(points: FloatArray, into: FloatArray) -> FloatArray:
    """Return points moved along a direction into the plane across it through the origin [m]."""
    return np.asarray(points - np.outer(points @ into, into))


def _into_skin(line: FloatArray, normals: FloatArray, body: Snapshot) -> FloatArray:
    """Return the direction into the skin along a line, in the surface where that is about flat."""
    from scipy.spatial import cKDTree  # 0.2 s, and only here

    faces = skin_at_rest(body).at_rest
    outward = np.cross(faces[:, 1] - faces[:, 0], faces[:, 2] - faces[:, 0])
    outward /= np.linalg.norm(outward, axis=1)[:, None]
    _, nearest = cKDTree(faces.mean(axis=1)).query(line)
    into = -outward[nearest].mean(axis=0)
    across = normals.mean(axis=0)
    if float(np.linalg.norm(across)) > _LEAST_TURN:
        across /= np.linalg.norm(across)
        into = into - float(into @ across) * across
    return np.asarray(into / np.linalg.norm(into))


def skin_at_rest(body: Snapshot) -> BodySkin:
    """Return the skin of a body at rest."""
    return BodySkin.of(TetrahedralMesh(body.rest_positions, body.tetrahedra))


def _unit(vector: tuple[float, float, float]) -> FloatArray:
    """Return a vector of length 1 along another, shape (3,)."""
    return np.asarray(np.array(vector) / np.linalg.norm(vector))
