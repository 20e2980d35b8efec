"""The path of an edge that is given in the body at rest, not traced by anchors."""

from tissue.core.array_types import FloatArray
from tissue.core.jit import kernel
from tissue.core.vec3 import Vec3, cross, dot, norm, scale, store, sub, vec3
from tissue.cutting.blade_path import Path, note_way
from tissue.mesh.body import Body, walk
from tissue.mesh.point_location import tetrahedron_at, tetrahedron_in_box
from tissue.mesh.tetrahedron_grid import TetrahedronGrid


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
    for k in range(n):
        store(path.sideways, k, sideways)
        start = vec3(path.t1, k)
        p = vec3(points, k)
        store(path.t0, k, start)
        store(path.forward, k, forward)
        if dot(sub(p, start), forward) > 0.0:
            store(path.t1, k, p)
    note_way(path, node_size)
    for k in range(n):
        path.seed[k] = _find_seed(path, body, grid, k)


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
