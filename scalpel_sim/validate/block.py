"""Parts of most scenes: a block of soft material, strokes through it, and the record of one."""

import itertools
from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from tissue import (
    BladeSegment,
    BladeShape,
    BladeSweep,
    Energies,
    FloatArray,
    Material,
    SolverSettings,
    StepResult,
    TetrahedralMesh,
    Tissue,
    block,
    fixed_nodes,
)

BLOCK_SIZE = (0.04, 0.04, 0.02)
"""Sides of the block [m]: across the cut, along it, and its thickness."""
LENGTH, THICKNESS = BLOCK_SIZE[1], BLOCK_SIZE[2]
CUT_X = 0.0213
"""Position of the cut across the block [m]: near the middle, and away from the planes of either
mesh. A cut along a plane of the mesh is easier for any method."""
COARSE_CELLS, FINE_CELLS = (8, 8, 4), (12, 12, 6)
"""Cells of the two meshes: sides of 5 mm, and of two thirds of that."""
DT = 1e-3
"""Time step [s]: that of a haptic loop."""
_BELOW = 0.005
"""Depth below the block of the tip of an edge that cuts right through [m]."""
_EDGE_LENGTH = 0.03
"""Length of an edge that cuts right through [m]."""
STEADY_RANGE = (0.3 * LENGTH, 0.75 * LENGTH)
"""Positions of the edge along the block between which a cut is steady [m]: the whole edge is in the
block, and the far side is not yet near."""
_ABOVE_BLOCK = 0.5e-3
"""Height of the edge above the block at the start [m]."""


def soft_material(
    law: str = "neo_hookean",
    *,
    young_modulus: float = 10e3,
    poisson_ratio: float | None = None,
    toughness: float = 20.0,
    **more: Any,
) -> Material:
    """Return the material of the block: as soft as an organ.

    Args:
        law: Name of the law of elasticity.
        young_modulus: Young's modulus [Pa].
        poisson_ratio: Poisson's ratio; None: nearly incompressible, or 1/4 for springs.
        toughness: Fracture toughness [J/m2].
        more: Further arguments of `Material`.
    """
    if poisson_ratio is None:
        poisson_ratio = 0.25 if law == "springs" else 0.45
    return Material(
        young_modulus=young_modulus,
        poisson_ratio=poisson_ratio,
        toughness=toughness,
        law=law,
        **more,
    )


def block_tissue(
    material: Material,
    cells: Sequence[int] = COARSE_CELLS,
    *,
    held: str = "left,right",
    blade: BladeShape | None = None,
    mesh: TetrahedralMesh | None = None,
    audit: bool = False,
) -> Tissue:
    """Return a block at rest, without gravity.

    Args:
        material: Material of the block.
        cells: Cells across the cut, along it, and through the thickness.
        held: The sides that do not move.
        blade: Shape of the blade; None for a bare edge.
        mesh: The mesh, where it is not the usual grid.
        audit: Whether to keep the energy audit.
    """
    mesh = mesh or block(cells, BLOCK_SIZE)
    return Tissue(
        mesh,
        material,
        fixed=fixed_nodes(mesh, held) if held else None,
        gravity=(0.0, 0.0, 0.0),
        blade=blade,
        solver=SolverSettings(audit=audit),
    )


def edge_at(
    tip: npt.ArrayLike,
    *,
    along: npt.ArrayLike = (0.0, 0.0, 1.0),
    forward: npt.ArrayLike = (0.0, 1.0, 0.0),
    length: float = _EDGE_LENGTH,
) -> BladeSegment:
    """Return a cutting edge.

    Args:
        tip: Position of the tip [m].
        along: Direction from the tip to the heel; upright by default.
        forward: Direction in which it cuts; along y by default.
        length: Length of the edge [m].
    """
    tip, along = np.array(tip, dtype=np.float64), np.array(along, dtype=np.float64)
    along /= np.linalg.norm(along)
    return BladeSegment(tip, tip + length * along, np.array(forward, dtype=np.float64))


