"""The law of cutting in every tissue by name: force over toughness times length, and three areas.

Blocks of each tissue are cut headless, on meshes of other sizes than those of the tests: along
their planes and between them, at angles to them, from the skin down to a tip or through, at several
speeds and by a slanted and a sliding edge. In the middle of each cut, where it is steady, the
benchmark compares the force with the law, and the area that the edge sweeps in the material with
those that open and that are paid for, over 20 mm of it.
"""

import itertools
import logging
import math
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np

from benchmarks.timing import TurnWatch
from scalpel_sim.errors import UsageError
from scalpel_sim.validate.speed.measurements import BenchmarkResult
from scalpel_sim.validate.speed.tables import Rows, compact_table
from scalpel_sim.validate.speed.watch import SILENT
from tissue import (
    MATERIALS,
    BladeSegment,
    BladeSweep,
    BoolArray,
    FloatArray,
    Material,
    SolverSettings,
    TetrahedralMesh,
    Tissue,
    block,
    fixed_nodes,
    lattice_block,
)
from tissue.blade.edge_anchors import ANCHORED
from tissue.mesh.body import CUT

if TYPE_CHECKING:
    from rich.console import Console

SIZE = (0.045, 0.09, 0.016)
"""Edges of the blocks across, along the cut and up [m]."""
MESHES = (("block", 8e-3), ("lattice", 8e-3), ("lattice", 4.5e-3))
"""Division of cells into tetrahedra, and their size [m]."""
STEADY = (0.55, 0.85)
"""Part of the length of the block in which a cut counts as steady."""
AREAS_OVER, PAST = 0.02, 0.016
"""Length over which areas are compared, and distance from its end to the far side of the block [m]:
the edge has to pass on by as much as it is ahead of its material, and by an element."""
LAW_DT = 1e-3
"""Time step [s]."""
APPROACH = 6e-3
"""Distance before the block at which the edge begins [m]."""
OUT_OF_BLOCK = 6e-3
"""Length of an edge that cuts through, above and below the block [m]."""
FORCE_OFF, LEAST_OF_LAW, AREAS_OFF = 0.05, 0.9, 0.03
"""Bounds on a mean force, on the least one, and on areas paid for per area swept."""


class LawCut(NamedTuple):
    """A straight cut through a block."""

    name: str
    x: float
    """Where it crosses the middle of the block [m]."""
    depth: float
    """Depth of the tip [m]; more than the block is high: through, with both sides held."""
    speed: float = 0.1
    """Speed of the edge [m/s]."""
    angle: float = 0.0
    """Between the cut and the planes of the mesh [degrees]."""
    slope: float = 0.0
    """Of the edge against the upright [degrees]; the tip is behind."""
    slide: float = 0.0
    """Speed at which the edge slides along itself, per its speed."""

    @property
    def is_through(self) -> bool:
        """Whether the edge cuts through."""
        return self.depth > SIZE[2]


CUTS = (
    LawCut("plane", 0.018, 0.008),
    LawCut("between", 0.0187, 0.0087),
    LawCut("middle", 0.02025, 0.0083),
    LawCut("slow", 0.0187, 0.0087, speed=0.02),
    LawCut("fast", 0.0187, 0.0087, speed=0.2),
    LawCut("15 degrees", 0.0225, 0.0087, angle=15.0),
    LawCut("37 degrees", 0.0225, 0.0083, angle=37.0),
    LawCut("60 degrees", 0.0225, 0.0087, angle=60.0),
    LawCut("edge sloped by 30", 0.0187, 0.0087, slope=30.0),
    LawCut("through", 0.0187, 0.1),
    LawCut("through, 37 degrees", 0.0225, 0.1, angle=37.0),
    LawCut("sliding by 0.7", 0.0187, 0.1, speed=0.06, slide=0.7),
    LawCut("sliding by 1.5", 0.0187, 0.1, speed=0.06, slide=1.5),
    LawCut("slowest", 0.0187, 0.0087, speed=0.005),
)
"""The cuts of every block."""


