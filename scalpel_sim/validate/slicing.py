"""Slicing against pressing: an edge that is drawn along itself needs less normal force."""

import numpy as np

from scalpel_sim.validate.block import (
    THICKNESS,
    StrokeRecord,
    block_tissue,
    run_stroke,
    soft_material,
    straight_cut,
)
from scalpel_sim.validate.findings import (
    REGRESSION,
    Check,
    Curve,
    Findings,
    Plot,
    Reference,
    ValidationScene,
    within,
)
from tissue import FloatArray

SLICING_TOUGHNESS = 20.0
"""Toughness of the block [J/m2]."""
_STIFFNESS = 30e3
"""Young's modulus [Pa]."""
_HELD = "left,right,bottom"
"""Sides that are held: the bottom too, so that the block is not drawn down with the edge."""
_NEAR = 0.10
"""Largest relative error of either force."""
_SLOW, SLICING_SPEED = 0.02, 0.05
"""Speeds across the edge [m/s]."""


def _normal_force(toughness: float, ratio: float) -> float:
    """Return the normal force by theory [N]: toughness × depth / (1 + ratio^2)."""
    return toughness * THICKNESS / (1.0 + ratio**2)


def cut_by_slicing(ratio: float, speed: float) -> StrokeRecord:
    """Cut through the block with an edge that is drawn down.

    Args:
        ratio: Speed along the edge over the speed across it.
        speed: Speed across the edge [m/s].
    """
    material = soft_material(young_modulus=_STIFFNESS, toughness=SLICING_TOUGHNESS)
    return run_stroke(block_tissue(material, held=_HELD), straight_cut(speed, ratio=ratio))


def check_slicing(
    ratio: float, speed: float, record: StrokeRecord, toughness: float
) -> list[Check]:
    """Return the checks of a slicing cut.

    Args:
        ratio: Speed along the edge over the speed across it.
        speed: Speed across the edge [m/s].
        record: The cut.
        toughness: Toughness of the block [J/m2].
    """
    theory = _normal_force(toughness, ratio)
    across = float(record.steady_rows(record.resistance).mean())
    along = float(record.steady_rows(record.force[:, 2]).mean())
    name = f"ratio {ratio:g}, {speed * 1e3:g} mm/s"
    checks = [
        Check(
            f"{name}: normal force over theory", across / theory, *within(_NEAR), basis=REGRESSION
        )
    ]
    if ratio > 0.0:
        share = along / (ratio * theory)
        checks.append(
            Check(
                f"{name}: force along the edge over theory", share, *within(_NEAR), basis=REGRESSION
            )
        )
    return checks


def _measure(quick: bool) -> Findings:
    """Cut with ratios of 0, 0.5, 1 and 2 of the speed along the edge to that across it."""
    ratios = (0.0, 1.0) if quick else (0.0, 0.5, 1.0, 2.0)
    checks: list[Check] = []
    measured = []
    for ratio in ratios:
        record = cut_by_slicing(ratio, SLICING_SPEED)
        checks += check_slicing(ratio, SLICING_SPEED, record, SLICING_TOUGHNESS)
        measured.append(
            (
                record.steady_rows(record.resistance).mean(),
                record.steady_rows(record.force[:, 2]).mean(),
            )
        )
    if not quick:
        checks += check_slicing(2.0, _SLOW, cut_by_slicing(2.0, _SLOW), SLICING_TOUGHNESS)
    return Findings(checks, [_plot(np.array(ratios), np.array(measured))])


def _plot(ratios: FloatArray, measured: FloatArray) -> Plot:
    """Return the plot of both forces over the ratio."""
    finely = np.linspace(0.0, ratios[-1], 50)
    theory = SLICING_TOUGHNESS * THICKNESS / (1.0 + finely**2)
    curves = [
        Curve("normal force", ratios, measured[:, 0]),
        Curve("", finely, theory, is_theory=True),
        Curve("force along the edge", ratios, measured[:, 1]),
        Curve("", finely, finely * theory, is_theory=True),
    ]
    return Plot("Slicing", "speed along the edge / speed across it", "force [N]", curves)


SLICING_SCENE = ValidationScene(
    name="slicing",
    title="Slicing against pressing",
    about=(
        "The edge is drawn along itself while it cuts. All work goes into area, so that with a "
        "ratio xi of the two speeds the normal force is toughness × depth / (1 + xi²), and the "
        "force along the edge xi times as much: at 45 degrees (xi = 1) the normal force is half "
        "that of pressing, which is why one slices. The samples of the edge "
        "slip along their pull, which yields this theory: the lines are regressions of that law."
    ),
    measure=_measure,
    references=[
        Reference(
            "Atkins, Xu and Jeronimidis 2004, J. Mater. Sci. 39:2761; Atkins, PMC4843631",
            "the two forces as functions of the slice/push ratio, and experiments with cheddar "
            "and salami that follow them",
            is_confirmed=False,
        )
    ],
)
