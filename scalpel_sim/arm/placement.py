"""Placement of arm and tissue, so that the arm reaches a whole stroke."""

import math
from collections.abc import Sequence
from functools import cache, partial
from typing import NamedTuple

import numpy as np

from scalpel_sim.arm.arm import ARMS, CHOSEN_BY_SIZE, PSM, Arm
from scalpel_sim.arm.firm_hand import firm_impedance
from scalpel_sim.arm.hand import Impedance
from scalpel_sim.arm.inverse_kinematics import TABLE_ROUNDING, geometry
from scalpel_sim.arm.kinematics import TABLE_CLEARANCE, InstrumentPath, Kinematics, Spheres
from scalpel_sim.arm.place_search import (
    Found,
    blade_path,
    in_base,
    search_place,
    spheres_along,
    turn_about_z,
)
from scalpel_sim.arm.psm_kinematics import (
    BASE_HEIGHT,
    LEAST_DEPTH,
    TROCAR_CLEARANCE,
    WRIST_LEVER,
    psm_geometry,
)
from scalpel_sim.arm.standing import Standing
from scalpel_sim.errors import UsageError, unknown
from scalpel_sim.strokes.kinds import STROKES
from scalpel_sim.strokes.stroke import Stroke
from tissue import FloatArray

AUTO = "auto"
"""Chooses the smallest arm that reaches, and renders the force if one does."""

SAMPLES = 9
"""Number of poses along the stroke that the search uses. A planned stroke bends by less than its
own sagitta between them; `DENSE_SAMPLES` confirm the place that was found."""

DENSE_SAMPLES = 65
"""Number of poses along the stroke at which the chosen place is confirmed."""

NEEDED_MARGIN = 0.04
"""Distance that joints must keep from the ends of their ranges, as a fraction of half the range.
The hand yields, and a joint that meets its stop would push back."""

SMALLEST_SCALE, SCALE_HALVINGS = 1e-3, 7
"""Where an error message looks for the scale at which the arm would reach: from this up to 1, to
6 %. A mesh in millimetres that is read as metres is a thousand times too large."""


Trocar = tuple[float, float, float]
"""Where a remote centre is to be, tissue frame [m]."""


class PlacementError(UsageError):
    """No arm that was requested reaches the stroke."""


class Neighbours(NamedTuple):
    """Bodies that an arm with a grasper stands next to, tissue frame."""

    boxes: FloatArray
    """Lowest and highest corners of what lies there [m], shape (2, 3) or (n, 2, 3): see `place`."""
    times: FloatArray
    """Instants at which the arm must reach, and be clear of the others [s]."""
    table: float | None = None
    """Height of the table on which it stands [m]; None: of its own."""
    others: Sequence[Spheres] = ()
    """Spheres that cover the arms that stand there, at these instants."""


class Placement(NamedTuple):
    """Where arm and tissue stand. World frame; its axes are the tissue's, the table is z = 0."""

    preset: str
    """One of `arm.ARMS`."""
    blade_length: float
    """From heel to tip [m]."""
    mount_angle: float
    """Between stylus and blade [rad]."""
    base_position: FloatArray
    """Middle of the base's underside, or the remote centre [m], shape (3,)."""
    base_yaw: float
    """Angle by which the base is turned about +z [rad]."""
    tissue_origin: FloatArray
    """Origin of the tissue frame, which is not turned [m], shape (3,)."""
    qpos: FloatArray
    """Positions of the joints at the start of the stroke [rad, m], shape (n_joints,)."""
    margin: float
    """Smallest distance of a joint from an end of its range along the stroke, as a fraction of half
    the range."""
    edge_height: float
    """Distance of the edge from the axis of the instrument [m]; 0 for a grasper."""

    def arm(self, others: Sequence[Standing] = ()) -> Arm:
        """Return an arm that stands there, with its blade at the start of the stroke.

        Args:
            others: What else stands in its world: arms, each with a grasper, a table, fixtures.
        """
        alike = partial(
            Arm,
            self.preset,
            blade_length=self.blade_length,
            mount_angle=self.mount_angle,
            base_position=self.base_position,
            base_yaw=self.base_yaw,
        )
        impedance = Impedance()
        if self.preset == PSM:
            alone = alike()
            alone.reset(self.qpos)
            impedance = firm_impedance(alone, lever=WRIST_LEVER)
        arm = alike(impedance=impedance, others=others)
        arm.reset(self.qpos)
        return arm


