"""The cutting force at higher speed, and with a blunt edge."""

import numpy as np

from scalpel_sim.validate.block import (
    THICKNESS,
    block_tissue,
    run_stroke,
    soft_material,
    straight_cut,
)
from scalpel_sim.validate.findings import Curve, Findings, Plot, lines_of
from tissue import BladeShape

_LINES = lines_of("rate")
_SLOW_TOUGHNESS = 10.0
"""Toughness of a slow cut, J0 [J/m2]."""
_DOUBLING_SPEED = 0.1
"""Speed at which the toughness is twice J0, v0 [m/s]."""
_EXPONENT = 0.5
"""Exponent n of the speed."""
_STIFFNESS = 30e3
"""Young's modulus [Pa]."""
_WORK_TO_RUPTURE = 1e5
"""Work to rupture, W [J/m3]."""


def _theory(speed: float) -> float:
    """Return the toughness at a speed by theory [J/m2]: J0 (1 + (v / v0)^n)."""
    return float(_SLOW_TOUGHNESS * (1.0 + (speed / _DOUBLING_SPEED) ** _EXPONENT))


def _force_at_speed(speed: float) -> float:
    """Cut through the block at a speed [m/s]; return the mean force [N]."""
    material = soft_material(
        young_modulus=_STIFFNESS,
        toughness=_SLOW_TOUGHNESS,
        toughness_exponent=_EXPONENT,
        toughness_speed=_DOUBLING_SPEED,
    )
    record = run_stroke(block_tissue(material), straight_cut(speed))
    return record.steady_resistance


def _force_of_edge(radius: float) -> float:
    """Cut through the block with an edge of a radius [m]; return the mean force [N]."""
    material = soft_material(
        young_modulus=_STIFFNESS, toughness=_SLOW_TOUGHNESS, work_to_rupture=_WORK_TO_RUPTURE
    )
    thin = BladeShape(thickness=1e-5, edge_radius=radius)  # so that its faces push nothing apart
    record = run_stroke(block_tissue(material, blade=thin), straight_cut(_DOUBLING_SPEED))
    return record.steady_resistance


def measure_rate(quick: bool) -> Findings:
    """Cut at four speeds, and with edges of three radii."""
    speeds = np.array([0.05, 0.2] if quick else [0.02, 0.05, 0.1, 0.2])
    radii = np.array([50e-6] if quick else [0.0, 25e-6, 50e-6])
    fast = np.array([_force_at_speed(v) for v in speeds]) / THICKNESS
    checks = [
        _LINES["speed"].check(f"{v * 1e3:g} mm/s", force_per_depth / _theory(v))
        for v, force_per_depth in zip(speeds, fast, strict=True)
    ]
    for radius in radii:
        theory = (_SLOW_TOUGHNESS + 2.0 * radius * _WORK_TO_RUPTURE) * THICKNESS
        share = _force_of_edge(radius) / theory
        checks.append(_LINES["edge"].check(f"edge of {radius * 1e6:g} µm", share))
    finely = np.linspace(0.0, speeds[-1], 100)
    curves = [
        Curve("measured", speeds * 1e3, fast),
        Curve("", finely * 1e3, np.array([_theory(v) for v in finely]), is_theory=True),
    ]
    plot = Plot("Toughness by speed", "speed [mm/s]", "force / depth [N/m = J/m²]", curves)
    return Findings(checks, [plot])
