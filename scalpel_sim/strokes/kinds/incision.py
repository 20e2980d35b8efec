"""An incision: the tip goes into the upper side of a body, is drawn along it, and is lifted out.

                     heel
                   /   35 degrees to the surface; the edge faces forward and down
__________________/______________ surface
                /      -> drawn
 .......... tip                   depth
"""

import math

import numpy as np

from scalpel_sim.strokes.csv_lines import StrokeError
from scalpel_sim.strokes.kind import LyingBody, StrokeTable, stroke_kind
from scalpel_sim.strokes.stroke import Stroke
from scalpel_sim.strokes.timing import timed
from tissue import BladeSegment, FloatArray, Material, TetrahedralMesh, boundary_faces

DEPTH, DEPTH_SHARE = 8e-3, 0.3
"""Depth of an incision that is planned by itself: [m], or a share of the body's height where that
is less. A surgeon's first cut into a liver is as deep."""

SLOPE = math.radians(35.0)
"""Angle between the edge and the surface [rad], the heel before the tip: how a scalpel is held like
a pen."""

INSERTED_AT, WITHDRAWN_AT = 0.2, 0.73
"""Where the tip goes in and out, as shares of the body's length, where nothing is said of it: 48 mm
of the organ."""

DRAG_SHARE = 0.15
"""Distance by which the tip is drawn on beyond that, as a share of toughness / Young's modulus,
because the edge runs ahead of the material that it cuts. Without it the incision in liver, on its
underside, came out 5 mm short, of 35 mm."""

WITHDRAWN_LATEST = 0.85
"""Distance to which the drag may draw the tip, as a share of the body's length from the side where
it comes from."""

LEAST_LENGTH = 0.05
"""Least length of an incision, as a share of the body's: shorter, it is a stab."""

_GAP = 4e-3
"""Height above the surface at which the tip starts, and ends [m]."""

_REACH = 3.0
"""Height of the heel over the tip, in depths: tissue ahead of the edge rises."""

_POINTS = 61
"""Points along the incision at which the height of the surface is looked up."""

_ROUNDING = 1e-9
"""Weight by which a point may miss a face and still be on it: places on edges between faces."""

_DEGREE = 4
"""Degree of the polynomial that the tip follows beneath the surface: the faces of a mesh would make
it jerk."""


@stroke_kind(
    "the tip goes in from above, is drawn along the body, and is lifted out",
    possible=("speed", "depth", "along"),
    is_planned=True,
)
def incision(row: StrokeTable, body: LyingBody) -> Stroke:
    """Return an incision along the middle of a body's longer side, seen from above.

    The tip is drawn farther by as much as the edge runs ahead of the material that it cuts, for the
    cut to be as long as planned. Where `along` ends before it begins, the blade is drawn, and
    leans, backwards.

    Raises:
        StrokeError: the body's upper side has a gap there, or the tip goes in and out at one place.
    """
    mesh, depth = body.mesh, row.depth
    drag = drag_of(body.material)
    low, high = mesh.positions.min(axis=0), mesh.positions.max(axis=0)
    extent = high - low
    axis = 0 if extent[0] >= extent[1] else 1
    inserted_at, withdrawn_at = row.along or (INSERTED_AT, WITHDRAWN_AT)
    if abs(withdrawn_at - inserted_at) < LEAST_LENGTH:
        raise StrokeError(
            f"the incision goes in at {inserted_at:g} of the body's length, and out at "
            f"{withdrawn_at:g}; it must be at least {LEAST_LENGTH:g} long"
        )
    way = math.copysign(1.0, withdrawn_at - inserted_at)
    if depth is None:
        depth = usual_depth(mesh)
    ahead, up = way * np.eye(3)[axis], np.eye(3)[2]
    drawn_to = _drawn_to(withdrawn_at, way, drag / float(extent[axis]))
    at = low[axis] + np.linspace(inserted_at, drawn_to, _POINTS) * extent[axis]
    surface = _smooth(at, _surface(mesh, at, axis))
    below = np.outer(at, np.eye(3)[axis]) + np.outer(surface - depth, up)
    below[:, 1 - axis] = 0.5 * (low + high)[1 - axis]
    rise = (depth + _GAP) * up
    legs = [np.array([below[0] + rise, below[0]]), below, np.array([below[-1], below[-1] + rise])]
    times, tips = _followed(legs, row.tip_speed)
    edge = math.cos(SLOPE) * ahead + math.sin(SLOPE) * up
    forward = math.sin(SLOPE) * ahead - math.cos(SLOPE) * up
    length = _REACH * depth / math.sin(SLOPE)
    poses = [BladeSegment(tip, tip + length * edge, forward) for tip in tips]
    asked_end = low[axis] + withdrawn_at * extent[axis]
    asked_until = float(np.interp(way * asked_end, way * tips[:, axis], times))
    return Stroke(times, poses, row.kind, asked=[(0.0, asked_until)])