def place(
    stroke: Stroke,
    boxes: FloatArray,
    preset: str = AUTO,
    *,
    force: float = 0.0,
    trocar: Trocar | None = None,
) -> Placement:
    """Return the place from which an arm reaches the stroke with the most room in its joints.

    Args:
        stroke: In the tissue frame.
        boxes: Lowest and highest corners of what lies there, tissue frame [m], shape (2, 3) or
            (n, 2, 3): of the tissue, and of the board under it. The base stands next to them, and
            they lie above the table that it stands on.
        preset: One of `arm.ARMS`, or `auto`: the smallest that reaches, and renders the force.
        force: Expected force on the blade [N], toughness times the length of edge in the tissue. It
            only matters to `auto`; where no arm reaches and renders it, the largest that reaches is
            taken, and renders what it can.
        trocar: Where the remote centre of a `psm` is, tissue frame [m]; None: where it reaches
            best.

    Raises:
        UsageError: no arm has this name.
        PlacementError: no arm reaches; the message says at which scale one would.
    """
    found = place_if_reached(stroke, boxes, preset, force=force, trocar=trocar)
    if found is None:
        largest = CHOSEN_BY_SIZE[-1] if preset == AUTO else preset
        raise PlacementError(_advice(stroke, boxes, largest, trocar))
    return found


def place_if_reached(
    stroke: Stroke, boxes: FloatArray, preset: str, *, force: float, trocar: Trocar | None = None
) -> Placement | None:
    """Return the place as `place` does, but None where no arm reaches: what would help takes long.

    Args:
        stroke: See `place`, as the rest.
        boxes: What lies there [m].
        preset: The arm.
        force: Expected force on the blade [N].
        trocar: Where a remote centre is [m].

    Raises:
        UsageError: no arm has this name.
    """
    found = None
    for name in _arms_to_try(preset):
        placement = _place(stroke, boxes, name, trocar)
        if placement.margin >= NEEDED_MARGIN:
            found = placement
            if ARMS[name].force >= force:
                break
    return found


def covered(placement: Placement, stroke: Stroke, boxes: FloatArray, times: FloatArray) -> Spheres:
    """Return spheres that cover an arm, up to its instrument, along a stroke.

    Args:
        placement: Where it stands.
        stroke: Its stroke, tissue frame.
        boxes: Lowest and highest corners of what lies there [m], shape (2, 3) or (n, 2, 3).
        times: Instants [s].
    """
    measures, _ = _measured(placement.preset)
    path = blade_path(stroke, boxes, placement.edge_height, times)
    base = placement.base_position - placement.tissue_origin
    return spheres_along(measures, path, base, placement.base_yaw, placement.mount_angle)


def stays_in_reach(placement: Placement, stroke: Stroke, boxes: FloatArray) -> bool:
    """Return whether an arm that stands somewhere reaches a stroke, with enough room in its joints.

    Args:
        placement: Where it stands.
        stroke: Tissue frame.
        boxes: See `place`.
    """
    measures, _ = _measured(placement.preset)
    times = np.linspace(0.0, stroke.duration, DENSE_SAMPLES)
    path = blade_path(stroke, boxes, placement.edge_height, times)
    turn = turn_about_z(placement.base_yaw)
    positions = (path.positions - (placement.base_position - placement.tissue_origin)) @ turn
    reached = measures.reach(positions, turn.T @ path.axes, placement.mount_angle)
    return bool(reached.margin.min() >= NEEDED_MARGIN)


def place_beside(
    stroke: Stroke,
    preset: str,
    beside: Neighbours,
    *,
    at_start: bool = False,
    trocar: Trocar | None = None,
) -> Placement:
    """Return the place from which an arm that holds a grasper reaches, clear of other arms.

    Args:
        stroke: The motion of the grasper, as that of an edge from where the arm holds it to the end
            of its pads; tissue frame.
        preset: One of `arm.ARMS`, or `auto`: the smallest that reaches.
        beside: What it stands next to.
        at_start: Whether the arms are to be clear of each other at the first instant alone.
        trocar: Where the remote centre of a `psm` is, tissue frame [m]; None: where it reaches
            best.

    Raises:
        UsageError: no arm has this name.
        PlacementError: no arm reaches.
    """
    for name in _arms_to_try(preset):
        measures, _ = _measured(name, trocar)
        path = blade_path(stroke, beside.boxes, 0.0, beside.times)._replace(table=beside.table)
        found = search_place(measures, path, beside.others, at_start=at_start)
        placement = _placed(found, measures, name, path)
        if placement.margin >= NEEDED_MARGIN and math.isfinite(found.score):
            return placement
    if at_start:
        raise PlacementError(
            f"the {name} arm does not reach around the start of its grasper from any place that is "
            "clear of the other arm; turn its approach"
        )
    if search_place(measures, path).margin >= NEEDED_MARGIN:
        raise PlacementError(
            f"the {name} arm reaches the {stroke.name}, but not clear of the other arm; turn its "
            "approach, or have one come when the other has gone"
        )
    extent = 1e3 * np.ptp(path.positions, axis=0)
    raise PlacementError(
        f"the {name} arm does not reach the whole {stroke.name}, over {extent[0]:.0f} x "
        f"{extent[1]:.0f} x {extent[2]:.0f} mm (x, y, z), from any place next to the tissue. Turn "
        "its approach, or move it closer together"
    )


