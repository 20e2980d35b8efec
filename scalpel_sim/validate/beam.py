"""A clamped bar: its sag under its weight and under a load at its tip, and the period of its swing.

The beam is Timoshenko's: bending and shear, with rotary inertia, of a square section.
"""

import itertools
import math
from typing import NamedTuple

import numpy as np
from scipy.linalg import eigh

from scalpel_sim.validate.findings import (
    THEORY,
    Check,
    Curve,
    Findings,
    Plot,
    Reference,
    ValidationScene,
    within,
)
from tissue import FloatArray, Material, SolverSettings, Tissue, block, fixed_nodes

BAR_LENGTH, BAR_THICKNESS = 0.1, 0.03
"""Length of the bar and sides of its section [m]."""
CELLS_ACROSS = (3, 6)
"""Cells through the thickness, of two meshes."""
_RATIOS = (0.0, 0.45)
"""Poisson's ratios."""
_STIFFNESS, _DENSITY = 1e6, 1000.0
"""Young's modulus [Pa] and density [kg/m3]: the tip sags by 2 % of the length, and a beam whose
deflection is small is what the theory is about."""
_NEAR = 0.03
"""Largest relative error of sag and period."""
_N_PERIODS = 2.5
"""Periods of the swing that is followed."""
_DT = 1e-3
"""Time between two samples of the swing [s]."""
_GRAVITY = 9.81
"""[m/s2]."""
_N_ELEMENTS = 100
"""Elements of the beam of the theory: its period is then right to 1e-4."""


class BeamTheory(NamedTuple):
    """What Timoshenko's beam does."""

    sag_of_weight: float
    """Deflection of the tip under its own weight [m]."""
    sag_of_load: float
    """Deflection of the tip under a load there, as large as the weight [m]."""
    period: float
    """Period of the first mode of bending [s]."""


class BarMotion(NamedTuple):
    """What the bar does."""

    sag_of_weight: float
    """Deflection of the tip under its own weight [m]."""
    sag_of_load: float
    """Deflection of the tip under a load there, as large as the weight [m]."""
    period: float
    """Period of the swing after the load is let go [s]."""
    time: FloatArray
    """Times of the swing [s]."""
    height: FloatArray
    """Height of the tip above its rest [m]."""


def beam_theory(poisson_ratio: float) -> BeamTheory:
    """Return what a beam with the bar's measures does."""
    length, side = BAR_LENGTH, BAR_THICKNESS
    bending = _STIFFNESS * side**4 / 12.0
    # Cowper 1966: the shear coefficient of a rectangle.
    coefficient = 10.0 * (1.0 + poisson_ratio) / (12.0 + 11.0 * poisson_ratio)
    shear = coefficient * side**2 * _STIFFNESS / (2.0 * (1.0 + poisson_ratio))
    per_length = _GRAVITY * _DENSITY * side**2
    weight = per_length * length
    return BeamTheory(
        per_length * length**4 / (8.0 * bending) + per_length * length**2 / (2.0 * shear),
        weight * length**3 / (3.0 * bending) + weight * length / shear,
        _period(bending, shear),
    )


def _period(bending: float, shear: float) -> float:
    """Return the period of the first mode of a clamped Timoshenko beam [s], by finite elements.

    Args:
        bending: Young's modulus times second moment of area [N m2].
        shear: Shear coefficient times area times shear modulus [N].
    """
    h = BAR_LENGTH / _N_ELEMENTS
    n = 2 * (_N_ELEMENTS + 1)  # deflection and rotation of each node
    stiffness, mass = np.zeros((n, n)), np.zeros((n, n))
    turned = np.array([0.0, -1.0, 0.0, 1.0]) / h
    sheared = np.array([-1.0 / h, -0.5, 1.0 / h, -0.5])  # at the middle, else it would lock
    area, moment = BAR_THICKNESS**2, BAR_THICKNESS**4 / 12.0
    linear = np.array([[2.0, 1.0], [1.0, 2.0]]) * _DENSITY * h / 6.0
    for i in range(_N_ELEMENTS):
        at = slice(2 * i, 2 * i + 4)
        stiffness[at, at] += h * bending * np.outer(turned, turned)
        stiffness[at, at] += h * shear * np.outer(sheared, sheared)
        mass[at, at][::2, ::2] += area * linear
        mass[at, at][1::2, 1::2] += moment * linear
    squared = eigh(stiffness[2:, 2:], mass[2:, 2:], eigvals_only=True, subset_by_index=[0, 0])[0]
    return float(2.0 * math.pi / math.sqrt(squared))


