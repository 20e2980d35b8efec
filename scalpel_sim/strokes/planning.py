"""Strokes that are planned for a body: through its middle, along its upper side, or against it."""

import logging
import math
from collections.abc import Iterator

import numpy as np

from scalpel_sim.errors import unknown
from scalpel_sim.scene.strokes import DEFAULT_SPEED, PLANNED_STROKES
from scalpel_sim.strokes.csv_lines import StrokeError
from scalpel_sim.strokes.expected_force import is_inside
from scalpel_sim.strokes.incision import DRAG_SHARE, INSERTED_AT, WITHDRAWN_AT, plan_incision
from scalpel_sim.strokes.planned_sheet import PlannedSheet, is_above, mesh_edges, section
from scalpel_sim.strokes.stroke import Stroke
from scalpel_sim.strokes.timing import SPEED_UP_TIME, timed
from tissue import FloatArray, IntArray, Material, TetrahedralMesh, boundary_faces

TILT = math.radians(25.0)
"""Angle by which the slanted sheet leans [rad], where the body is wide enough for it."""

RAKE = math.radians(15.0)
"""Angle by which the tip of the slanted blade trails its heel [rad]."""

SAGITTA = 0.11
"""Height of the curved sheet's bend, as a fraction of the section's length."""

WIDEST = 0.3
"""How far a sheet may stray from its middle towards the held sides, as a fraction of the body's
width. Beyond 0.4 it would come near what is held, and cut that off instead of the body in two."""

SHIFTS = (0.0, 0.04, -0.04, 0.08, -0.08, 0.12, -0.12, 0.16, -0.16, 0.2, -0.2)
"""How far from the middle a sheet may lie, as a fraction of the body's width: where a bent or
branched body falls into more than two parts at the middle, the nearest place is taken where it
does not."""

_HELD = 0.06
"""Fraction of the body's width at each end that a sheet must leave whole: the held sides are there
(5 % of the width on a body without flat sides)."""

ABOUT_EQUAL = 0.8
"""The blade lies level, and moves down, where the section is this much thinner than it is high."""

_BLADE_MARGIN, BLADE_MARGIN_SHARE = 5e-3, 0.3
"""Length of the blade beyond the section, at both ends: [m], plus a share of the section.
Tissue sags, stretches, and is dragged along; a blade that it slips off leaves a bridge."""

_GAP, GAP_SHARE = 5e-3, 0.1
"""How far before the body the blade starts: [m], plus a share of the section's length."""

OVERSHOOT, OVERSHOOT_SHARE = 15e-3, 0.4
"""How far beyond the body the stroke ends: [m], or a share of the section's length where that is
more, and in either case the body's displacement. The last of the tissue is dragged along before it
parts."""

LARGEST_DISPLACEMENT = 0.5
"""Largest displacement of a body before the blade, as a fraction of half its width: beyond that it
is stretched between its held sides like a string, which bending and shear do not cover."""

SLIP_SHARE = 0.3
"""Part of the body's displacement that may be along the edge: the sine of `RAKE`, and a reserve."""

STOP_SHARE, STOP_LATEST = 0.55, 0.9
"""Fraction of the section's length at which the stroke `stop` ends, and at which it ends at the
latest where the body is displaced first."""

PRESS_TOUGHNESS_SHARE = 0.5
"""A press goes as deep as half of what would cut: depth x Young's modulus is a force per length of
edge, of the size of the toughness where cutting begins."""

DEEPEST_PRESS = 0.1
"""Deepest press that is planned by itself, as a fraction of the section's length."""

PRESS_DWELL = 0.5
"""Time for which the blade rests at the end of a press [s]: the tissue comes to rest under it."""

_log = logging.getLogger("scalpel_sim")


