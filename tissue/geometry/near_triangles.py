"""Points near triangles: which places of a surface others have come near."""

from tissue.core.array_types import BoolArray, FloatArray
from tissue.core.jit import kernel
from tissue.core.vec3 import dot, sub, vec3
from tissue.geometry.tetrahedron import nearest_on_triangle


@kernel
def mark_near_triangles(
    points: FloatArray, corners: FloatArray, within: float, marked: BoolArray
) -> None:
    """Mark the points that are near one of some triangles.

    Args:
        points: The points [m], shape (n, 3).
        corners: Corners of the triangles one after the other [m], shape (3 n_triangles, 3).
        within: Distance up to which a point is near [m].
        marked: Those that are marked already are not looked at, shape (n,).
    """
    for row in range(0, len(corners), 3):
        a, b, c = vec3(corners, row), vec3(corners, row + 1), vec3(corners, row + 2)
        low_x, high_x = min(a.x, b.x, c.x) - within, max(a.x, b.x, c.x) + within
        low_y, high_y = min(a.y, b.y, c.y) - within, max(a.y, b.y, c.y) + within
        low_z, high_z = min(a.z, b.z, c.z) - within, max(a.z, b.z, c.z) + within
        for i in range(len(points)):
            if marked[i] or not low_x <= points[i, 0] <= high_x:
                continue
            p = vec3(points, i)
            if low_y <= p.y <= high_y and low_z <= p.z <= high_z:
                offset = sub(p, nearest_on_triangle(p, a, b, c))
                marked[i] = dot(offset, offset) <= within * within
