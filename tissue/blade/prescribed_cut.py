"""A cut along a given ruled surface in the body at rest: no blade, no force, no time passes."""

import numpy as np
import numpy.typing as npt

from tissue.blade.edge import LEAST_SINE
from tissue.blade.interaction import MOST_SAMPLES, SAMPLES_PER_NODE_SIZE
from tissue.blade.prescribed_path import begin_path, prescribe_path
from tissue.blade.sweep_checks import expect_small_turn
from tissue.core.array_types import FloatArray
from tissue.core.vec3 import Vec3
from tissue.cutting.blade_path import path_travel, resampled
from tissue.cutting.incision import CutHooks, Incision
from tissue.mesh.tetrahedron_grid import build_grid, list_appended


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
    ways = np.array(forward, dtype=np.float64)
    if ways.shape not in ((3,), (len(rows), 3)):
        raise ValueError(f"forward has shape {ways.shape}; it is (3,) or ({len(rows)}, 3)")
    if not (np.isfinite(rows).all() and np.isfinite(ways).all()):
        raise ValueError("edges and forward hold a number that is not finite")
    ways = np.broadcast_to(ways, (len(rows), 3)).copy()
    along = rows[:, -1] - rows[:, 0]
    across = np.linalg.norm(np.cross(along, ways), axis=1)
    limit = LEAST_SINE * np.linalg.norm(along, axis=1) * np.linalg.norm(ways, axis=1)
    wrong = np.flatnonzero(~(across > limit))
    if len(wrong):
        i = int(wrong[0])
        raise ValueError(
            f"the edge in place {i} has no length or cuts along itself: forward is "
            f"{ways[i].tolist()}, from tip to heel is {along[i].tolist()}"
        )
    expect_small_turn(along, ways)
    return rows, ways / np.linalg.norm(ways, axis=1)[:, None]
