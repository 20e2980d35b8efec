"""A cut along a given ruled surface in the body at rest: no blade, no force, no time passes."""

import numpy as np
import numpy.typing as npt

from tissue.blade.edge import LEAST_SINE, expect_small_turn
from tissue.blade.interaction import MOST_SAMPLES, SAMPLES_PER_NODE_SIZE
from tissue.core.array_types import FloatArray
from tissue.core.jit import kernel
from tissue.core.vec3 import Vec3, cross, dot, norm, scale, store, sub, vec3
from tissue.cutting.blade_path import Path, average_directions, path_travel, resampled
from tissue.cutting.end_depth import shift_ends, take_back_shifts
from tissue.cutting.incision import CutHooks, Incision
from tissue.mesh.body import Body, walk
from tissue.mesh.point_location import tetrahedron_at, tetrahedron_in_box
from tissue.mesh.tetrahedron_grid import TetrahedronGrid, build_grid, list_appended


def cut_along(
    incision: Incision,
    hooks: CutHooks,
    edges: FloatArray,
    forward: FloatArray,
    node_size: float,
) -> None:
    """Cut from each place of an edge to the next; the incision is left to be ended.

    Args:
        incision: An incision that has not begun.
        hooks: Calls of the owner of the mesh.
        edges: Places of the edge in the body at rest [m], shape (n_places, n_points, 3).
        forward: Unit vectors in which the edge faces, shape (n_places, 3).
        node_size: Mean node size of the body [m].
    """
    rows = resampled(edges, node_size / SAMPLES_PER_NODE_SIZE, MOST_SAMPLES)
    incision.take_edge(rows.shape[1])
    path = incision.path
    body, _ = hooks.mesh()
    grid = build_grid(body, body.rest, 0.0)
    begin_path(path, rows[0])
    prescribe_path(path, body, grid, rows[0], Vec3(*forward[0].tolist()), node_size)
    incision.has_begun = True
    incision.open_to_edge(hooks)  # where the edge begins within the body, so does the cut
    for i in range(1, len(rows)):
        n = incision.n_increments(float(np.linalg.norm(rows[i] - rows[i - 1], axis=1).max()))
        for j in range(1, n + 1):
            at = j / n
            points = (1.0 - at) * rows[i - 1] + at * rows[i]
            direction = Vec3(*((1.0 - at) * forward[i - 1] + at * forward[i]).tolist())
            body, visits = hooks.mesh()  # after a cut perhaps another body, with more room
            if not list_appended(body, body.rest, grid):
                grid = build_grid(body, body.rest, 0.0)
            prescribe_path(path, body, grid, points, direction, node_size)
            if incision.detect(body, visits, path_travel(incision.path)):
                incision.cut(hooks)


def checked_edges(edges: npt.ArrayLike, forward: npt.ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Return the places of a cutting edge, and where it faces in each.

    Raises:
        ValueError: an array has another shape, is not finite, or an edge faces along itself.
    """
    rows = np.array(edges, dtype=np.float64)
    if rows.ndim != 3 or rows.shape[2] != 3 or min(rows.shape[:2]) < 2:
        raise ValueError(
            f"edges have shape {rows.shape}; they are two or more places of two or more points: "
            "(n_places, n_points, 3)"
        )
    directions = np.array(forward, dtype=np.float64)
    if directions.shape not in ((3,), (len(rows), 3)):
        raise ValueError(f"forward has shape {directions.shape}; it is (3,) or ({len(rows)}, 3)")
    if not (np.isfinite(rows).all() and np.isfinite(directions).all()):
        raise ValueError("edges and forward hold a number that is not finite")
    directions = np.broadcast_to(directions, (len(rows), 3)).copy()
    along = rows[:, -1] - rows[:, 0]
    across = np.linalg.norm(np.cross(along, directions), axis=1)
    limit = LEAST_SINE * np.linalg.norm(along, axis=1) * np.linalg.norm(directions, axis=1)
    wrong = np.flatnonzero(~(across > limit))
    if len(wrong):
        i = int(wrong[0])
        raise ValueError(
            f"the edge in place {i} has no length or cuts along itself: forward is "
            f"{directions[i].tolist()}, from tip to heel is {along[i].tolist()}"
        )
    expect_small_turn(along, directions)
    return rows, directions / np.linalg.norm(directions, axis=1)[:, None]


@kernel
def begin_path(path: Path, points: FloatArray) -> None:
    """Begin the path with the edge at `points` [m], shape (n, 3), in the body at rest."""
    n = len(path.member)
    for k in range(n):
        store(path.t1, k, vec3(points, k))
        path.seed[k] = -1
        path.member[k] = True
        path.known[k] = True
        path.linked[k] = k + 1 < n


@kernel
def prescribe_path(
    path: Path,
    body: Body,
    grid: TetrahedronGrid,
    points: FloatArray,
    forward: Vec3,
    node_size: float,
) -> None:
    """Advance the edge to given points.

    A sample that is not ahead of where it has been is held there: only the edge cuts, not the back.

    Args:
        path: Written; its last end is the new start.
        body: The tissue.
        grid: Where its tetrahedra are at rest.
        points: Points of the edge in the body at rest [m], shape (n, 3).
        forward: Unit vector in which the edge cuts, in the body at rest.
        node_size: Mean node size of the body [m].
    """
    n = len(path.member)
    along = sub(vec3(points, n - 1), vec3(points, 0))
    normal = cross(forward, along)
    sideways = scale(1.0 / norm(normal), normal)
    take_back_shifts(path)
    for k in range(n):
        store(path.sideways, k, sideways)
        start = vec3(path.t1, k)
        p = vec3(points, k)
        store(path.t0, k, start)
        store(path.forward, k, forward)
        if dot(sub(p, start), forward) > 0.0:
            store(path.t1, k, p)
    average_directions(path, node_size)
    for k in range(n):
        path.seed[k] = _find_seed(path, body, grid, k)
    shift_ends(path, body, node_size)


@kernel
def _find_seed(path: Path, body: Body, grid: TetrahedronGrid, k: int) -> int:
    """Return a tetrahedron that holds sample `k`, or one that its segment may sweep through."""
    p = vec3(path.t1, k)
    if path.seed[k] >= 0:
        at = walk(body, p, path.seed[k])
        if at.inside:
            return at.tetrahedron
    t = tetrahedron_at(body, grid, body.rest, p)
    if t >= 0:
        return t
    other = min(k + 1, len(path.member) - 1)
    a = vec3(path.t0, k)
    b = vec3(path.t0, other)
    c = vec3(path.t1, other)
    low = Vec3(
        min(min(a.x, b.x), min(c.x, p.x)),
        min(min(a.y, b.y), min(c.y, p.y)),
        min(min(a.z, b.z), min(c.z, p.z)),
    )
    high = Vec3(
        max(max(a.x, b.x), max(c.x, p.x)),
        max(max(a.y, b.y), max(c.y, p.y)),
        max(max(a.z, b.z), max(c.z, p.z)),
    )
    return tetrahedron_in_box(body, grid, body.rest, low, high)
