"""The path of a blade as a table, and the pose on it at one instant."""

from scalpel_sim.quaternions import Vector, matrix_of, turned_on
from tissue import FloatArray
from tissue.support import kernel


@kernel
def pose_on_path(t: float, path: FloatArray) -> tuple[Vector, Vector, Vector]:
    """Return tip [m], heel [m] and forward direction at time `t` [s].

    Args:
        t: The blade rests before the start and after the end.
        path: Table of the ways between poses: see `Stroke.path`.
    """
    t = min(max(t, 0.0), path[-1, 1])
    way = path[_way_at(t, path)]
    s = (t - way[0]) / (way[1] - way[0])
    half = way[2]
    start = (way[3], way[4], way[5], way[6])
    axes = matrix_of(turned_on(start, (way[7], way[8], way[9]), s))
    _, ex, fx, _, ey, fy, _, ez, fz = axes
    ex, ey, ez = half * ex, half * ey, half * ez
    x, y, z = way[10] + s * way[13], way[11] + s * way[14], way[12] + s * way[15]
    return (x + ex, y + ey, z + ez), (x - ex, y - ey, z - ez), (-fx, -fy, -fz)


@kernel
def _way_at(t: float, path: FloatArray) -> int:
    """Return the last row that has begun at time `t` [s]."""
    first, last = 0, len(path) - 1
    while first < last:
        middle = (first + last + 1) // 2
        if path[middle, 0] <= t:
            first = middle
        else:
            last = middle - 1
    return first
