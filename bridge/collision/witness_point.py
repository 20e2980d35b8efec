"""A point of the blade that tissue is near, which mostly stays near it."""

import math

from bridge.arithmetic import Triple
from bridge.poses import Pose
from tissue import BladeShape

_N_STARTS = 9
"""Number of points along the edge of which the nearest is where the search begins."""

_N_PROJECTIONS = 4
"""Number of alternating projections from there."""


_Place = tuple[float, float, float]
"""A place on a blade: along the edge from the tip, forward, and across its flat [m]."""


class WitnessPoint:
    """Answers whether a point of the blade is within a distance of a box along the blade's axes.

    The box around the sweep of the blade reaches that distance beyond each of its points. So where
    one point is so near, the collision library would find that both boxes overlap, in ten times the
    time.

    Args:
        shape: Shape of the blade behind the edge; None for the edge alone.
    """

    def __init__(self, shape: BladeShape | None) -> None:
        self._height = 0.0 if shape is None else shape.height
        self._half_thickness = 0.0 if shape is None else 0.5 * shape.thickness
        self._place: _Place | None = None

    def find(self, blade: Pose, low: Triple, high: Triple) -> None:
        """Find a point of the blade near a box.

        Args:
            blade: Pose of the blade.
            low: Lowest corner of the box [m].
            high: Highest corner of the box [m].
        """
        ex, ey, ez, fx, fy, fz, nx, ny, nz = blade.axes
        tx, ty, tz = blade.tip
        hx, hy, hz = blade.heel
        length = ex * (hx - tx) + ey * (hy - ty) + ez * (hz - tz)
        place, least = (0.0, 0.0, 0.0), math.inf
        for i in range(_N_STARTS):
            there = (i / (_N_STARTS - 1) * length, 0.0, 0.0)
            position = _position(there, blade)
            distance = math.dist(position, _nearest(position, low, high))
            if distance < least:
                place, least = there, distance
        for _ in range(_N_PROJECTIONS):
            x, y, z = _nearest(_position(place, blade), low, high)
            x, y, z = x - tx, y - ty, z - tz
            place = (
                _clamped(x * ex + y * ey + z * ez, 0.0, length),
                _clamped(x * fx + y * fy + z * fz, -self._height, 0.0),
                _clamped(x * nx + y * ny + z * nz, -self._half_thickness, self._half_thickness),
            )
        self._place = place

    def is_within(self, distance: float, blade: Pose, low: Triple, high: Triple) -> bool:
        """Return whether the point is known to be so near a box.

        Args:
            distance: The distance [m].
            blade: Pose of the blade now.
            low: Lowest corner of the box [m].
            high: Highest corner of the box [m].
        """
        if self._place is None:
            return False
        x, y, z = _position(self._place, blade)
        (lx, ly, lz), (ux, uy, uz) = low, high
        dx, dy, dz = min(max(x, lx), ux) - x, min(max(y, ly), uy) - y, min(max(z, lz), uz) - z
        ex, ey, ez, fx, fy, fz, nx, ny, nz = blade.axes
        return (
            abs(dx * ex + dy * ey + dz * ez) < distance
            and abs(dx * fx + dy * fy + dz * fz) < distance
            and abs(dx * nx + dy * ny + dz * nz) < distance
        )


def _position(place: _Place, blade: Pose) -> Triple:
    """Return where a place on a blade is [m]."""
    along, forward, across = place
    ex, ey, ez, fx, fy, fz, nx, ny, nz = blade.axes
    x, y, z = blade.tip
    return (
        x + along * ex + forward * fx + across * nx,
        y + along * ey + forward * fy + across * ny,
        z + along * ez + forward * fz + across * nz,
    )


def _nearest(position: Triple, low: Triple, high: Triple) -> Triple:
    """Return the point of a box that is nearest to a position [m]."""
    return tuple(map(_clamped, position, low, high))


def _clamped(value: float, low: float, high: float) -> float:
    return min(max(value, low), high)