def straight_cut(
    speed: float,
    *,
    ratio: float = 0.0,
    x: float = CUT_X,
    begin: float = -0.003,
    end: float = 0.04,
) -> list[BladeSegment]:
    """Return the poses of an upright edge that cuts straight through the whole block.

    Args:
        speed: Speed across the edge [m/s].
        ratio: Speed along the edge, downwards, over the speed across it: slicing.
        x: Position of the cut across the block [m].
        begin: First position of the edge along the block [m].
        end: Last position of the edge along the block [m].
    """
    n = round((end - begin) / (speed * DT))
    drawn = ratio * (end - begin)
    positions = np.linspace(begin, end, n + 1)
    # An edge that is drawn down begins so high that its tip is just below the block at the start.
    return [
        edge_at((x, y, -_BELOW - ratio * (y - begin)), length=_EDGE_LENGTH + drawn)
        for y in positions
    ]


class StrokeRecord(NamedTuple):
    """Forces that the blade met on a stroke, a row for each step."""

    tip: FloatArray
    """Position of the tip at the end of the step [m], shape (n, 3)."""
    force: FloatArray
    """Force on the blade, averaged over the step [N], shape (n, 3)."""
    area: FloatArray
    """Area of the faces cut so far [m2], shape (n,)."""
    work: FloatArray
    """Work of the blade so far [J], shape (n,)."""
    energy_rows: FloatArray
    """The energies so far [J], in the order of `Energies`, shape (n, n_energies); (n, 0)
    without an audit."""
    last: StepResult
    """Result of the last step."""

    @property
    def y(self) -> FloatArray:
        """Position of the edge along the block [m], shape (n,)."""
        return self.tip[:, 1]

    @property
    def resistance(self) -> FloatArray:
        """Force against the motion along the block [N], shape (n,)."""
        return -self.force[:, 1]

    @property
    def energies(self) -> Energies:
        """The energy audit at the end."""
        assert self.last.energies is not None, "the block has no audit"
        return self.last.energies

    @property
    def steady_resistance(self) -> float:
        """Mean force against the motion along the block while the cut is steady [N]."""
        return float(self.steady_rows(self.resistance).mean())

    def steady_rows(self, column: FloatArray) -> FloatArray:
        """Return the rows of a column while the cut is steady."""
        return column[(self.y > STEADY_RANGE[0]) & (self.y < STEADY_RANGE[1])]


def run_stroke(tissue: Tissue, poses: Iterable[BladeSegment], dt: float = DT) -> StrokeRecord:
    """Move the edge from pose to pose, one step of `dt` [s] each, and record the steps."""
    results = [tissue.step(BladeSweep(t0, t1), dt) for t0, t1 in itertools.pairwise(poses)]
    wrenches = [result.wrench for result in results]
    return StrokeRecord(
        tip=np.array([wrench.point for wrench in wrenches]),
        force=np.array([wrench.force for wrench in wrenches]),
        area=np.array([result.cut_area for result in results]),
        work=np.array([result.work_of_blade for result in results]),
        energy_rows=np.array([result.energies or () for result in results]),
        last=results[-1],
    )


def insertion(
    length: float,
    depth: float,
    speed: float,
    *,
    middle: tuple[float, float] = (CUT_X, 0.5 * LENGTH),
    top: float = THICKNESS,
) -> list[BladeSegment]:
    """Return the poses of an edge that goes down.

    Args:
        length: Length of the edge, along y [m].
        depth: How far below the top it goes [m].
        speed: Speed of the edge [m/s].
        middle: Coordinates of the middle of the edge, across and along the block [m].
        top: Height of the top of the body [m].
    """
    n = round((depth + _ABOVE_BLOCK) / speed / DT)
    heights: FloatArray = top + _ABOVE_BLOCK - np.linspace(0.0, depth + _ABOVE_BLOCK, n + 1)
    x, y = middle[0], middle[1] - 0.5 * length
    return [
        edge_at((x, y, z), along=(0.0, 1.0, 0.0), forward=(0.0, 0.0, -1.0), length=length)
        for z in heights
    ]


def insertion_and_withdrawal(length: float, depth: float, speed: float) -> list[BladeSegment]:
    """Return the poses of an edge that goes down, and back up on the same path."""
    down = insertion(length, depth, speed)
    return down + down[-2::-1]