def _arms_to_try(preset: str) -> Sequence[str]:
    """Return the arms that a preset stands for, smallest first.

    Raises:
        UsageError: no arm has this name.
    """
    if preset != AUTO and preset not in ARMS:
        raise unknown("arm", preset, [*ARMS, AUTO])
    return CHOSEN_BY_SIZE if preset == AUTO else [preset]


def _place(stroke: Stroke, boxes: FloatArray, preset: str, trocar: Trocar | None) -> Placement:
    """Return the best place for one arm, whether or not it reaches."""
    measures, edge_height = _measured(preset, trocar)
    few, many = (np.linspace(0.0, stroke.duration, n) for n in (SAMPLES, DENSE_SAMPLES))
    found = search_place(measures, blade_path(stroke, boxes, edge_height, few))
    placement = _placed(found, measures, preset, blade_path(stroke, boxes, edge_height, many))
    return placement._replace(blade_length=stroke.blade_length, edge_height=edge_height)


def _placed(found: Found, measures: Kinematics, preset: str, path: InstrumentPath) -> Placement:
    """Return the place that was found, confirmed on a path."""
    reached = measures.reach(*in_base(path, found.place), found.mount_angle)
    base = found.place.bases[0]
    table = path.lowest - TABLE_CLEARANCE if path.table is None else path.table
    if path.table is None and measures.stands_on_table:
        table = min(base[2], table)
    height = base[2] - table
    return Placement(
        preset,
        0.0,
        found.mount_angle,
        np.array([base[0], base[1], height if height > TABLE_ROUNDING else 0.0]),
        float(found.place.yaws[0]),
        np.array([0.0, 0.0, -table]),
        reached.angles[0, 0],
        float(reached.margin.min()),
        edge_height=0.0,
    )


@cache
def _measured(preset: str, trocar: Trocar | None = None) -> tuple[Kinematics, float]:
    """Return an arm's geometry, and how far its edge lies from its blade's axis [m]."""
    model = Arm(preset).model
    edge_height = float(model.site("heel").pos[2])
    if preset == PSM:
        return psm_geometry(model)._replace(trocar=trocar), edge_height
    return geometry(model), edge_height


def _advice(stroke: Stroke, boxes: FloatArray, preset: str, trocar: Trocar | None) -> str:
    """Return the message that an arm does not reach, by how much, and what to do."""
    measures, edge_height = _measured(preset, trocar)
    path = blade_path(stroke, boxes, edge_height, np.linspace(0.0, stroke.duration, SAMPLES))
    extent = 1e3 * np.ptp(path.positions, axis=0)
    message = (
        f"the {preset} arm does not reach the whole stroke '{stroke.name}': a blade of "
        f"{1e3 * stroke.blade_length:.0f} mm over "
        f"{extent[0]:.0f} x {extent[1]:.0f} x {extent[2]:.0f} mm (x, y, z)"
    )
    if trocar is not None:
        return (
            f"{message}, through a trocar at {list(trocar)}. Move the trocar: at least "
            f"{1e3 * TROCAR_CLEARANCE:.0f} mm off the body, {1e3 * BASE_HEIGHT:.0f} mm above its "
            f"table, and {1e3 * LEAST_DEPTH:.0f} to 220 mm from the heel of the blade; or omit it"
        )
    larger = CHOSEN_BY_SIZE[list(ARMS).index(preset) + 1 :]
    other = f", or choose --arm {larger[0]}" if larger else ""
    kinds = [STROKES[name] for name in stroke.name.split(", ") if name in STROKES]
    is_drawn = any(not kind.is_planned for kind in kinds)
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


def _reaches(measures: Kinematics, path: InstrumentPath) -> bool:
    """Whether there is a place from which the arm reaches the path."""
    return search_place(measures, path).margin >= NEEDED_MARGIN


def _scaled(path: InstrumentPath, scale: float) -> InstrumentPath:
    """Return the path and what lies there, shrunk towards the middle of the body."""
    middle = path.boxes[0].mean(axis=0)
    return InstrumentPath(
        middle + scale * (path.positions - middle),
        path.axes,
        float(middle[2] + scale * (path.lowest - middle[2])),
        middle + scale * (path.boxes - middle),
    )