class Measured(NamedTuple):
    """Outcome of a steady cut. Areas are shares of what the edge sweeps in space."""

    force: float
    """Mean force along the cut over that of the law."""
    ripple: float
    """Standard deviation of the force over its mean."""
    lowest: float
    """Least force over that of the law."""
    swept: float
    """Area that the edge swept in the material, at rest."""
    opened: float
    """Area of the faces that opened."""
    flat: float
    """Area of their projection on the plane of the cut: `opened` without what is rough."""
    paid: float
    """Area that the blade paid for."""
    released: float
    """Energy of the springs of the edge that was lost, over the work of the blade."""


class _Frame(NamedTuple):
    """One frame of a cut."""

    force: float
    paid: float
    swept: float
    released: float
    work: float


def law_of(material: Material, cut: LawCut) -> float:
    """Return the force along a cut that the law asks for [N]."""
    speed = cut.speed * math.cos(math.radians(cut.slope))
    toughness = material.toughness
    if material.toughness_exponent > 0.0:
        rise = (speed / material.toughness_speed) ** material.toughness_exponent
        toughness *= 1.0 + rise
    return toughness * min(cut.depth, SIZE[2]) / (1.0 + cut.slide**2)


def make_block(kind: str, cell: float) -> TetrahedralMesh:
    """Return the block in cells of about that size [m]; `kind`: block or lattice."""
    cells = [max(1, round(edge / cell)) for edge in SIZE]
    return (lattice_block if kind == "lattice" else block)(cells, SIZE)


def length_of(cut: LawCut) -> float:
    """Return how long a cut is in the block [m]."""
    angle = math.radians(cut.angle)
    return min(SIZE[1] / math.cos(angle), SIZE[0] / max(math.sin(angle), 1e-9))


def poses(cut: LawCut) -> tuple[FloatArray, list[BladeSegment]]:
    """Return where the edge is along the block in each frame, 0 to 1, and its poses."""
    angle, slope = math.radians(cut.angle), math.radians(cut.slope)
    ahead = np.array([math.sin(angle), math.cos(angle), 0.0])
    along = -math.sin(slope) * ahead + np.array([0.0, 0.0, math.cos(slope)])
    forward = math.cos(slope) * ahead + np.array([0.0, 0.0, math.sin(slope)])
    length = length_of(cut)
    begin, end = -0.5 * length - APPROACH, 0.5 * length
    travel = np.arange(begin, end, cut.speed * LAW_DT)
    slid = cut.slide * (travel - begin)
    low = -OUT_OF_BLOCK if cut.is_through else SIZE[2] - cut.depth
    high = (SIZE[2] + OUT_OF_BLOCK + (slid[-1] if cut.is_through else 0.0) - low) / math.cos(slope)
    middle = np.array([cut.x, 0.5 * SIZE[1], low])
    tips = [middle + s * ahead - d * along for s, d in zip(travel, slid, strict=True)]
    return travel / length + 0.5, [BladeSegment(tip, tip + high * along, forward) for tip in tips]


class _Place(NamedTuple):
    """Where a cut is in the block at rest."""

    origin: FloatArray
    """Where it crosses the middle of the block [m], shape (3,)."""
    ahead: FloatArray
    """Direction of the cut, shape (3,)."""
    first: float
    """Distance from the middle at which the areas begin to count [m]."""
    is_through: bool
    """Whether it cuts through."""

    def along(self, points: FloatArray) -> FloatArray:
        """Return how far points, shape (..., 3), are along the cut [m]."""
        distances: FloatArray = (points - self.origin) @ self.ahead
        return distances

    def has(self, distances: FloatArray) -> BoolArray:
        """Return which distances along the cut count [m]."""
        counts: BoolArray = (distances > self.first) & (distances < self.first + AREAS_OVER)
        return counts


