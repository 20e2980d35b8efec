"""Where to put the arm and the tissue so that the arm reaches a whole stroke."""

import math
from functools import cache
from typing import NamedTuple

import numpy as np

from scalpel_sim.arm.arm import ARMS, Arm
from scalpel_sim.arm.hand import Impedance
from scalpel_sim.arm.inverse_kinematics import Geometry, geometry, reach
from scalpel_sim.errors import UsageError, unknown
from scalpel_sim.strokes.stroke import Stroke
from scalpel_sim.tables.stroke import DRAWN_STROKES
from tissue import FloatArray

AUTO = "auto"
"""Chooses the smallest arm that reaches, and renders the force if one does."""

SAMPLES = 9
"""Number of poses along the stroke that the search uses. A planned stroke bends by less than its
own sagitta between them; `DENSE_SAMPLES` confirm the place that was found."""

DENSE_SAMPLES = 65
"""Number of poses along the stroke at which the chosen place is confirmed."""

YAWS = np.arange(24) * (2.0 * math.pi / 24)
"""Directions from the base to the stroke that the search tries [rad]."""

DISTANCES, HEIGHTS = np.linspace(0.25, 1.0, 11), np.linspace(-0.7, 0.7, 13)
"""Distances of the middle of the stroke from the axis of the waist, and heights over the shoulder,
that the search tries, as fractions of the length of the stretched arm."""

MOUNT_ANGLES = (0.0, math.pi / 4.0, math.pi / 2.0)
"""Angles between stylus and blade that the search tries [rad]: scalpel handles are straight or
bent. No one angle suits both a blade that stands and one that lies."""

NEEDED_MARGIN = 0.04
"""How far from the ends of their ranges the joints must stay, as a fraction of half the range. The
hand yields, and a joint that meets its stop would push back."""

BASE_RADIUS = 0.08
"""Radius about the axis of the waist in which the body must not lie [m]."""

LINK_CLEARANCE = 0.01
"""Smallest distance of the axes of upper arm and forearm from the box around the body [m]."""

TABLE_CLEARANCE = 0.01
"""Distance of the table from the lowest point of blade and body [m]: the blade passes beneath the
body."""

AWKWARD = 2.0
"""Subtracted from the margin of a place where a link passes through the body, or where the base
stands on a column: any place without that is better."""

SMALLEST_SCALE, SCALE_HALVINGS = 1e-3, 7
"""Where an error message looks for the scale at which the arm would reach: from this up to 1, to
6 %. A mesh in millimetres that is read as metres is a thousand times too large."""


class PlacementError(UsageError):
    """No arm that was asked for reaches the stroke."""


class Placement(NamedTuple):
    """Where arm and tissue stand. World frame; its axes are the tissue's, the table is z = 0."""

    preset: str
    """One of `arm.ARMS`."""
    blade_length: float
    """From heel to tip [m]."""
    mount_angle: float
    """Between stylus and blade [rad]."""
    base_position: FloatArray
    """Middle of the base's underside [m], shape (3,)."""
    base_yaw: float
    """Angle by which the base is turned about +z [rad]."""
    tissue_origin: FloatArray
    """Origin of the tissue frame, which is not turned [m], shape (3,)."""
    qpos: FloatArray
    """Angles of the joints at the start of the stroke [rad], shape (6,)."""
    margin: float
    """Smallest distance of a joint from an end of its range along the stroke, as a fraction of half
    the range."""

    def arm(self, impedance: Impedance = Impedance()) -> Arm:
        """Return an arm that stands there, with its blade at the start of the stroke."""
        arm = Arm(
            self.preset,
            blade_length=self.blade_length,
            mount_angle=self.mount_angle,
            base_position=self.base_position,
            base_yaw=self.base_yaw,
            impedance=impedance,
        )
        arm.reset(self.qpos)
        return arm


def place(
    stroke: Stroke, bounds: FloatArray, preset: str = AUTO, *, force: float = 0.0
) -> Placement:
    """Return the place from which an arm reaches the stroke with the most room in its joints.

    Args:
        stroke: In the tissue frame.
        bounds: Lowest and highest corner of the tissue, tissue frame [m], shape (2, 3). The base
            stands beside it, and it lies above the table.
        preset: One of `arm.ARMS`, or `auto`: the smallest that reaches, and renders the force.
        force: Expected force on the blade [N], toughness times the length of edge in the tissue. It
            only matters to `auto`; where no arm reaches and renders it, the largest that reaches is
            taken, and renders what it can.

    Raises:
        UsageError: no arm has this name.
        PlacementError: no arm reaches; the message says at which scale one would.
    """
    if preset != AUTO and preset not in ARMS:
        raise unknown("arm", preset, [*ARMS, AUTO])
    found = None
    for name in ARMS if preset == AUTO else (preset,):
        placement = _place(stroke, bounds, name)
        if placement.margin >= NEEDED_MARGIN:
            found = placement
            if ARMS[name].force >= force:
                break
    if found is None:  # `name` is the largest arm that was asked for
        raise PlacementError(_advice(stroke, bounds, name))
    return found


