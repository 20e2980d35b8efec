"""Slicing against pressing: an edge that is drawn along itself meets less in the way it goes."""

import numpy as np

from scalpel_sim.validate.block import THICKNESS, Record, block_tissue, lead, rubber, through
from scalpel_sim.validate.findings import Curve, Findings, Known, Line, Plot, Scene, Source, within

TOUGHNESS = 20.0
"""[J/m2]."""
_STIFFNESS = 30e3
"""Young's modulus [Pa]."""
_HELD = "left,right,bottom"
"""So that the block is not drawn down with the edge."""
_NEAR = 0.10
"""How far the normal force may be off: the issue's bound for 45 degrees."""
_SLOW, FAST = 0.02, 0.05
"""[m/s]."""
STICKS = Known(
    0.9,
    1.6,
    "an edge that is drawn along steeply and slowly sticks and slips: the mean force in the way of "
    "the edge is then up to half above theory, the work a tenth; that along the edge is right",
)
"""Measured at a ratio of 2 and 20 mm/s."""


def normal_force(toughness: float, ratio: float) -> float:
    """Theory [N]: Fn = toughness × depth / (1 + ratio^2)."""
    return toughness * THICKNESS / (1.0 + ratio**2)


def cut(ratio: float, speed: float) -> Record:
    """Cut through the block while the edge is drawn down by `ratio` of its way."""
    material = rubber(young_modulus=_STIFFNESS, toughness=TOUGHNESS)
    return lead(block_tissue(material, held=_HELD), through(speed, ratio=ratio))


def judge(ratio: float, speed: float, record: Record, toughness: float) -> list[Line]:
    """Return the lines of a slicing cut through a body of that toughness [J/m2]."""
    theory = normal_force(toughness, ratio)
    across = float(record.of_steady(record.resistance).mean())
    along = float(record.of_steady(record.force[:, 2]).mean())
    name = f"ratio {ratio:g}, {speed * 1e3:g} mm/s"
    known = STICKS if ratio > 1.0 and speed < FAST else None
    lines = [
        Line(f"{name}: normal force over theory", across / theory, *within(_NEAR), known=known)
    ]
    if ratio > 0.0:
        share = along / (ratio * theory)
        lines.append(Line(f"{name}: force along the edge over theory", share, *within(_NEAR)))
    return lines


def measure(quick: bool) -> Findings:
    """Press, and slice with ratios of 0.5, 1 and 2 of the speed along the edge to that across."""
    ratios = (0.0, 1.0) if quick else (0.0, 0.5, 1.0, 2.0)
    lines: list[Line] = []
    measured = []
    for ratio in ratios:
        record = cut(ratio, FAST)
        lines += judge(ratio, FAST, record, TOUGHNESS)
        measured.append(
            (
                record.of_steady(record.resistance).mean(),
                record.of_steady(record.force[:, 2]).mean(),
            )
        )
    if not quick:
        lines += judge(2.0, _SLOW, cut(2.0, _SLOW), TOUGHNESS)
    return Findings(lines, [_plot(np.array(ratios), np.array(measured))])


def _plot(ratios: np.ndarray, measured: np.ndarray) -> Plot:
    finely = np.linspace(0.0, ratios[-1], 50)
    theory = TOUGHNESS * THICKNESS / (1.0 + finely**2)
    curves = [
        Curve("normal force", ratios, measured[:, 0]),
        Curve("", finely, theory, is_theory=True),
        Curve("force along the edge", ratios, measured[:, 1]),
        Curve("", finely, finely * theory, is_theory=True),
    ]
    return Plot("Slicing", "speed along the edge / speed across it", "force [N]", curves)


SCENE = Scene(
    name="slicing",
    title="Slicing against pressing",
    about=(
        "The edge is drawn along itself while it cuts. Work goes into area alone, so that with a "
        "ratio xi of the two speeds the normal force is toughness × depth / (1 + xi²), and that "
        "along the edge xi times as much: at 45 degrees (xi = 1) half, which is why one slices."
    ),
    measure=measure,
    sources=[
        Source(
            "Atkins, Xu and Jeronimidis 2004, J. Mater. Sci. 39:2761; Atkins, PMC4843631",
            "the two forces as functions of the slice/push ratio, and experiments with cheddar "
            "and salami that follow them",
            is_confirmed=False,
        )
    ],
)