def plan_stroke(
    name: str,
    mesh: TetrahedralMesh,
    *,
    speed: float = DEFAULT_SPEED,
    material: Material = Material(),
    depth: float | None = None,
    lowest: float = -math.inf,
    along: tuple[float, float] = (INSERTED_AT, WITHDRAWN_AT),
) -> Stroke:
    """Return the stroke of that name, placed through (or against) the middle of the body.

    Sheets part the body's left from its right (low x from high x). The edge lies along the shorter
    extent of the section, the motion along the other: down into a thin sheet that stands on edge,
    else from front to back with the tip down.

    Args:
        name: One of `PLANNED_STROKES`.
        mesh: The body as it lies before the stroke, tissue frame [m].
        speed: Speed of the blade between its ramps [m/s].
        material: What the body is made of: how far the blade displaces it, and how deep a press may
            go.
        depth: Depth of a press [m], None for half of what would cut; or of an incision, None for
            8 mm, or a share of a thin body.
        lowest: Height below which the edge is not led [m]: the upper side of a table or a floor
            that stops it. An incision does not come near it.
        along: Where an incision goes in and out, as shares of the body's length.

    Raises:
        UsageError: no stroke has this name.
        StrokeError: the speed or the depth is not a positive number, or the body has no section.
    """
    if name not in PLANNED_STROKES:
        raise unknown("stroke", name, PLANNED_STROKES)
    _check_positive("speed", speed, "m/s")
    if name == "incision":
        if depth is not None:
            _check_positive("depth", depth, "m")
        drag = DRAG_SHARE * material.toughness / material.young_modulus
        return plan_incision(mesh, speed=speed, depth=depth, drag=drag, along=along)
    edges = mesh_edges(mesh.tetrahedra)
    sheet = _sheet(name, mesh, edges)
    cut = section(mesh.positions, edges, sheet.height(mesh.positions))
    travels, depths = sheet.travel(cut), sheet.depth(cut)
    first, last = float(travels.min()), float(travels.max())
    length = last - first
    start = first - max(_GAP + GAP_SHARE * length, 0.5 * speed * SPEED_UP_TIME)
    thickness = float(np.ptp(depths))
    displacement = _displacement(float(np.ptp(mesh.positions[:, 0])), length, thickness, material)
    end = last + max(OVERSHOOT, OVERSHOOT_SHARE * length) + displacement
    if name == "stop":
        end = first + min(STOP_SHARE * length + displacement, STOP_LATEST * length)
    if name == "press":
        if depth is None:
            harmless = PRESS_TOUGHNESS_SHARE * material.toughness / material.young_modulus
            depth = min(harmless, DEEPEST_PRESS * length)
        _check_positive("depth", depth, "m")
        end = first + depth
    margin = _BLADE_MARGIN + BLADE_MARGIN_SHARE * thickness + SLIP_SHARE * displacement
    heel, tip = float(depths.min()) - margin, float(depths.max()) + margin
    end, tip = sheet.ending_at(lowest, end, heel, tip)
    times, travels = _timed(sheet, start, end, speed)
    segments = sheet.blade(travels, heel, tip)
    if name == "press":
        times, segments = np.append(times, times[-1] + PRESS_DWELL), [*segments, segments[-1]]
    asked = None if name in ("stop", "press") else [(0.0, float(times[-1]))]
    return Stroke(times, segments, name, asked=asked)


def check_meets(stroke: Stroke, mesh: TetrahedralMesh) -> None:
    """Check that a stroke touches the body.

    Args:
        stroke: In the tissue frame.
        mesh: The body as it lies before the stroke, tissue frame [m].

    Raises:
        StrokeError: it does not; the message says how far away the edge is, and where the body is.
    """
    distance = _distance(stroke, mesh)
    if distance > 0.0:
        low, high = mesh.positions.min(axis=0), mesh.positions.max(axis=0)
        raise StrokeError(
            f"the stroke '{stroke.name}' stays {1e3 * distance:.3g} mm away from the body, which "
            f"fills {_millimetres(low)} to {_millimetres(high)} mm (x, y, z); "
            "move the stroke, or check --scale"
        )


def _sheet(name: str, mesh: TetrahedralMesh, edges: IntArray) -> PlannedSheet:
    """Return the first sheet that parts the body in two, or else the first of all."""
    from tissue.support import components  # loads numba

    pieces, _ = components(len(mesh.positions), edges)
    first = None
    for sheet in _candidates(name, mesh, edges):
        if _divides(sheet, mesh, edges, pieces):
            return sheet
        first = first or sheet
    if first is None:
        raise StrokeError("the body has no section across its middle; is it in two pieces?")
    _log.warning("no %s stroke near the middle of the body parts it in exactly two", name)
    return first


def _candidates(name: str, mesh: TetrahedralMesh, edges: IntArray) -> Iterator[PlannedSheet]:
    """Yield sheets for a stroke, the best first: in the middle, and with full tilt or bend."""
    low, high = mesh.positions.min(axis=0), mesh.positions.max(axis=0)
    width = float(high[0] - low[0])
    for strength in (1.0, 0.5):
        for shift in SHIFTS:
            x = 0.5 * (low[0] + high[0]) + shift * width
            cut = section(mesh.positions, edges, mesh.positions[:, 0] - x)
            if len(cut):
                yield _sheet_at(name, cut, width, strength)
        if name not in ("slanted", "curved"):
            return


