"""What an edge costs more: at speed, and where it is blunt."""

import numpy as np

from scalpel_sim.validate.block import THICKNESS, block_tissue, lead, rubber, through
from scalpel_sim.validate.findings import Curve, Findings, Line, Plot, Scene, Source, within
from tissue import BladeShape

_SLOW_TOUGHNESS, TWICE_AT, EXPONENT = 10.0, 0.1, 0.5
"""[J/m2], [m/s]."""
_STIFFNESS = 30e3
"""Young's modulus [Pa]."""
RUPTURE = 1e5
"""Work to rupture [J/m3]."""
_NEAR = 0.05


def toughness(speed: float) -> float:
    """Theory [J/m2]: J0 (1 + (v / v0)^n)."""
    return _SLOW_TOUGHNESS * (1.0 + (speed / TWICE_AT) ** EXPONENT)


def force_at(speed: float) -> float:
    """Cut through at that speed [m/s], and return the mean force [N]."""
    material = rubber(
        young_modulus=_STIFFNESS,
        toughness=_SLOW_TOUGHNESS,
        toughness_exponent=EXPONENT,
        toughness_speed=TWICE_AT,
    )
    record = lead(block_tissue(material), through(speed))
    return float(record.of_steady(record.resistance).mean())


def force_of(radius: float) -> float:
    """Cut through with an edge of that radius [m], and return the mean force [N]."""
    material = rubber(young_modulus=_STIFFNESS, toughness=_SLOW_TOUGHNESS, work_to_rupture=RUPTURE)
    thin = BladeShape(thickness=1e-5, edge_radius=radius)  # its faces push nothing apart
    record = lead(block_tissue(material, blade=thin), through(TWICE_AT))
    return float(record.of_steady(record.resistance).mean())


def measure(quick: bool) -> Findings:
    """Cut at three speeds, and with edges of three radii."""
    speeds = np.array([0.05, 0.2] if quick else [0.02, 0.05, 0.1, 0.2])
    radii = np.array([50e-6] if quick else [0.0, 25e-6, 50e-6])
    fast = np.array([force_at(v) for v in speeds]) / THICKNESS
    lines = [
        Line(f"{v * 1e3:g} mm/s: force / (toughness at that speed × depth)",
             f / toughness(v), *within(_NEAR))
        for v, f in zip(speeds, fast, strict=True)
    ]  # fmt: skip
    for radius in radii:
        theory = (_SLOW_TOUGHNESS + 2.0 * radius * RUPTURE) * THICKNESS
        name = f"edge of {radius * 1e6:g} µm: force / ((toughness + 2 r W) × depth)"
        lines.append(Line(name, force_of(radius) / theory, *within(_NEAR)))
    finely = np.linspace(0.0, speeds[-1], 100)
    curves = [
        Curve("measured", speeds * 1e3, fast),
        Curve("", finely * 1e3, np.array([toughness(v) for v in finely]), is_theory=True),
    ]
    plot = Plot("Toughness by speed", "speed [mm/s]", "force / depth [N/m = J/m²]", curves)
    return Findings(lines, [plot])


SCENE = Scene(
    name="rate",
    title="Speed and bluntness of the edge",
    about=(
        "The force of a steady cut against toughness × depth, where toughness rises with the speed "
        "of the edge, J0 (1 + (v / v0)^n); and where the edge has a radius r and tissue a work to "
        "rupture W, which adds 2 r W."
    ),
    measure=measure,
    sources=[
        Source(
            "Zhang and Hutchens 2021, Soft Matter 17:6728",
            "the energy that cutting takes is linear in the radius of the edge; the slope is of "
            "the order of twice the work to rupture",
            is_confirmed=False,
        )
    ],
)
