"""The path of an edge whose way through the body at rest is given, not traced by anchors."""

from tissue.body import Body, walk
from tissue.jit import kernel
from tissue.path import Path
from tissue.tetrahedron_grid import TetrahedronGrid, tetrahedron_at, tetrahedron_near
from tissue.types import FloatArray
from tissue.vec3 import Vec3, cross, dot, norm, scale, store, sub, vec3


@kernel
def begin_path(path: Path, points: FloatArray) -> None:
    """Let the edge be at `points` [m], shape (n, 3), at rest; it has not moved yet."""
    n = len(path.member)
    for k in range(n):
        store(path.t1, k, vec3(points, k))
        path.seed[k] = -1
        path.member[k] = True
        path.known[k] = True
        path.linked[k] = k + 1 < n


@kernel
def prescribe_path(
    path: Path, body: Body, grid: TetrahedronGrid, points: FloatArray, forward: Vec3
) -> None:
    """Let the edge go on to `points` [m], shape (n, 3), at rest, cutting `forward`.

    A sample that is not ahead of where it has been is held there: only the edge cuts, not the back.
    """
    n = len(path.member)
    along = sub(vec3(points, n - 1), vec3(points, 0))
    flat = cross(forward, along)
    store(path.sideways, 0, scale(1.0 / norm(flat), flat))
    for k in range(n):
        start = vec3(path.t1, k)
        p = vec3(points, k)
        store(path.t0, k, start)
        store(path.forward, k, forward)
        if dot(sub(p, start), forward) > 0.0:
            store(path.t1, k, p)
            path.seed[k] = _find_seed(body, grid, p, path.seed[k])


@kernel
def _find_seed(body: Body, grid: TetrahedronGrid, p: Vec3, before: int) -> int:
    """A tetrahedron at or near the rest point `p` [m]."""
    if before >= 0:
        at = walk(body, p, before)
        if at.inside:
            return at.tetrahedron
    t = tetrahedron_at(body, grid, body.rest, p)
    return t if t >= 0 else tetrahedron_near(grid, p)