def _sheet_at(name: str, cut: FloatArray, width: float, strength: float) -> PlannedSheet:
    """Return the sheet of a stroke through the middle of a section that is normal to x.

    Args:
        name: One of `PLANNED_STROKES`.
        cut: Points of the section [m], shape (n, 3).
        width: Width of the body along x [m]; tilt and bend stay within a share of it.
        strength: Fraction of the full tilt or bend.
    """
    low, high = cut.min(axis=0), cut.max(axis=0)
    extent = high - low
    x, y, z = np.eye(3)
    level = extent[1] < ABOUT_EQUAL * extent[2]
    motion, down = (-z, y) if level else (y, -z)
    length, thickness = float(extent @ np.abs(motion)), float(extent @ np.abs(down))
    room = strength * WIDEST * width
    sheet = PlannedSheet((low + high) / 2.0, motion, down, x)
    if name == "slanted":
        tilt = min(strength * TILT, math.atan2(room, 0.5 * thickness))
        return sheet._replace(
            down=math.cos(tilt) * down + math.sin(tilt) * x,
            normal=math.cos(tilt) * x - math.sin(tilt) * down,
            rake=strength * RAKE,
        )
    if name == "curved":
        return sheet._replace(sagitta=min(strength * SAGITTA * length, room), chord=length)
    return sheet


def _divides(sheet: PlannedSheet, mesh: TetrahedralMesh, edges: IntArray, pieces: int) -> bool:
    """Whether the sheet leaves one piece more than there was, and both held sides whole.

    A tetrahedron's part on one side of the sheet holds its nodes on that side, joined by edges; so
    the parts of the body hang together as its nodes do along the edges that do not cross.
    """
    from tissue.support import components

    above = is_above(sheet.height(mesh.positions))
    whole = edges[above[edges[:, 0]] == above[edges[:, 1]]]
    parts, _ = components(len(mesh.positions), whole)
    x = mesh.positions[:, 0]
    margin = _HELD * np.ptp(x)
    left, right = above[x <= x.min() + margin], above[x >= x.max() - margin]
    return parts == pieces + 1 and not left.any() and bool(right.all())


def _displacement(width: float, length: float, thickness: float, material: Material) -> float:
    """Return how far the blade displaces the middle of the body before it cuts [m], roughly.

    Each half is a beam that is built in at its held side, and bends and shears under its half of
    the cutting force, toughness x thickness: a long soft body is dragged along by more than its
    section measures.

    Args:
        width: Width of the body between its held sides [m].
        length: Length of the section along the motion [m].
        thickness: Thickness of the section along the blade [m].
        material: Gives stiffness and toughness.
    """
    half, force = width / 2.0, material.toughness * thickness / 2.0
    bending = half**3 / (3.0 * material.young_modulus * thickness * length**3 / 12.0)
    shear = half / (material.young_modulus / 3.0 * thickness * length)  # G = E/3: incompressible
    return min(force * (bending + shear), LARGEST_DISPLACEMENT * half)


def _timed(
    sheet: PlannedSheet, start: float, end: float, speed: float
) -> tuple[FloatArray, FloatArray]:
    """Return times [s] and travels [m], at an even speed along the bend of the sheet."""
    fine = np.linspace(start, end, 1001)  # a bend of 11 % is followed to 1e-6 of its length
    pieces = np.hypot(np.diff(fine), np.diff(sheet.bulge(fine)[0]))
    paths = np.concatenate([[0.0], np.cumsum(pieces)])
    times, done = timed(float(paths[-1]), speed)
    return times, np.interp(done, paths, fine)


def _distance(stroke: Stroke, mesh: TetrahedralMesh) -> float:
    """Return how far the swept edge stays from the body [m]; 0 where it touches or is inside."""
    import fcl  # 0.3 s, and only here

    def surface(vertices: FloatArray, triangles: IntArray) -> fcl.CollisionObject:
        model = fcl.BVHModel()
        model.beginModel(len(vertices), len(triangles))
        model.addSubModel(vertices, triangles)
        model.endModel()
        return fcl.CollisionObject(model, fcl.Transform())

    poses = stroke.poses(201)
    if is_inside(poses[0].tip, mesh):
        return 0.0
    swept = np.array([end for pose in poses for end in (pose.heel, pose.tip)])
    heels = 2 * np.arange(len(poses) - 1)[:, None]
    strips = np.concatenate([heels + corners for corners in np.array([[0, 1, 2], [2, 1, 3]])])
    skin = surface(mesh.positions, boundary_faces(mesh.tetrahedra))
    distance: float = fcl.distance(skin, surface(swept, strips))
    return max(0.0, distance)


def _check_positive(what: str, value: float, unit: str) -> None:
    """Refuse a speed or depth that is not positive."""
    if not (math.isfinite(value) and value > 0.0):
        raise StrokeError(f"the {what} of the stroke is {value} {unit}; it must be positive")


def _millimetres(point: FloatArray) -> str:
    """Return a point in millimetres, for a message."""
    return "(" + ", ".join(f"{1e3 * value:.0f}" for value in point) + ")"
