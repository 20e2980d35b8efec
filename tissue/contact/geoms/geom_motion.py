"""Where rigid geoms are at an instant of a time step, and how fast a point of one moves.

In a time step a geom moves at an even speed and turns about an even axis at an even rate.
"""

import math
from typing import Final

from tissue.contact.geoms.geom import PLANE
from tissue.contact.geoms.geom_arrays import Geoms
from tissue.core.array_types import FloatArray
from tissue.core.jit import inlined, kernel
from tissue.core.vec3 import Vec3, add, axpy, cross, dot, norm, scale, store, sub, vec3
from tissue.geometry.rotations import ROTATION_TOLERANCE


@kernel
def place_geoms(geoms: Geoms, when: float) -> None:
    """Write where all geoms are at a fraction of the time step."""
    for g in range(len(geoms.shape)):
        store(geoms.origin, g, axpy(when, vec3(geoms.way, g), vec3(geoms.origin_t0, g)))
        turn = scale(when, vec3(geoms.turn, g))
        angle = norm(turn)
        for k in range(3):
            column = _column(geoms.axes_t0, g, k)
            if angle > 0.0:
                column = _turned(column, scale(1.0 / angle, turn), angle)
            geoms.axes[g, k] = column.x
            geoms.axes[g, 3 + k] = column.y
            geoms.axes[g, 6 + k] = column.z


TAKEN: Final = 0
ORIGIN_NOT_FINITE: Final = 1
NO_ROTATION: Final = 2
TURNS_TOO_FAR: Final = 3
MOVES_TOO_FAR: Final = 4
"""What `lead_geoms` found."""


@kernel
def lead_geoms(
    geoms: Geoms, origins: FloatArray, axes: FloatArray, largest_turn: float, farthest: float
) -> tuple[int, int]:
    """Let all geoms go to where they are to be at the end of the next time step.

    Args:
        geoms: `way` and `turn` are written, where all is well.
        origins: Their origins then [m], shape (n, 3).
        axes: Their axes then, as rows of numbers, shape (n, 9).
        largest_turn: Angle by which one may turn [rad].
        farthest: How far a point of one may move, per half its thickness.

    Returns:
        TAKEN or what is wrong, and with which geom.
    """
    for g in range(len(geoms.shape)):
        columns = _column(axes, g, 0), _column(axes, g, 1), _column(axes, g, 2)
        sums = origins[g, 0] + origins[g, 1] + origins[g, 2]
        if not math.isfinite(sums):
            return ORIGIN_NOT_FINITE, g
        for i in range(3):
            for j in range(3):
                product = dot(columns[i], columns[j]) - (1.0 if i == j else 0.0)
                if not abs(product) <= ROTATION_TOLERANCE:
                    return NO_ROTATION, g
        if dot(cross(columns[0], columns[1]), columns[2]) < 0.0:
            return NO_ROTATION, g
        turn = _rotation_vector(geoms.axes_t0, axes, g)
        if norm(turn) > largest_turn:
            return TURNS_TOO_FAR, g
        store(geoms.turn, g, turn)
        store(geoms.way, g, sub(vec3(origins, g), vec3(geoms.origin_t0, g)))
        if way_of(geoms, g) > farthest * geoms.half_thickness[g]:
            return MOVES_TOO_FAR, g
    return TAKEN, 0


@kernel
def _rotation_vector(before: FloatArray, after: FloatArray, g: int) -> Vec3:
    """Return axis times angle of the rotation from one set of axes to another [rad].

    A turn by pi has no direction: its axis is then any one.
    """
    skew, trace = Vec3(0.0, 0.0, 0.0), 0.0
    for k in range(3):
        a, b = _column(before, g, k), _column(after, g, k)
        skew = axpy(0.5, cross(a, b), skew)
        trace += dot(a, b)
    sine, cosine = norm(skew), 0.5 * (trace - 1.0)
    angle = math.atan2(sine, cosine)
    if sine == 0.0:
        return Vec3(angle, 0.0, 0.0)
    return scale(angle / sine, skew)


@inlined
def _column(axes: FloatArray, g: int, k: int) -> Vec3:
    """Return axis `k` of geom `g`."""
    return Vec3(axes[g, k], axes[g, 3 + k], axes[g, 6 + k])


@inlined
def _turned(a: Vec3, axis: Vec3, angle: float) -> Vec3:
    """Return a vector turned about a unit axis: Rodrigues' formula."""
    c, s = math.cos(angle), math.sin(angle)
    return add(axpy(s, cross(axis, a), scale(c, a)), scale((1.0 - c) * dot(axis, a), axis))


@inlined
def to_geom(geoms: Geoms, g: int, x: Vec3) -> Vec3:
    """Return a point in the frame of geom `g`."""
    return turned_to_geom(geoms.axes, g, sub(x, vec3(geoms.origin, g)))


@inlined
def turned_to_geom(axes: FloatArray, g: int, a: Vec3) -> Vec3:
    """Return a vector in the frame of geom `g`."""
    return Vec3(
        axes[g, 0] * a.x + axes[g, 3] * a.y + axes[g, 6] * a.z,
        axes[g, 1] * a.x + axes[g, 4] * a.y + axes[g, 7] * a.z,
        axes[g, 2] * a.x + axes[g, 5] * a.y + axes[g, 8] * a.z,
    )


@inlined
def turned_from_geom(axes: FloatArray, g: int, a: Vec3) -> Vec3:
    """Return a vector of the frame of geom `g` in that of the tissue."""
    return Vec3(
        axes[g, 0] * a.x + axes[g, 1] * a.y + axes[g, 2] * a.z,
        axes[g, 3] * a.x + axes[g, 4] * a.y + axes[g, 5] * a.z,
        axes[g, 6] * a.x + axes[g, 7] * a.y + axes[g, 8] * a.z,
    )


@inlined
def geom_motion_at(geoms: Geoms, g: int, x: Vec3) -> Vec3:
    """Return how far geom `g` would move in a whole time step where point `x` is now [m]."""
    return add(vec3(geoms.way, g), cross(vec3(geoms.turn, g), sub(x, vec3(geoms.origin, g))))


@kernel
def way_of(geoms: Geoms, g: int) -> float:
    """Return how far a point of geom `g` moves in the time step at most [m]."""
    turn, way = norm(vec3(geoms.turn, g)), norm(vec3(geoms.way, g))
    if turn == 0.0 or geoms.shape[g] == PLANE:
        return float(way)
    return float(way + turn * (norm(vec3(geoms.middle, g)) + norm(vec3(geoms.half, g))))


@kernel
def largest_way(geoms: Geoms) -> float:
    """Return how far a point of a geom moves in the time step at most, per half its thickness."""
    largest = 0.0
    for g in range(len(geoms.shape)):
        largest = max(largest, way_of(geoms, g) / geoms.half_thickness[g])
    return largest