def swing(poisson_ratio: float, across: int) -> BarMotion:
    """Load the clamped bar, let it go, and follow its swing.

    Args:
        poisson_ratio: Poisson's ratio of the bar.
        across: Cells through its thickness.
    """
    material = Material(
        young_modulus=_STIFFNESS,
        poisson_ratio=poisson_ratio,
        density=_DENSITY,
        law="neo_hookean",
        viscous_damping=0.0,
        retardation_time=0.0,
    )
    along = round(across * BAR_LENGTH / BAR_THICKNESS)
    mesh = block((along, across, across), (BAR_LENGTH, BAR_THICKNESS, BAR_THICKNESS))
    solver = SolverSettings(relaxation="verlet")
    tissue = Tissue(mesh, material, fixed=fixed_nodes(mesh, "left"), solver=solver)
    end = tissue.material_points("right")

    def height() -> float:
        return float(end.shares @ (tissue.positions_of(end) - end.rest)[:, 2])

    tissue.settle()
    of_weight = -height()
    weight = _GRAVITY * _DENSITY * BAR_LENGTH * BAR_THICKNESS**2
    load = tissue.push(end, (0.0, 0.0, -weight))
    tissue.settle()
    of_load = -height() - of_weight
    tissue.release(load)
    n = round(_N_PERIODS * beam_theory(poisson_ratio).period / _DT)
    heights = [height()]
    for _ in range(n):
        tissue.step(None, _DT)
        heights.append(height())
    found: FloatArray = np.array(heights)
    time: FloatArray = _DT * np.arange(n + 1, dtype=np.float64)
    return BarMotion(of_weight, of_load, _period_of(time, found + of_weight), time, found)


def _period_of(time: FloatArray, swing_of_tip: FloatArray) -> float:
    """Return the mean time between two passages through rest in the same direction [s]."""
    before = np.flatnonzero((swing_of_tip[:-1] < 0.0) & (swing_of_tip[1:] >= 0.0))
    y0, y1 = swing_of_tip[before], swing_of_tip[before + 1]
    passages = time[before] + (time[1] - time[0]) * y0 / (y0 - y1)
    return float(np.diff(passages).mean()) if len(passages) > 1 else math.nan


def check_bar(name: str, found: BarMotion, theory: BeamTheory) -> list[Check]:
    """Return the checks of a bar."""
    return [
        Check(f"{name}: {what} / Timoshenko's", value / wanted, *within(_NEAR), basis=THEORY)
        for what, value, wanted in (
            ("sag under its weight", found.sag_of_weight, theory.sag_of_weight),
            ("sag under a load at the tip", found.sag_of_load, theory.sag_of_load),
            ("period of the swing", found.period, theory.period),
        )
    ]


def _measure(quick: bool) -> Findings:
    """Load and release bars of two Poisson's ratios on two meshes."""
    checks, curves = [], []
    for ratio, across in itertools.product(_RATIOS, CELLS_ACROSS[:1] if quick else CELLS_ACROSS):
        theory, found = beam_theory(ratio), swing(ratio, across)
        name = f"Poisson's ratio {ratio:g}, {across} cells across"
        checks += check_bar(name, found, theory)
        curves.append(Curve(name, found.time * 1e3, found.height * 1e3))
        if across == CELLS_ACROSS[-1]:
            wave = np.cos(2.0 * np.pi * found.time / theory.period)
            height = -theory.sag_of_weight - theory.sag_of_load * wave
            curves.append(Curve("", found.time * 1e3, height * 1e3, is_theory=True))
    plot = Plot("The tip of a bar that is let go", "time [ms]", "height of the tip [mm]", curves)
    return Findings(checks, [plot])


BEAM_SCENE = ValidationScene(
    name="beam",
    title="A clamped bar: sag and period",
    about=(
        "A bar of 10 × 3 × 3 cm is clamped at one end. It sags under its own weight, then under a "
        "load at its tip as large as its weight, and swings when the load is let go. Sag and "
        "period are compared with those of Timoshenko's beam, with rotary inertia, within 3 %. "
        "Nothing of the theory is in the engine. A clamped body with a Poisson's ratio above 0 is "
        "a little stiffer than the beam, since the clamp also hinders its section. What is missing "
        "on these meshes is the error of linear tetrahedra in bending."
    ),
    measure=_measure,
    references=[
        Reference(
            "Cowper 1966, J. Appl. Mech. 33:335",
            "shear coefficient of a rectangular section, 10 (1 + nu) / (12 + 11 nu)",
            is_confirmed=False,
        )
    ],
)
