"""Bars that are stretched: of each law against its formula, and of silicone against a curve."""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq

from scalpel_sim.validate.findings import Check, Curve, Findings, Plot, farthest_from_one, lines_of
from tissue import (
    MATERIALS,
    Exponential,
    FloatArray,
    Law,
    Material,
    Tissue,
    Yeoh,
    block,
    fixed_nodes,
)

_LINES = lines_of("stretch")
_SIZE, _CELLS = (0.04, 0.02, 0.02), (8, 4, 4)
"""Sides of the bar [m], and cells along them."""
_STIFFNESS = 10e3
"""Young's modulus [Pa]."""
_RATIO = 0.45
"""Poisson's ratio."""
_LONGEST = 2.0
"""Stretch at the end."""
_N_STEPS, _DT = 400, 1e-3
"""Steps of the stretch, and their length [s]."""
_EVERY = 40
"""Steps between two points of the curve, at which the bar comes to rest."""

_BAR = Material(_STIFFNESS, poisson_ratio=_RATIO, law="neo_hookean", viscous_damping=50.0)
"""The bar that does not stiffen; waves in it die away."""
BARS: dict[str, Material] = {
    "neo_hookean": _BAR,
    "exponential": replace(_BAR, law=Exponential(1.0)),
    "yeoh": replace(_BAR, law=Yeoh(0.3, 0.05)),
}
"""The material of the bar of each law; two stiffen several times at twice its length."""

EnergyOf = Callable[[float, float, float], float]
"""Energy per volume [Pa] of three stretches at right angles."""


class UniaxialStretch(NamedTuple):
    """A bar that is stretched, its sides free."""

    stretch: FloatArray
    """Length over that at rest."""
    stress: FloatArray
    """Force over the section at rest [Pa]."""
    width: FloatArray
    """Width over that at rest."""


def energy_of(material: Material) -> EnergyOf:
    """Return the energy of a homogeneous stretch, as the papers of the laws have it."""
    mu, lam = material.mu, material.lam

    def stable_neo_hookean(*stretches: float) -> float:
        own, volume = 4.0 / 3.0 * mu, lam + 5.0 / 6.0 * mu
        squared, ratio = _squared(*stretches), math.prod(stretches)
        shear = 0.5 * own * ((squared - 3.0) - np.log(squared + 1.0))
        return float(shear + 0.5 * volume * (ratio - 1.0 - 0.75 * own / volume) ** 2)

    def stiffening(*stretches: float) -> float:
        ratio = math.prod(stretches)
        q = _squared(*stretches) - 1.0 - 2.0 * ratio
        return float(
            0.5 * mu * _stretch_energy(material.law, q) + 0.5 * (lam + mu) * (ratio - 1.0) ** 2
        )

    return stiffening if material.stiffens else stable_neo_hookean


def _squared(*stretches: float) -> float:
    """Return the sum of the squares."""
    return sum(stretch**2 for stretch in stretches)


def _stretch_energy(law: Law, q: float) -> float:
    """Return w(q) of a law that stiffens."""
    if isinstance(law, Exponential):
        return float(np.expm1(law.b * q) / law.b)
    if isinstance(law, Yeoh):
        return q + law.c2 * q**2 + law.c3 * q**3
    raise ValueError(f"law {law.name} is not one of those that are compared")


def uniaxial(material: Material, stretches: FloatArray) -> UniaxialStretch:
    """Return stress and width of a bar whose sides bear no load, from the energy alone."""
    energy, h = energy_of(material), 1e-5

    def slope_across(across: float, along: float) -> float:
        wide, narrow = across + h, across - h
        return (energy(along, wide, wide) - energy(along, narrow, narrow)) / (2.0 * h)

    widths = [float(brentq(slope_across, 0.3, 1.2, args=(along,))) for along in stretches]
    stresses = [
        (energy(along + h, width, width) - energy(along - h, width, width)) / (2.0 * h)
        for along, width in zip(stretches.tolist(), widths, strict=True)
    ]
    return UniaxialStretch(stretches, np.array(stresses), np.array(widths))