def drag_of(material: Material) -> float:
    """Return how far the edge runs ahead of the material that it cuts [m]."""
    return DRAG_SHARE * material.toughness / material.young_modulus


def usual_depth(mesh: TetrahedralMesh) -> float:
    """Return the depth of an incision into a body where none is given [m]."""
    return min(DEPTH, DEPTH_SHARE * float(np.ptp(mesh.positions[:, 2])))


def _drawn_to(withdrawn_at: float, way: float, drag: float) -> float:
    """Return where the tip goes out, as a share of the body's length.

    Args:
        withdrawn_at: Where it is planned to.
        way: 1 if it is drawn towards the far end of the body, -1 if towards the near one.
        drag: How far the edge runs ahead of the material, as a share of the body's length.
    """
    asked = withdrawn_at if way > 0.0 else 1.0 - withdrawn_at
    drawn = max(asked, min(asked + drag, WITHDRAWN_LATEST))
    return drawn if way > 0.0 else 1.0 - drawn


def _surface(mesh: TetrahedralMesh, at: FloatArray, axis: int) -> FloatArray:
    """Return the height of the body's upper side at places along an axis, across its middle [m].

    Raises:
        StrokeError: there is no body below or above one of them.
    """
    positions, across = mesh.positions, 1 - axis
    middle = 0.5 * (positions[:, across].min() + positions[:, across].max())
    corners = positions[boundary_faces(mesh.tetrahedra)]
    origin = corners[:, 0]
    sides = (corners[:, 1:] - origin[:, None])[:, :, [axis, across]]
    is_flat = np.abs(np.linalg.det(sides)) > 0.0  # a face that stands upright has no inside
    origin, sides, corners = origin[is_flat], sides[is_flat], corners[is_flat]
    points = np.stack([at, np.full(len(at), middle)], axis=1)
    offsets = points[:, None] - origin[:, [axis, across]]
    weights = np.einsum("pfi,fij->pfj", offsets, np.linalg.inv(sides))
    inside = (weights >= -_ROUNDING).all(axis=2) & (weights.sum(axis=2) <= 1.0 + _ROUNDING)
    rises = corners[:, 1:, 2] - origin[:, None, 2]
    heights = origin[:, 2] + np.einsum("pfj,fj->pf", weights, rises)
    highest = np.where(inside, heights, -np.inf).max(axis=1)
    if not np.isfinite(highest).all():
        raise StrokeError(
            "there is no body along the middle of its longer side, where an incision is drawn; "
            "choose another stroke, or give one as a CSV file"
        )
    return np.asarray(highest)


def _smooth(at: FloatArray, heights: FloatArray) -> FloatArray:
    """Return a polynomial through heights, at the same places [m]."""
    return np.asarray(np.polynomial.Polynomial.fit(at, heights, _DEGREE)(at))


def _followed(legs: list[FloatArray], speed: float) -> tuple[FloatArray, FloatArray]:
    """Return times [s] and positions [m] of a point that follows legs, at rest between them.

    Args:
        legs: Points of each leg [m], shape (n, 3), which begins where the one before it ends.
        speed: Speed between the ramps [m/s].
    """
    times, points = [np.zeros(1)], [legs[0][:1]]
    for leg in legs:
        along = np.append(0.0, np.linalg.norm(np.diff(leg, axis=0), axis=1).cumsum())
        when, done = timed(float(along[-1]), speed)
        times.append(times[-1][-1] + when[1:])
        points.append(np.stack([np.interp(done[1:], along, leg[:, k]) for k in range(3)], axis=1))
    return np.concatenate(times), np.concatenate(points)
