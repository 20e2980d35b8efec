"""Gels against published experiments: toughness by speed, and scalpels of two lengths."""

from dataclasses import replace

import numpy as np

from scalpel_sim.validate.block import (
    DT,
    LENGTH,
    MIDDLE,
    THICKNESS,
    block_tissue,
    edge,
    lead,
    rubber,
    through,
)
from scalpel_sim.validate.findings import Curve, Findings, Line, Plot, Scene, Source, within
from tissue import MATERIALS, BladeShape, FloatArray, Material

_SLOW_TOUGHNESS = 1.1
"""Of gelatine of 10 % by weight, cut slowly [J/m2]."""
_SLOW = 10e-3 / 60.0
"""Speed up to which that holds [m/s]: 10 mm/min."""
SLOPE = 0.5
"""Of toughness by speed above it, both as logarithms."""
_NEAR = 0.20
"""How far force / depth may be off: the specification's bound for gels."""

LEAST_10 = 0.52 / 160.0
"""Depth [m] at which blade 10 had 0.52 N in all and 0.16 N/mm."""
FORCE_12 = 1.17
"""[N]: the blade with the largest force, 12."""
PER_DEPTH = (160.0, 190.0)
"""Force / depth of blades 10, 11, 12 and 15 [N/m]."""
APPARENT = 160.0
"""Of blade 10 [J/m2]: the one figure that is taken from the experiment."""
PHANTOM_STIFFNESS = 100e3
"""Young's modulus [Pa]. Not published; a steady force does not depend on it."""


def published(speed: float) -> float:
    """Toughness of gelatine by speed [J/m2], as Forte et al. measured it with wires."""
    return _SLOW_TOUGHNESS * max(speed / _SLOW, 1.0) ** SLOPE


def gelatine() -> Material:
    """Return the gelatine of the presets, with the law of toughness of the paper."""
    return replace(
        MATERIALS["gelatin"].material,
        toughness=_SLOW_TOUGHNESS,
        toughness_exponent=SLOPE,
        toughness_speed=_SLOW,
    )


def force_per_depth(speed: float) -> float:
    """Cut gelatine at that speed [m/s], and return force / depth [N/m]."""
    end = 0.75 * LENGTH if speed > 0.01 else 0.5 * LENGTH
    record = lead(block_tissue(gelatine()), through(speed, begin=-0.001, end=end))
    return float(record.of_steady(record.resistance).mean() / THICKNESS)


def _slit(depth: float) -> float:
    """Draw the point of a scalpel through the top of a phantom; return force / depth [N/m]."""
    material = rubber(young_modulus=PHANTOM_STIFFNESS, toughness=APPARENT)
    y = np.arange(-0.003, 0.75 * LENGTH, 0.1 * DT)
    places = [edge((MIDDLE, at, THICKNESS - depth), length=depth + 0.01) for at in y]
    record = lead(block_tissue(material, held="bottom", blade=BladeShape()), places)
    return float(record.of_steady(record.resistance).mean() / depth)


def measure(quick: bool) -> Findings:
    """Cut gelatine at several speeds, and a phantom with two blades."""
    speeds = np.array([0.1] if quick else [1.0 / 60.0, 0.03, 0.05, 0.1])
    forces = np.array([force_per_depth(v) for v in speeds])
    lines = [
        Line(f"gelatine, {v * 60e3:,.0f} mm/min: force / depth over published toughness",
             f / published(v), *within(_NEAR))
        for v, f in zip(speeds, forces, strict=True)
    ]  # fmt: skip
    deep = FORCE_12 / PER_DEPTH[1]
    for name, depth in (("10", LEAST_10), ("12", deep))[: 1 if quick else 2]:
        figure = _slit(depth)
        lines.append(
            Line(f"phantom, blade {name}, {depth * 1e3:.2f} mm deep: force / depth",
                 figure, PER_DEPTH[0] * 0.95, PER_DEPTH[1], "N/m")
        )  # fmt: skip
    return Findings(lines, [_plot(speeds, forces)])


def _plot(speeds: FloatArray, forces: FloatArray) -> Plot:
    finely = np.geomspace(_SLOW / 10.0, speeds[-1], 100)
    x = np.log10(finely * 60e3)
    curves = [
        Curve("measured in the simulation", np.log10(speeds * 60e3), np.log10(forces)),
        Curve("Forte et al., wires: 1.1 J/m², then slope 0.5", x,
              np.log10([published(v) for v in finely]), is_theory=True),
    ]  # fmt: skip
    return Plot(
        "Gelatine of 10 %: toughness by speed",
        "log10 of speed [mm/min]",
        "log10 of force / depth [J/m²]",
        curves,
    )


SCENE = Scene(
    name="gel",
    title="Force against speed and depth: gels",
    about=(
        "Gelatine of 10 % is cut through at several speeds, with the toughness that Forte et al. "
        "measured with wires: constant up to 10 mm/min, with the root of speed above. Their range "
        "is taken to reach to 100 mm/s, which the abstract does not say. The law of the engine "
        "adds the two parts and so lies above theirs: by 10 % at 1,000 mm/min, by 4 % at 100 mm/s, "
        "and by a factor of 2 at the knee itself. Then scalpels 10 and 12 are drawn through a "
        "phantom at the depths that follow from their total force and force per length. The "
        "toughness is the apparent one of blade 10, faces and all, as the gel is not described; "
        "what is tested is that depth is all that tells the blades apart."
    ),
    measure=measure,
    sources=[
        Source(
            "Forte et al. 2015, 'Modelling and experimental characterisation of the rate dependent "
            "fracture properties of gelatine gels' (abstract)",
            "gelatine of 10 % by weight, wires: 1.1 J/m² up to 10 mm/min, above it a slope of 0.5 "
            "of the logarithms",
        ),
        Source(
            "'Modeling the cutting edge geometry of scalpel blades', doi:10.1177/0954405414567928 "
            "(abstract)",
            "phantom gel, steady force in all and per length: blade 10 0.52 N and 0.16 N/mm, the "
            "least; blade 12 1.17 N, blade 11 0.19 N/mm, the most",
        ),
    ],
)