def measure_cut(
    material: Material, mesh: TetrahedralMesh, cut: LawCut, element: str = "averaged"
) -> Measured:
    """Make a cut, and return what it came to where it was steady."""
    fixed = fixed_nodes(mesh, "left,right" if cut.is_through else "bottom")
    solver = SolverSettings(audit=True, element=element)
    tissue = Tissue(mesh, material, fixed=fixed, gravity=(0.0, 0.0, 0.0), solver=solver)
    where, edges = poses(cut)
    angle = math.radians(cut.angle)
    place = _Place(
        origin=np.array([cut.x, 0.5 * SIZE[1], 0.0]),
        ahead=np.array([math.sin(angle), math.cos(angle), 0.0]),
        first=0.5 * length_of(cut) - PAST - AREAS_OVER,
        is_through=cut.is_through,
    )
    frames: list[_Frame] = []
    before = _anchors(tissue)
    for pair in itertools.pairwise(edges):
        result = tissue.step(BladeSweep(*pair), LAW_DT)
        now = _anchors(tissue)
        assert result.energies is not None
        swept, paid = _swept_and_paid(before, now, place)
        frames.append(
            _Frame(
                force=-float(result.wrench.force @ place.ahead),
                paid=paid,
                swept=swept,
                released=result.energies.released,
                work=result.energies.work_of_blade,
            )
        )
        before = now
    record = np.array(frames)
    _, total_paid, total_swept, *_ = record.sum(axis=0)
    record = record[(where[1:] > STEADY[0]) & (where[1:] < STEADY[1])]
    first, last, force = record[0], record[-1], record[:, 0]
    opened, flat = _opened(tissue, place)
    geometric = AREAS_OVER * min(cut.depth, SIZE[2])
    law = law_of(material, cut)
    return Measured(
        force=float(force.mean() / law),
        ripple=float(force.std() / abs(force.mean())),
        lowest=float(force.min() / law),
        swept=float(total_swept / geometric),
        opened=opened / geometric,
        flat=flat / geometric,
        paid=float(total_paid / geometric),
        released=float((last[3] - first[3]) / (last[4] - first[4])),
    )


def _anchors(tissue: Tissue) -> tuple[FloatArray, BoolArray, FloatArray]:
    """Return the material points that hold the edge [m], which of them do, and what each cut."""
    anchors = tissue._model.interaction.state.anchors
    return anchors.rest.copy(), anchors.state == ANCHORED, anchors.cut.copy()


def _swept_and_paid(
    before: tuple[FloatArray, BoolArray, FloatArray],
    now: tuple[FloatArray, BoolArray, FloatArray],
    place: _Place,
) -> tuple[float, float]:
    """Return the area between the material points then and now, up to the skin, and that paid for.

    Both in m2, of what counts.
    """
    if len(before[0]) != len(now[0]):  # the edge was taken up in this frame
        return 0.0, 0.0
    held = before[1] & now[1]
    p, q = before[0], now[0]
    at = place.along(0.5 * (p + q))
    paid = float(now[2][place.has(at)].sum())
    if not held.any():
        return 0.0, paid
    quads = 0.5 * np.linalg.norm(np.cross(q[1:] - p[:-1], q[:-1] - p[1:]), axis=1)
    counts = held[1:] & held[:-1] & place.has(0.5 * (at[1:] + at[:-1]))
    area = float(quads[counts].sum())
    ends = np.flatnonzero(held)[[0, -1]]
    moved = (q - p)[ends] @ place.ahead * place.has(at[ends])
    height = 0.5 * (p + q)[ends, 2]
    area += float(moved[1] * max(SIZE[2] - height[1], 0.0))
    return area + (float(moved[0] * max(height[0], 0.0)) if place.is_through else 0.0), paid


def _opened(tissue: Tissue, place: _Place) -> tuple[float, float]:
    """Return the area of the faces that opened, and that of their projection on the plane [m2]."""
    body = tissue._body
    tetrahedra = body.tetrahedra[: body.n_tetrahedra]
    holders, opposite = np.nonzero(body.links[: body.n_tetrahedra] == CUT)
    corners = (opposite[:, None] + np.arange(1, 4)) % 4
    normal = np.cross(place.ahead, [0.0, 0.0, 1.0])
    both_sides = np.zeros(2)
    for face in body.rest[tetrahedra[holders[:, None], corners]]:
        polygon = _clipped(face, place.along(face) - place.first)
        polygon = _clipped(polygon, place.first + AREAS_OVER - place.along(polygon))
        if len(polygon) >= 3:
            sides = polygon - polygon[0]
            area = 0.5 * np.cross(sides[1:-1], sides[2:]).sum(axis=0)
            both_sides += np.linalg.norm(area), abs(area @ normal)
    return float(0.5 * both_sides[0]), float(0.5 * both_sides[1])


