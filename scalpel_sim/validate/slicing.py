"""Slicing against pressing: an edge that is drawn along itself needs less normal force."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from scalpel_sim.validate.block import (
    CUT_X,
    THICKNESS,
    block_tissue,
    run_stroke,
    soft_material,
    straight_cut,
)
from scalpel_sim.validate.findings import Check, Curve, Findings, Plot, farthest_from_one, lines_of
from tissue import FloatArray

_LINES = lines_of("slicing")
SLICING_TOUGHNESS = 20.0
"""Toughness of the block [J/m2]."""
_STIFFNESS = 30e3
"""Young's modulus [Pa]."""
_HELD = "left,right,bottom"
"""Sides that are held: the bottom too, so that the block is not drawn down with the edge."""
_PLACES = (CUT_X, 0.0187, 0.0225)
"""Positions of the cuts across the block [m]: three places across an element."""
_SLOW, SLICING_SPEED = 0.02, 0.05
"""Speeds across the edge [m/s]."""
_CHATTER, _DAMPED = 75.0, 0.1
"""Frequency at which an edge chatters that slides faster than it is pushed [Hz], and a damping
ratio there at which it does not."""


def _normal_force(toughness: float, ratio: float) -> float:
    """Return the normal force by theory [N]: toughness × depth / (1 + ratio^2)."""
    return toughness * THICKNESS / (1.0 + ratio**2)


class SlicingForces(NamedTuple):
    """Mean forces of a steady slicing cut."""

    across: float
    """Force against the motion across the edge [N]."""
    along: float
    """Force along the edge [N]."""


def cut_by_slicing(
    ratio: float, speed: float, x: float = CUT_X, damping: float | None = None
) -> SlicingForces:
    """Cut through the block with an edge that is drawn down.

    Args:
        ratio: Speed along the edge over the speed across it.
        speed: Speed across the edge [m/s].
        x: Position of the cut across the block [m].
        damping: Damping ratio of the block at `_CHATTER`; None for that of any soft material.
    """
    material = soft_material(young_modulus=_STIFFNESS, toughness=SLICING_TOUGHNESS)
    if damping is not None:
        material = material.with_damping(damping, _CHATTER)
    poses = straight_cut(speed, ratio=ratio, x=x)
    record = run_stroke(block_tissue(material, held=_HELD), poses)
    along = float(record.steady_rows(record.force[:, 2]).mean())
    return SlicingForces(record.steady_resistance, along)


def check_slicing(
    ratio: float,
    speed: float,
    measured: Sequence[SlicingForces],
    toughness: float,
    is_damped: bool = False,
) -> list[Check]:
    """Return the checks of the worst of several slicing cuts.

    Args:
        ratio: Speed along the edge over the speed across it.
        speed: Speed across the edge [m/s].
        measured: The cuts.
        toughness: Toughness of the block [J/m2].
        is_damped: Whether the block is, so that the edge does not chatter.
    """
    theory = _normal_force(toughness, ratio)
    name = f"ratio {ratio:g}, {speed * 1e3:g} mm/s" + (", damped" if is_damped else "")
    chatters = ratio > 1.0 and not is_damped
    across = farthest_from_one([each.across / theory for each in measured])
    checks = [_LINES["chatter" if chatters else "normal"].check(name, across)]
    if ratio > 0.0:
        along = farthest_from_one([each.along / (ratio * theory) for each in measured])
        checks.append(_LINES["along"].check(name, along))
    return checks


def measure_slicing(quick: bool) -> Findings:
    """Cut with ratios of 0, 0.5, 1 and 2 of the speed along the edge to that across it."""
    ratios = (0.0, 1.0) if quick else (0.0, 0.5, 1.0, 2.0)
    places = _PLACES[:1] if quick else _PLACES
    checks: list[Check] = []
    at_first = []
    for ratio in ratios:
        measured = [cut_by_slicing(ratio, SLICING_SPEED, x) for x in places]
        checks += check_slicing(ratio, SLICING_SPEED, measured, SLICING_TOUGHNESS)
        at_first.append(measured[0])
    if not quick:
        slow = [cut_by_slicing(2.0, _SLOW)]
        checks += check_slicing(2.0, _SLOW, slow, SLICING_TOUGHNESS)
        damped = [cut_by_slicing(2.0, SLICING_SPEED, x, _DAMPED) for x in places]
        checks += check_slicing(2.0, SLICING_SPEED, damped, SLICING_TOUGHNESS, is_damped=True)
    return Findings(checks, [_plot(np.array(ratios), np.array(at_first))])


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
