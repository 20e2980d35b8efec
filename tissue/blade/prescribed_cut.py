"""A cut along a given ruled surface in the body at rest: no blade, no force, no time passes."""

import numpy as np

from tissue.blade.interaction import MOST_SAMPLES, SAMPLES_PER_NODE_SIZE
from tissue.blade.prescribed_path import begin_path, prescribe_path
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