class _Path(NamedTuple):
    """Poses of the blade's body along a stroke, tissue frame."""

    positions: FloatArray
    """Origin of the blade's body [m], shape (n, 3)."""
    axes: FloatArray
    """Axes of the blade's body as columns, shape (n, 3, 3)."""
    lowest: float
    """Lowest height of the blade and of the tissue along the stroke [m]."""
    bounds: FloatArray
    """Lowest and highest corner of the tissue [m], shape (2, 3)."""


class _Places(NamedTuple):
    """Candidate places of the base, relative to the middle of the stroke; arrays of one shape."""

    yaws: FloatArray
    distances: FloatArray
    heights: FloatArray
    """Height of the middle of the stroke over the base's underside [m]."""


def _place(stroke: Stroke, bounds: FloatArray, preset: str) -> Placement:
    """Return the best place for one arm, whether or not it reaches."""
    measures, edge_height = _measured(preset)
    place, mount_angle, _ = _search(measures, _path(stroke, bounds, edge_height, SAMPLES))
    path = _path(stroke, bounds, edge_height, DENSE_SAMPLES)
    reached = reach(measures, *_in_base(path, place), mount_angle)
    base = _base(path, place)[0]
    table = min(base[2], path.lowest - TABLE_CLEARANCE)
    return Placement(
        preset,
        stroke.blade_length,
        mount_angle,
        base - [0.0, 0.0, table],
        float(place.yaws[0]),
        np.array([0.0, 0.0, -table]),
        reached.angles[0, 0],
        float(reached.margin.min()),
    )


def _search(measures: Geometry, path: _Path) -> tuple[_Places, float, float]:
    """Return the best of all places, the mount angle there, and the margin along the path."""
    length = measures.upper + measures.forearm + measures.neck
    grid = np.meshgrid(
        YAWS, DISTANCES * length, HEIGHTS * length + measures.shoulder, indexing="ij"
    )
    places = _Places(*(values.ravel() for values in grid))
    scores = np.stack([_scores(measures, path, places, angle) for angle in MOUNT_ANGLES])
    mount, best = np.unravel_index(int(np.argmax(scores)), scores.shape)
    place = _Places(*(values[best : best + 1] for values in places))
    reached = reach(measures, *_in_base(path, place), MOUNT_ANGLES[mount])
    return place, MOUNT_ANGLES[mount], float(reached.margin.min())


@cache
def _measured(preset: str) -> tuple[Geometry, float]:
    """Return an arm's geometry, and how far its edge lies from its blade's axis [m]."""
    model = Arm(preset).model
    return geometry(model), float(model.site("heel").pos[2])


def _path(stroke: Stroke, bounds: FloatArray, edge_height: float, samples: int) -> _Path:
    """Return where the blade's body is along the stroke; its edge is `edge_height` off its axis."""
    poses = stroke.poses(samples)
    heels = np.array([pose.heel for pose in poses])
    tips = np.array([pose.tip for pose in poses])
    edges = (tips - heels) / stroke.blade_length
    backs = -np.array([pose.forward for pose in poses])
    axes = np.stack([np.cross(edges, backs), edges, backs], axis=2)
    lowest = min(float(heels[:, 2].min()), float(tips[:, 2].min()), float(bounds[0][2]))
    return _Path(heels - edge_height * backs, axes, lowest, bounds)


def _scores(measures: Geometry, path: _Path, places: _Places, mount_angle: float) -> FloatArray:
    """Return how good each place is: the margin along the path, less `AWKWARD` where it applies."""
    positions, axes = _in_base(path, places)
    reached = reach(measures, positions, axes, mount_angle)
    base = _base(path, places)
    stands_beside = _distance_to_box(base[:, :2], path.bounds[:, :2]) >= BASE_RADIUS
    on_column = base[:, 2] > path.lowest - TABLE_CLEARANCE
    links = _links(measures, reached.angles)
    in_tissue = np.einsum("pij,pnkj->pnki", _turns(places.yaws), links) + base[:, None, None]
    through = _distance_to_box(in_tissue, path.bounds) < LINK_CLEARANCE
    score = reached.margin.min(axis=1) - AWKWARD * on_column - AWKWARD * through.any(axis=(1, 2))
    return np.asarray(np.where(stands_beside, score, -np.inf))


