"""Strokes along a sheet that is planned across the middle of a body."""

import logging
from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np

from scalpel_sim.strokes.csv_lines import StrokeError
from scalpel_sim.strokes.expected_force import is_inside
from scalpel_sim.strokes.kind import LyingBody, StrokeTable
from scalpel_sim.strokes.planned_sheet import PlannedSheet, is_above, mesh_edges, section
from scalpel_sim.strokes.stroke import Stroke
from scalpel_sim.strokes.timing import SPEED_UP_TIME, timed
from tissue import FloatArray, IntArray, Material, TetrahedralMesh, boundary_faces

WIDEST = 0.3
"""Distance by which a sheet may stray from its middle to the held sides, as a fraction of the
body's width. Beyond 0.4 it would come near what is held, and cut that off instead of the body in
two."""

SHIFTS = (0.0, 0.04, -0.04, 0.08, -0.08, 0.12, -0.12, 0.16, -0.16, 0.2, -0.2)
"""Distance from the middle at which a sheet may lie, as a fraction of the body's width: where a
bent or branched body falls into more than two parts at the middle, the nearest place is taken where
it does not."""

_HELD = 0.06
"""Fraction of the body's width at each end that a sheet must leave whole: the held sides are there
(5 % of the width on a body without flat sides)."""

ABOUT_EQUAL = 0.8
"""The blade lies level, and moves down, where the section is this much thinner than it is high."""

_BLADE_MARGIN, BLADE_MARGIN_SHARE = 5e-3, 0.3
"""Length of the blade beyond the section, at both ends: [m], plus a share of the section.
Tissue sags, stretches, and is dragged along; a blade that it slips off leaves a bridge."""

_GAP, GAP_SHARE = 5e-3, 0.1
"""Distance before the body at which the blade starts: [m], plus a share of the section's length."""

OVERSHOOT, OVERSHOOT_SHARE = 15e-3, 0.4
"""Distance beyond the body at which the stroke ends: [m], or a share of the section's length where
that is more, and in either case the body's displacement. The last of the tissue is dragged along
before it parts."""

LARGEST_DISPLACEMENT = 0.5
"""Largest displacement of a body before the blade, as a fraction of half its width: beyond that it
is stretched between its held sides like a string, which bending and shear do not cover."""

SLIP_SHARE = 0.3
"""Part of the body's displacement that may be along the edge: the sine of
the rake of a slanted blade, and a reserve."""

_log = logging.getLogger("scalpel_sim")


class MiddleSection(NamedTuple):
    """A section of a body across its middle, or near it."""

    sheet: PlannedSheet
    """The plane through it, on which the edge moves along the longer extent of the section: down
    into a thin sheet that stands on edge, else from front to back with the tip down."""
    length: float
    """Extent of the section along the motion [m]."""
    thickness: float
    """Extent of the section along the edge [m]."""
    width: float
    """Width of the body along x [m]."""

    def room(self, strength: float) -> float:
        """Return how far a sheet may stray from the plane [m], with a fraction of full tilt."""
        return strength * WIDEST * self.width


Bend = Callable[[MiddleSection, float], PlannedSheet]
"""Returns the sheet through a section, with a fraction of its full tilt or bend."""


class Passage(NamedTuple):
    """A sheet through a body, and where the blade enters and leaves the body on it."""

    row: StrokeTable
    """Gives the name and the speed of the stroke."""
    lowest: float
    """Height below which the edge is not led [m]."""
    sheet: PlannedSheet
    """The sheet."""
    first: float
    """Travel at which the blade meets the body [m]."""
    length: float
    """Travel from there to where the blade leaves it [m]."""
    depths: tuple[float, float]
    """Smallest and largest depth of the body along the edge [m]."""
    displacement: float
    """Distance by which the blade displaces the body before it cuts [m], roughly."""
    beyond: float
    """Travel at which a stroke ends that goes through [m]."""

    def stroke(self, end: float, *, asks: bool = True, dwell: float = 0.0) -> Stroke:
        """Return the stroke along the sheet.

        Args:
            end: Travel at its end [m].
            asks: Whether the whole path is to be cut; else that is not known.
            dwell: How long the blade rests at the end [s].
        """
        sheet, speed = self.sheet, self.row.tip_speed
        before = max(_GAP + GAP_SHARE * self.length, 0.5 * speed * SPEED_UP_TIME)
        low, high = self.depths
        margin = _BLADE_MARGIN + BLADE_MARGIN_SHARE * (high - low) + SLIP_SHARE * self.displacement
        heel = low - margin
        end, tip = sheet.ending_at(self.lowest, end, heel, high + margin)
        times, travels = _timed(sheet, self.first - before, end, speed)
        segments = sheet.blade(travels, heel, tip)
        if dwell > 0.0:
            times, segments = np.append(times, times[-1] + dwell), [*segments, segments[-1]]
        asked = [(0.0, float(times[-1]))] if asks else None
        return Stroke(times, segments, self.row.kind, asked=asked)