def _clipped(polygon: FloatArray, inside: FloatArray) -> FloatArray:
    """Return the part of a polygon, shape (n, 3), where a linear function, shape (n,), is >= 0."""
    kept = []
    for i in range(len(polygon)):
        here, before = inside[i], inside[i - 1]
        if (here >= 0.0) != (before >= 0.0):
            share = before / (before - here)
            kept.append(polygon[i - 1] + share * (polygon[i] - polygon[i - 1]))
        if here >= 0.0:
            kept.append(polygon[i])
    return np.array(kept).reshape(-1, 3)


def cutting_law(
    *,
    watch: TurnWatch = SILENT,
    presets: str = "all",
    cuts: Literal["all", "few"] = "all",
    element: Literal["averaged", "plain"] = "averaged",
) -> BenchmarkResult:
    """Compare the force and the areas of steady cuts with the law, in every tissue by name.

    Args:
        watch: Receives the progress.
        presets: Names of tissues, joined by commas, or `all`.
        cuts: All cuts, or a few of each tissue: those between planes, at 37 degrees and through.
        element: How tetrahedra are strained.

    Raises:
        UsageError: There is no such tissue.
    """
    names = list(MATERIALS) if presets == "all" else presets.split(",")
    for name in names:
        if name not in MATERIALS:
            raise UsageError(f"there is no tissue {name!r}. Tissues: {', '.join(MATERIALS)}")
    chosen = [CUTS[1], CUTS[6], CUTS[9]] if cuts == "few" else list(CUTS)
    watch.begin(len(names) * len(MESHES))
    found: list[tuple[str, str, LawCut, Measured]] = []
    quiet = logging.getLogger("tissue")
    level = quiet.level
    quiet.setLevel(logging.ERROR)  # some are tougher than their law bears: the table shows it
    try:
        for name, (kind, cell) in itertools.product(names, MESHES):
            mesh, material = make_block(kind, cell), MATERIALS[name].material
            label = f"{kind} {cell * 1e3:g} mm"
            for cut in chosen:
                found.append((name, label, cut, measure_cut(material, mesh, cut, element)))
            watch.tick(f"{name}, {label}")
    finally:
        quiet.setLevel(level)
    return _result(found)


def _result(found: list[tuple[str, str, LawCut, Measured]]) -> BenchmarkResult:
    """Return the outcome: a row for each cut, the means, and the worst of all."""
    rows = Rows("cutting-law")
    by_tissue = {name: [m for n, _, _, m in found if n == name] for name, *_ in found}
    for name, measured in by_tissue.items():
        rows.values(name, None, [m.force for m in measured], "law", quantity="force")
    columns = ("force", "ripple", "lowest", "swept", "opened", "flat", "paid", "released")

    def show(console: "Console") -> None:
        table = compact_table("steady cuts, over the law", ("tissue", "mesh", "cut"), columns)
        for name, mesh, cut, each in found:
            table.add_row(name, mesh, cut.name, *(f"{value:.3f}" for value in each))
        console.print(table)
        for name, measured in by_tissue.items():
            force = np.array([m.force for m in measured])
            paid = np.array([m.paid / m.swept for m in measured])
            opened = np.array([m.opened / m.swept for m in measured])
            flat = np.array([m.flat / m.swept for m in measured])
            console.print(
                f"{name}: force {force.mean():.3f}, {force.min():.3f} to {force.max():.3f}; "
                f"paid / swept {paid.min():.3f} to {paid.max():.3f}; "
                f"opened / swept {opened.min():.3f} to {opened.max():.3f}, "
                f"flat {flat.min():.3f} to {flat.max():.3f}",
                highlight=False,
            )

    is_right = all(
        abs(np.mean([m.force for m in measured]) - 1.0) <= FORCE_OFF
        and min(m.force for m in measured) >= LEAST_OF_LAW
        and max(abs(m.paid / m.swept - 1.0) for m in measured) <= AREAS_OFF
        for measured in by_tissue.values()
    )
    return BenchmarkResult(rows.measured, rows.skipped, show, is_right)
