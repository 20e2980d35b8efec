"""What the scenes cut, and how: a block of soft material, led strokes, and what was felt."""

import itertools
from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from tissue import (
    BladeSegment,
    BladeShape,
    BladeSweep,
    Energies,
    FloatArray,
    Law,
    Material,
    SolverSettings,
    StepResult,
    TetrahedralMesh,
    Tissue,
    Wrench,
    block,
    fixed_nodes,
)

SIZE = (0.04, 0.04, 0.02)
"""Edges of the block [m]: across the cut, along it, and its thickness."""
LENGTH, THICKNESS = SIZE[1], SIZE[2]
MIDDLE = 0.0213
"""Where the cut is led, across [m]: near the middle, and where no plane of either mesh is near. A
cut along a plane of the mesh is easier for any method."""
COARSE, FINE = (8, 8, 4), (12, 12, 6)
"""Cells: edges of 5 mm, and of two thirds of that."""
DT = 1e-3
"""Time step [s]: that of a haptic loop."""
BELOW = 0.005
"""How far the point of an edge that cuts through is below the block [m]."""
THROUGH = 0.03
"""Length of such an edge [m]."""
STEADY = (0.3 * LENGTH, 0.75 * LENGTH)
"""Between these places of the edge [m] a cut is steady: it is in with its whole length, and the far
side is not yet near."""


def rubber(
    law: Law = "neo_hookean",
    *,
    young_modulus: float = 10e3,
    poisson_ratio: float | None = None,
    toughness: float = 20.0,
    **more: float,
) -> Material:
    """Return the material of the block: as soft as an organ, nearly incompressible where it can."""
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
    cells: Sequence[int] = COARSE,
    *,
    held: str = "left,right",
    blade: BladeShape | None = None,
    mesh: TetrahedralMesh | None = None,
    audit: bool = False,
) -> Tissue:
    """Return a block at rest, without weight.

    Args:
        material: What it is made of.
        cells: Across the cut, along it, and through the thickness.
        held: The sides that do not move.
        blade: Its body; None for a line.
        mesh: The block, where it is not the usual grid.
        audit: Whether to keep the account of energy.
    """
    mesh = mesh or block(cells, SIZE)
    return Tissue(
        mesh,
        material,
        fixed=fixed_nodes(mesh, held) if held else None,
        gravity=(0.0, 0.0, 0.0),
        blade=blade,
        solver=SolverSettings(audit=audit),
    )


def edge(
    tip: npt.ArrayLike,
    *,
    along: npt.ArrayLike = (0.0, 0.0, 1.0),
    forward: npt.ArrayLike = (0.0, 1.0, 0.0),
    length: float = THROUGH,
) -> BladeSegment:
    """Return a cutting edge with its point at `tip` [m], upright and facing along y unless told."""
    tip, along = np.array(tip, dtype=np.float64), np.array(along, dtype=np.float64)
    along /= np.linalg.norm(along)
    return BladeSegment(tip, tip + length * along, np.array(forward, dtype=np.float64))


def through(
    speed: float, *, ratio: float = 0.0, x: float = MIDDLE, begin: float = -0.003, end: float = 0.04
) -> list[BladeSegment]:
    """Return the places of an upright edge that is led through the whole block.

    Args:
        speed: Across the edge [m/s].
        ratio: Of the speed along the edge, downwards, to that: slicing.
        x: Where the cut is [m].
        begin: Of the edge, along the block [m].
        end: The same.
    """
    n = round((end - begin) / (speed * DT))
    way = ratio * (end - begin)
    places = np.linspace(begin, end, n + 1)
    # An edge that is drawn down begins so high that its point has just come through at the start.
    return [edge((x, y, -BELOW - ratio * (y - begin)), length=THROUGH + way) for y in places]


class Record(NamedTuple):
    """What was felt on the way, a row a step."""

    tip: FloatArray
    """At the end of the step [m], shape (n, 3)."""
    force: FloatArray
    """On the blade, averaged over the step [N], shape (n, 3)."""
    torque: FloatArray
    """The same about the tip [N m], shape (n, 3)."""
    length: FloatArray
    """Of edge in the tissue [m], shape (n,)."""
    area: FloatArray
    """Of the faces cut so far [m2], shape (n,)."""
    work: FloatArray
    """Of the blade so far [J], shape (n,)."""
    accounts: FloatArray
    """Of energy so far [J], in the order of `Energies`, shape (n, 12); (n, 0) without an audit."""
    last: StepResult

    @property
    def y(self) -> FloatArray:
        """Where the edge is along the block [m]."""
        return self.tip[:, 1]

    @property
    def resistance(self) -> FloatArray:
        """What resists its way along the block [N]."""
        return -self.force[:, 1]

    @property
    def energies(self) -> Energies:
        """The account of energy at the end."""
        assert self.last.energies is not None, "the block has no audit"
        return self.last.energies

    def of_steady(self, column: FloatArray) -> FloatArray:
        """Return the rows of a column while the cut is steady."""
        return column[self.steady()]

    def steady(self) -> npt.NDArray[np.bool_]:
        """Return which rows are of a steady cut, shape (n,)."""
        return (self.y > STEADY[0]) & (self.y < STEADY[1])


def lead(tissue: Tissue, places: Iterable[BladeSegment], dt: float = DT) -> Record:
    """Lead the edge from place to place, `dt` [s] from each to the next; return what was felt."""
    results = [tissue.step(BladeSweep(t0, t1), dt) for t0, t1 in itertools.pairwise(places)]
    return record(results)


def record(results: Sequence[StepResult]) -> Record:
    """Return the rows of what steps told."""
    wrenches: list[Wrench] = [result.wrench for result in results]
    return Record(
        tip=np.array([wrench.point for wrench in wrenches]),
        force=np.array([wrench.force for wrench in wrenches]),
        torque=np.array([wrench.torque for wrench in wrenches]),
        length=np.array([result.anchored_length for result in results]),
        area=np.array([result.cut_area for result in results]),
        work=np.array([result.work_of_blade for result in results]),
        accounts=np.array([result.energies or () for result in results]),
        last=results[-1],
    )