def stretched_bar(material: Material, longest: float = _LONGEST) -> UniaxialStretch:
    """Stretch a bar in ten equal parts; return its force and the width of its middle after each.

    Its ends are made as narrow as the theory says, so that all of it is stretched equally if the
    engine agrees. The rest of its width is free.

    Args:
        material: What it is made of.
        longest: Length at the end over that at rest.
    """
    mesh = block(_CELLS, _SIZE)
    middle = 0.5 * np.array(_SIZE)
    ends = fixed_nodes(mesh, "left,right")
    tissue = Tissue(mesh, material, fixed=ends, gravity=(0.0, 0.0, 0.0))
    right, nodes = fixed_nodes(mesh, "right"), np.flatnonzero(ends)
    side = tissue.material_points([(middle[0], 0.0, middle[2]), (middle[0], _SIZE[1], middle[2])])
    goals = uniaxial(material, np.linspace(1.0, longest, _N_STEPS + 1))
    from_middle = (mesh.positions - middle)[nodes]
    places = [
        middle + from_middle * (along, width, width)
        for along, width in zip(goals.stretch, goals.width, strict=True)
    ]
    rows = []
    for i in range(_N_STEPS):
        tissue.move_supports(nodes, (places[i + 1] - places[i]) / _DT)
        tissue.step(None, _DT)
        if (i + 1) % _EVERY == 0:
            tissue.settle()
            force = tissue.support_forces()[right].sum(axis=0)[0]
            low, high = tissue.positions_of(side)[:, 1]
            rows.append(
                (goals.stretch[i + 1], force / (_SIZE[1] * _SIZE[2]), (high - low) / _SIZE[1])
            )
    return UniaxialStretch(*np.array(rows).T)


def check_stretch(name: str, found: UniaxialStretch, theory: UniaxialStretch) -> list[Check]:
    """Return the checks of a bar: the worst of its points."""
    shares = {"force": found.stress / theory.stress, "width": found.width / theory.width}
    return [
        _LINES[key].check(f"{name}, to twice its length", farthest_from_one(share.tolist()))
        for key, share in shares.items()
    ]


def measure_stretch(quick: bool) -> Findings:
    """Stretch a bar of each law."""
    checks, curves = [], []
    laws: tuple[str, ...] = ("neo_hookean",) if quick else tuple(BARS)
    for law in laws:
        material = BARS[law]
        found = stretched_bar(material)
        checks += check_stretch(law, found, uniaxial(material, found.stretch))
        curves.append(Curve(law, found.stretch, found.stress * 1e-3))
        finely = uniaxial(material, np.linspace(1.0, _LONGEST, 60))
        curves.append(Curve("", finely.stretch, finely.stress * 1e-3, is_theory=True))
    title = "Bars of 10 kPa, stretched to twice their length"
    plot = Plot(title, "length / length at rest", "force / section at rest [kPa]", curves)
    return Findings(checks, [plot])


MEASURED = {
    0.5: 16.89e3,
    1.0: 29.72e3,
    1.5: 40.08e3,
    2.0: 52.39e3,
    2.5: 65.93e3,
    3.0: 80.15e3,
    3.5: 96.46e3,
    4.0: 114.76e3,
    4.5: 134.15e3,
    5.0: 156.68e3,
}
"""Strain of Ecoflex 00-30, and force over the section at rest [Pa]: the rows of the file at these
strains."""


def measure_tension(quick: bool) -> Findings:
    """Pull a bar of silicone, and compare it with the curve at each of its points."""
    found = stretched_bar(MATERIALS["silicone"].material, longest=1.0 + max(MEASURED))
    measured = np.array(list(MEASURED.values()))
    line = lines_of("tension")["force"]
    checks = [
        line.check(f"silicone, longer by {strain:.0%}", ours / published)
        for strain, ours, published in zip(MEASURED, found.stress, measured, strict=True)
    ]
    curves = [
        Curve("simulated", found.stretch - 1.0, found.stress * 1e-3),
        Curve("measured", np.array(list(MEASURED)), measured * 1e-3, is_theory=True),
    ]
    plot = Plot("Ecoflex 00-30 in tension", "strain", "force / section at rest [kPa]", curves)
    return Findings(checks, [plot])
