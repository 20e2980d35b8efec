"""Temporal coherence of the broad phase: what answered in the last frame mostly still does.

An axis that separated blade and tissue, or a point of the blade that the tissue was near.
"""

import math

from bridge.arithmetic import Triple
from bridge.collision.swept_box import TOUCHING_MARGIN, SweptBox, largest_gap
from bridge.poses import Pose
from tissue import BladeShape

_N_STARTS = 9
"""Number of points along the edge of which the nearest is where the search begins."""

_N_PROJECTIONS = 4
"""Number of alternating projections from there."""

_Place = tuple[float, float, float]
"""A place on a blade: along the edge from the tip, forward, and across its flat [m]."""

_MOST_SIDES = math.sqrt(3.0)
"""Largest sum of the cosines between an axis and the three axes of a box."""


class SeparatingAxis:
    """Answers whether an axis still separates a blade from the box around the tissue.

    Where the projections of two bodies onto one line are apart, the bodies are. To project them
    takes a tenth of the time of a query to the collision library; and as long as both cannot have
    moved as far as the gap that was found between them, they are not projected either.

    Args:
        shape: Shape of the blade behind the edge; None for the edge alone.
    """

    def __init__(self, shape: BladeShape | None) -> None:
        self._height = 0.0 if shape is None else shape.height
        self._half_thickness = 0.0 if shape is None else 0.5 * shape.thickness
        self._reach = math.hypot(self._height, self._half_thickness)
        self.axis: tuple[float, float, float] | None = None
        """Axis that separated blade and tissue in the last query, towards the tissue; or None."""
        self._gap = 0.0
        self._gap_at: Pose | None = None

    def find(self, blade: SweptBox, tissue: SweptBox) -> None:
        """Find the axis on which the gap between two boxes is largest; it points to the tissue."""
        gap, axis = largest_gap(blade, tissue)
        x, y, z = axis.tolist()
        self.axis = (x, y, z) if gap > 0.0 else None
        self._gap_at = None

    def forget(self) -> None:
        """Forget the axis: blade and tissue are no longer apart."""
        self.axis = None

    def tissue_moved(self, distance: float) -> None:
        """Narrow the gap: no side of the box around the tissue has moved farther than this [m]."""
        self._gap -= distance

    def separates(
        self, before: Pose, after: Pose, bounds: tuple[Triple, Triple], travel: float
    ) -> bool:
        """Return whether the axis separates the box around a sweep from that around the tissue.

        Args:
            before: Pose of the blade at the start of the sweep.
            after: Pose of the blade at its end.
            bounds: Lowest and highest corner of the tissue at the start [m].
            travel: Distance that the tissue can travel beyond them meanwhile [m].
        """
        if self.axis is None:
            return False
        motion = max(math.dist(before.tip, after.tip), math.dist(before.heel, after.heel))
        turning = math.dist(before.axes, after.axes)
        # The box has the axes of the blade after the sweep, and reaches that far beyond it.
        sides = motion + travel + 2.0 * TOUCHING_MARGIN + self._reach * min(turning, 1.0)
        if before is self._gap_at:
            self._gap -= motion + self._reach * turning
            self._gap_at = after
            if self._gap > _MOST_SIDES * sides:
                return True
        forward, along, across, gap = self._projected(self.axis, after, bounds)
        self._gap, self._gap_at = gap, after
        return sides * (abs(forward) + abs(along) + abs(across)) < gap

    def _projected(
        self, axis: tuple[float, float, float], blade: Pose, bounds: tuple[Triple, Triple]
    ) -> tuple[float, float, float, float]:
        """Return the cosines of the blade's axes with the axis, and the gap on it [m]."""
        x, y, z = axis
        ex, ey, ez, fx, fy, fz, nx, ny, nz = blade.axes
        along, forward = x * ex + y * ey + z * ez, x * fx + y * fy + z * fz
        across = x * nx + y * ny + z * nz
        (tx, ty, tz), (hx, hy, hz) = blade.tip, blade.heel
        nearest = max(x * tx + y * ty + z * tz, x * hx + y * hy + z * hz)
        nearest += max(0.0, -self._height * forward) + self._half_thickness * abs(across)
        (lx, ly, lz), (ux, uy, uz) = bounds
        tissue = min(x * lx, x * ux) + min(y * ly, y * uy) + min(z * lz, z * uz)
        tissue -= TOUCHING_MARGIN * (abs(x) + abs(y) + abs(z))
        return forward, along, across, tissue - nearest


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