def passage_through(row: StrokeTable, body: LyingBody, bend: Bend | None = None) -> Passage:
    """Return a passage through the middle of a body.

    Sheets part the body's left from its right (low x from high x).

    Args:
        row: The stroke.
        body: The body.
        bend: Tilts or bends the sheet; None for a plane.

    Raises:
        StrokeError: the body has no section.
    """
    mesh = body.mesh
    edges = mesh_edges(mesh.tetrahedra)
    sheet = _sheet(row.kind, mesh, edges, bend)
    cut = section(mesh.positions, edges, sheet.height(mesh.positions))
    travels, depths = sheet.travel(cut), sheet.depth(cut)
    first, last = float(travels.min()), float(travels.max())
    length, width = last - first, float(np.ptp(mesh.positions[:, 0]))
    displacement = _displacement(width, length, float(np.ptp(depths)), body.material)
    return Passage(
        row,
        body.lowest,
        sheet,
        first,
        length,
        (float(depths.min()), float(depths.max())),
        displacement,
        beyond=last + max(OVERSHOOT, OVERSHOOT_SHARE * length) + displacement + row.farther,
    )


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


def _sheet(kind: str, mesh: TetrahedralMesh, edges: IntArray, bend: Bend | None) -> PlannedSheet:
    """Return the first sheet that parts each piece it meets in two, or else the first of all."""
    from tissue.support import components  # loads numba

    _, piece = components(len(mesh.positions), edges)
    first = None
    for sheet in _candidates(mesh, edges, bend):
        if _divides(sheet, mesh, edges, piece):
            return sheet
        first = first or sheet
    if first is None:
        raise StrokeError("the body has no section across its middle; is it in two pieces?")
    _log.warning("no %s stroke near the middle of the body parts it in exactly two", kind)
    return first


def _candidates(
    mesh: TetrahedralMesh, edges: IntArray, bend: Bend | None
) -> Iterator[PlannedSheet]:
    """Yield sheets for a stroke, the best first: in the middle, and with full tilt or bend."""
    low, high = mesh.positions.min(axis=0), mesh.positions.max(axis=0)
    width = float(high[0] - low[0])
    for strength in (1.0,) if bend is None else (1.0, 0.5):
        for shift in SHIFTS:
            x = 0.5 * (low[0] + high[0]) + shift * width
            cut = section(mesh.positions, edges, mesh.positions[:, 0] - x)
            if len(cut):
                middle = _middle_section(cut, width)
                yield middle.sheet if bend is None else bend(middle, strength)


def _middle_section(cut: FloatArray, width: float) -> MiddleSection:
    """Return a section that is normal to x.

    Args:
        cut: Points of the section [m], shape (n, 3).
        width: Width of the body along x [m].
    """
    low, high = cut.min(axis=0), cut.max(axis=0)
    extent = high - low
    x, y, z = np.eye(3)
    level = extent[1] < ABOUT_EQUAL * extent[2]
    motion, down = (-z, y) if level else (y, -z)
    length, thickness = float(extent @ np.abs(motion)), float(extent @ np.abs(down))
    return MiddleSection(
        PlannedSheet((low + high) / 2.0, motion, down, x), length, thickness, width
    )


def _divides(sheet: PlannedSheet, mesh: TetrahedralMesh, edges: IntArray, piece: IntArray) -> bool:
    """Whether the sheet leaves two of each piece that it meets, and both held sides whole.

    `piece` is that of each node. A tetrahedron's part on one side of the sheet holds its nodes on
    that side, joined by edges; so the parts of the body hang together as its nodes do along the
    edges that do not cross.
    """
    from tissue.support import components

    above = is_above(sheet.height(mesh.positions))
    whole = edges[above[edges[:, 0]] == above[edges[:, 1]]]
    parts, _ = components(len(mesh.positions), whole)
    x = mesh.positions[:, 0]
    margin = _HELD * np.ptp(x)
    left, right = above[x <= x.min() + margin], above[x >= x.max() - margin]
    sides = len(np.unique(2 * piece + above))  # a piece has nodes on one or on both
    is_met = sides > piece.max() + 1
    return is_met and parts == sides and not left.any() and bool(right.all())


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


def _millimetres(point: FloatArray) -> str:
    """Return a point in millimetres, for a message."""
    return "(" + ", ".join(f"{1e3 * value:.0f}" for value in point) + ")"
