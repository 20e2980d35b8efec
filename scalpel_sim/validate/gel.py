"""Gels against published experiments: toughness by speed, and two scalpel blades."""

import numpy as np

from scalpel_sim.validate.block import (
    CUT_X,
    DT,
    LENGTH,
    THICKNESS,
    block_tissue,
    edge_at,
    run_stroke,
    soft_material,
    straight_cut,
)
from scalpel_sim.validate.findings import Curve, Findings, Plot, lines_of
from tissue import MATERIALS, BladeShape, FloatArray

_LINES = lines_of("gel")
_SLOW_TOUGHNESS = 1.1
"""Toughness of gelatine of 10 % by weight, cut slowly [J/m2]."""
_SLOW = 10e-3 / 60.0
"""Speed up to which the toughness is constant [m/s]: 10 mm/min."""
_SLOPE = 0.5
"""Slope of the logarithm of toughness over that of speed, at higher speeds."""

_DEPTH_10 = 0.52 / 160.0
"""Depth of blade 10 [m], from its total force of 0.52 N and 0.16 N/mm."""
_FORCE_12 = 1.17
"""Force on blade 12, the largest of the four [N]."""
_MOST_PER_DEPTH = 190.0
"""Largest force / depth of blades 10, 11, 12 and 15 [N/m]."""
_APPARENT_TOUGHNESS = 160.0
"""Apparent toughness with blade 10 [J/m2]: the one figure that is taken from the experiment."""
_PHANTOM_STIFFNESS = 100e3
"""Young's modulus [Pa]. Not published; a steady force does not depend on it."""


def published_toughness(speed: float) -> float:
    """Return the toughness of gelatine at a speed [J/m2], as Forte et al. measured it."""
    return float(_SLOW_TOUGHNESS * max(speed / _SLOW, 1.0) ** _SLOPE)


def _own_toughness(speed: float) -> float:
    """Return the toughness of the preset at a speed [J/m2]."""
    gelatin = MATERIALS["gelatin"].material
    ratio = speed / gelatin.toughness_speed
    return float(gelatin.toughness * (1.0 + ratio**gelatin.toughness_exponent))


def _force_per_depth(speed: float) -> float:
    """Cut gelatine at a speed [m/s]; return force / depth [N/m]."""
    end = 0.75 * LENGTH if speed > 0.01 else 0.5 * LENGTH
    record = run_stroke(
        block_tissue(MATERIALS["gelatin"].material), straight_cut(speed, begin=-0.001, end=end)
    )
    return record.steady_resistance / THICKNESS


def _phantom_force_per_depth(depth: float) -> float:
    """Draw the tip of a scalpel through the top of a phantom; return force / depth [N/m]."""
    material = soft_material(young_modulus=_PHANTOM_STIFFNESS, toughness=_APPARENT_TOUGHNESS)
    y = np.arange(-0.003, 0.75 * LENGTH, 0.1 * DT)
    poses = [edge_at((CUT_X, at, THICKNESS - depth), length=depth + 0.01) for at in y]
    record = run_stroke(block_tissue(material, held="bottom", blade=BladeShape()), poses)
    return record.steady_resistance / depth


def measure_gel(quick: bool) -> Findings:
    """Cut gelatine at several speeds, and a phantom with two blades."""
    speeds = np.array([0.1] if quick else [1.0 / 60.0, 0.03, 0.05, 0.1, 0.2])
    forces = np.array([_force_per_depth(v) for v in speeds])
    checks = [
        _LINES[key].check(f"gelatine, {v * 60e3:,.0f} mm/min", f / toughness(v))
        for key, toughness in (("published", published_toughness), ("own_law", _own_toughness))
        for v, f in zip(speeds, forces, strict=True)
    ]
    depth_12 = _FORCE_12 / _MOST_PER_DEPTH
    for name, depth in (("10", _DEPTH_10), ("12", depth_12))[: 1 if quick else 2]:
        share = _phantom_force_per_depth(depth) / _APPARENT_TOUGHNESS
        case = f"phantom, blade {name}, {depth * 1e3:.2f} mm deep"
        checks.append(_LINES["phantom"].check(case, share))
    return Findings(checks, [_plot(speeds, forces)])


def _plot(speeds: FloatArray, forces: FloatArray) -> Plot:
    """Return the plot of force / depth over speed."""
    finely = np.geomspace(_SLOW / 10.0, speeds[-1], 100)
    x = np.log10(finely * 60e3)
    curves = [
        Curve("measured in the simulation", np.log10(speeds * 60e3), np.log10(forces)),
        Curve("Forte et al., wires: 1.1 J/m², then slope 0.5", x,
              np.log10([published_toughness(v) for v in finely]), is_theory=True),
    ]  # fmt: skip
    return Plot(
        "Gelatine of 10 %: toughness by speed",
        "log10 of speed [mm/min]",
        "log10 of force / depth [J/m²]",
        curves,
    )
