"""Steady cutting: the force is toughness times depth at any speed, on any mesh, under any law."""

import itertools
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from scalpel_sim.validate.block import (
    COARSE_CELLS,
    CUT_X,
    FINE_CELLS,
    THICKNESS,
    StrokeRecord,
    block_tissue,
    run_stroke,
    soft_material,
    straight_cut,
)
from scalpel_sim.validate.findings import (
    REGRESSION,
    THEORY,
    Check,
    Curve,
    Findings,
    Plot,
    Reference,
    ValidationScene,
    within,
)
from tissue import Law, Material

STEADY_YOUNG_MODULUS = 30e3
"""Young's modulus [Pa], high enough for tetrahedra of both meshes and all three toughnesses
(`tissue.input_checks.TOUGHEST`): at 60 J/m2 toughness over modulus is 2 mm, and the node
spacing of the finer mesh is 2.4 mm. For springs it is high enough for the lowest toughness."""
_NEAR = 0.05
"""Largest relative error of the force."""
_LARGEST_RIPPLE = 0.10
"""Largest standard deviation of the force over its mean."""
_MOST_APART = 0.05
"""Largest relative difference between the forces on the two meshes."""
STEADY_CUTS = ((CUT_X, 0.05), (0.0187, 0.1), (0.0225, 0.1))
"""Positions of the cuts across the block [m], between planes of both meshes, and speeds [m/s]."""


class SteadyCut(NamedTuple):
    """The force of a steady cut."""

    record: StrokeRecord
    force: float
    """Mean force [N]."""
    ripple: float
    """Standard deviation of the force over its mean."""


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
    record = run_stroke(block_tissue(material, cells), straight_cut(speed, x=x))
    force = record.steady_rows(record.resistance)
    return SteadyCut(record, float(force.mean()), float(force.std() / force.mean()))


def check_steady_cuts(name: str, measured: Sequence[SteadyCut], toughness: float) -> list[Check]:
    """Return the checks of the worst of several cuts.

    Args:
        name: Name of the block.
        measured: The cuts.
        toughness: Toughness of the block [J/m2].
    """
    shares = [each.force / (toughness * THICKNESS) for each in measured]
    worst = max(shares, key=lambda share: abs(share - 1.0))
    ripple = max(each.ripple for each in measured)
    return [
        Check(f"{name}: force / (toughness × depth)", worst, *within(_NEAR), basis=REGRESSION),
        Check(f"{name}: ripple", ripple, 0.0, _LARGEST_RIPPLE, basis=THEORY),
    ]


def _measure(quick: bool) -> Findings:
    """Cut with three toughnesses, two speeds, two meshes and both laws, at several positions."""
    toughnesses = (20.0,) if quick else (5.0, 20.0, 60.0)
    cuts = STEADY_CUTS[1:2] if quick else STEADY_CUTS
    laws: tuple[Law, ...] = ("neo_hookean", "springs")
    checks, curves = [], []
    for law, toughness in itertools.product(laws, toughnesses):
        material = soft_material(law, young_modulus=STEADY_YOUNG_MODULUS, toughness=toughness)
        means = []
        for cells in (COARSE_CELLS, FINE_CELLS):
            measured = [cut_steadily(material, cells, x, speed) for x, speed in cuts]
            means.append(np.mean([each.force for each in measured]))
            name = f"{law}, {toughness:g} J/m², {' × '.join(map(str, cells))} cells"
            checks += check_steady_cuts(name, measured, toughness)
            if law == "neo_hookean":
                curves += _curves(measured[0].record, toughness, cells)
        apart = float(means[1] / means[0] - 1.0)
        name = f"{law}, {toughness:g} J/m²: force in the fine mesh / in the coarse mesh - 1"
        checks.append(Check(name, apart, -_MOST_APART, _MOST_APART, basis=THEORY))
    title = f"Steady cuts through {THICKNESS * 1e3:g} mm of neo-Hookean solid"
    plot = Plot(title, "edge along the block [mm]", "force [N]", curves)
    return Findings(checks, [plot])


def _curves(record: StrokeRecord, toughness: float, cells: tuple[int, int, int]) -> list[Curve]:
    """Return the curve of a cut, with the theory after that on the finer mesh."""
    name = f"{toughness:g} J/m², {' × '.join(map(str, cells))} cells"
    x = record.y * 1e3
    curve = Curve(name, x, record.resistance)
    if cells == COARSE_CELLS:
        return [curve]
    theory = np.full(2, toughness * THICKNESS)
    return [curve, Curve("", x[[0, -1]], theory, is_theory=True)]


STEADY_SCENE = ValidationScene(
    name="steady",
    title="Steady cutting force",
    about=(
        "An upright edge cuts through a block that is held left and right, and the mean force "
        "while its whole length is in the block is compared with toughness × depth: all work goes "
        "into area. The force must depend on neither speed nor mesh, else a policy learns the "
        "mesh. Each value is the worst of three cuts between the planes of the mesh, at 50 and 100 "
        "mm/s; ripple is the standard deviation of the force over its mean. Young's modulus is 30 "
        "kPa, at which "
        "neo-Hookean tetrahedra bear these toughnesses; springs bear 5 J/m² only, and fail above. "
        "That the toughness comes back is a regression; that speed and mesh change nothing is not."
    ),
    measure=_measure,
    references=[
        Reference(
            "Mahvash and Hayward 2001, Haptics-e 2(3)",
            "work of the tool = toughness × area + change of elastic energy; in steady cutting the "
            "force is toughness × width, whatever the stiffness",
            is_confirmed=False,
        )
    ],
)
