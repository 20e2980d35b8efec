"""Steady cutting: the force is toughness times depth at any speed, on any mesh, under any law."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from scalpel_sim.validate.block import (
    BLOCK_SIZE,
    THICKNESS,
    StrokeRecord,
    block_tissue,
    run_stroke,
    soft_material,
    straight_cut,
)
from scalpel_sim.validate.findings import Check, Curve, Findings, Plot, farthest_from_one, lines_of
from tissue import Material, block

_LINES = lines_of("steady")
STEADY_YOUNG_MODULUS = 30e3
"""Young's modulus [Pa], high enough for neo-Hookean tetrahedra of both meshes and all toughnesses
(`tissue.blade.toughness.TOUGHEST`): at 160 J/m2 toughness over modulus is 5.3 mm, and the node size
of the finer mesh is 2.4 mm. Springs bear the two lowest."""
STEADY_LENGTH = 0.1
"""Length of the block along the cut [m]. The edge dents the block before it breaks in, at 160 J/m2
by some 10 mm, and makes that good on the first 40 mm: there it cuts more than it travels."""
STEADY_CELLS = (8, 20, 4), (12, 30, 6)
"""Cells of the two meshes: sides of 5 mm, and of two thirds of that."""
_STEADY_FROM, _STEADY_TO = 0.045, 0.08
"""Positions of the edge along the block between which its cut is steady [m]."""
_TOUGHNESSES: dict[str, tuple[float, ...]] = {
    "neo_hookean": (5.0, 20.0, 60.0, 160.0),
    "exponential": (5.0, 20.0, 60.0, 160.0),
    "springs": (5.0, 20.0),
}
"""Toughnesses of the block [J/m2], by law."""
_STIFFENING = 15.0
"""b of the exponential law: that of the tissues by name."""
STEADY_CUTS = ((0.02, 0.1), (0.0187, 0.2), (0.0225, 0.1))
"""Positions of the cuts across the block [m], the first along a plane of both meshes and the others
between their planes; and speeds [m/s]."""


class SteadyCut(NamedTuple):
    """The force of a steady cut."""

    record: StrokeRecord
    force: float
    """Mean force [N]."""
    ripple: float
    """Standard deviation of the force over its mean."""
    lowest: float
    """Lowest force over its mean."""


def cut_steadily(
    material: Material, cells: tuple[int, int, int], x: float, speed: float
) -> SteadyCut:
    """Cut through the block; return the force while the cut was steady.

    Args:
        material: Material of the block.
        cells: Cells of its mesh.
        x: Position of the cut across the block [m].
        speed: Speed of the blade [m/s].
    """
    across, thickness = BLOCK_SIZE[0], BLOCK_SIZE[2]
    mesh = block(cells, (across, STEADY_LENGTH, thickness))
    tissue = block_tissue(material, mesh=mesh)
    record = run_stroke(tissue, straight_cut(speed, x=x, end=_STEADY_TO))
    force = record.resistance[record.y > _STEADY_FROM]
    mean = float(force.mean())
    return SteadyCut(record, mean, float(force.std()) / mean, float(force.min()) / mean)


def check_steady_cuts(name: str, measured: Sequence[SteadyCut], toughness: float) -> list[Check]:
    """Return the checks of the worst of several cuts.

    Args:
        name: Name of the block.
        measured: The cuts.
        toughness: Toughness of the block [J/m2].
    """
    shares = [each.force / (toughness * THICKNESS) for each in measured]
    return [
        _LINES["force"].check(name, farthest_from_one(shares)),
        _LINES["ripple"].check(name, max(each.ripple for each in measured)),
        _LINES["lowest"].check(name, min(each.lowest for each in measured)),
    ]


def measure_steady(quick: bool) -> Findings:
    """Cut at several toughnesses, speeds and positions, on two meshes, under three laws."""
    cuts = STEADY_CUTS[2:] if quick else STEADY_CUTS
    checks, curves = [], []
    for law, toughnesses in _TOUGHNESSES.items():
        for toughness in toughnesses[1:2] if quick else toughnesses:
            material = steady_material(law, toughness)
            means = []
            for cells in STEADY_CELLS:
                measured = [cut_steadily(material, cells, x, speed) for x, speed in cuts]
                means.append(np.mean([each.force for each in measured]))
                name = f"{law}, {toughness:g} J/m², {' × '.join(map(str, cells))} cells"
                checks += check_steady_cuts(name, measured, toughness)
                if law == "neo_hookean":
                    curves += _curves(measured[-1].record, toughness, cells)
            apart = float(means[1] / means[0] - 1.0)
            checks.append(_LINES["meshes"].check(f"{law}, {toughness:g} J/m²", apart))
    title = f"Steady cuts through {THICKNESS * 1e3:g} mm of neo-Hookean solid"
    plot = Plot(title, "edge along the block [mm]", "force [N]", curves)
    return Findings(checks, [plot])


def steady_material(law: str, toughness: float) -> Material:
    """Return the material of the block, of a law and a toughness [J/m2]."""
    more = {"stiffening": _STIFFENING} if law == "exponential" else {}
    return soft_material(law, young_modulus=STEADY_YOUNG_MODULUS, toughness=toughness, **more)


def _curves(record: StrokeRecord, toughness: float, cells: tuple[int, int, int]) -> list[Curve]:
    """Return the curve of a cut, with the theory after that on the finer mesh."""
    name = f"{toughness:g} J/m², {' × '.join(map(str, cells))} cells"
    x = record.y * 1e3
    curve = Curve(name, x, record.resistance)
    if cells == STEADY_CELLS[0]:
        return [curve]
    theory = np.full(2, toughness * THICKNESS)
    return [curve, Curve("", x[[0, -1]], theory, is_theory=True)]