def _base(path: _Path, places: _Places) -> FloatArray:
    """Return where the base stands, tissue frame [m], shape (n_places, 3)."""
    outward = _turns(places.yaws)[:, :, 1]
    middle = (path.positions.min(axis=0) + path.positions.max(axis=0)) / 2.0
    beside = middle - places.distances[:, None] * outward
    return np.asarray(beside - np.multiply.outer(places.heights, [0.0, 0.0, 1.0]))


def _in_base(path: _Path, places: _Places) -> tuple[FloatArray, FloatArray]:
    """Return the path as each base sees it, shapes (n_places, n, 3) and (n_places, n, 3, 3)."""
    back = np.swapaxes(_turns(places.yaws), 1, 2)
    offset = path.positions[None] - _base(path, places)[:, None]
    return np.einsum("pij,pnj->pni", back, offset), back[:, None] @ path.axes[None]


def _turns(yaws: FloatArray) -> FloatArray:
    """Return rotations about z, shape (n, 3, 3)."""
    c, s, zero = np.cos(yaws), np.sin(yaws), np.zeros_like(yaws)
    return np.stack([c, -s, zero, s, c, zero, zero, zero, zero + 1.0], axis=1).reshape(-1, 3, 3)


def _links(measures: Geometry, angles: FloatArray) -> FloatArray:
    """Return points along upper arm and forearm in the frame of the base, shape (..., 8, 3)."""
    waist, shoulder = angles[..., 0, None], angles[..., 1, None]
    level = shoulder + angles[..., 2, None] - measures.bend
    upper = measures.upper * np.array([0.25, 0.5, 0.75, 1.0, 1.0, 1.0, 1.0, 1.0])
    forearm = measures.forearm * np.array([0.0, 0.0, 0.0, 0.0, 0.25, 0.5, 0.75, 1.0])
    out = upper * np.cos(shoulder) + forearm * np.cos(level)
    up = measures.shoulder + upper * np.sin(shoulder) + forearm * np.sin(level)
    return np.stack([-np.sin(waist) * out, np.cos(waist) * out, up], axis=-1)


def _distance_to_box(points: FloatArray, box: FloatArray) -> FloatArray:
    """Return how far points are from a box [m]; 0 inside."""
    outside = np.maximum(np.maximum(box[0] - points, points - box[1]), 0.0)
    return np.asarray(np.linalg.norm(outside, axis=-1))


def _advice(stroke: Stroke, bounds: FloatArray, preset: str) -> str:
    """Return the message that an arm does not reach, by how much, and what to do."""
    measures, edge_height = _measured(preset)
    path = _path(stroke, bounds, edge_height, SAMPLES)
    extent = 1e3 * np.ptp(path.positions, axis=0)
    message = (
        f"the {preset} arm does not reach the whole stroke '{stroke.name}': a blade of "
        f"{1e3 * stroke.blade_length:.0f} mm over "
        f"{extent[0]:.0f} x {extent[1]:.0f} x {extent[2]:.0f} mm (x, y, z)"
    )
    larger = list(ARMS)[list(ARMS).index(preset) + 1 :]
    other = f", or choose --arm {larger[0]}" if larger else ""
    is_drawn = not DRAWN_STROKES.keys().isdisjoint(stroke.name.split(", "))
    # A stroke that is given in metres does not shrink with the body.
    remedy = f"{'draw the stroke' if is_drawn else 'make --scale'} smaller{other}"
    low, high = math.log(SMALLEST_SCALE), 0.0
    if not _reaches(measures, _scaled(path, SMALLEST_SCALE)):
        return f"{message}. Move the stroke, or {remedy}"
    for _ in range(SCALE_HALVINGS):
        middle = (low + high) / 2.0
        if _reaches(measures, _scaled(path, math.exp(middle))):
            low = middle
        else:
            high = middle
    return f"{message}. It would at {math.exp(low):.2g} times the size: {remedy}"


def _reaches(measures: Geometry, path: _Path) -> bool:
    """Whether there is a place from which the arm reaches the path."""
    return _search(measures, path)[2] >= NEEDED_MARGIN


def _scaled(path: _Path, scale: float) -> _Path:
    """Return the path and the body, shrunk towards the middle of the body."""
    middle = (path.bounds[0] + path.bounds[1]) / 2.0
    return _Path(
        middle + scale * (path.positions - middle),
        path.axes,
        float(middle[2] + scale * (path.lowest - middle[2])),
        middle + scale * (path.bounds - middle),
    )
