"""A bar: clamped, its sag and the period of its swing; free, its stiffness and its swing.

The clamped bar sags under its weight and under a load at its tip, and swings when the load is let
go. Timoshenko's beam tells how far and how fast (`beam_theory`), for sections that nothing hinders;
linear elasticity tells it for the clamped solid (`clamped_solid`). The difference of the two is the
clamp. The free bar has none (`free_bar`).
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from scalpel_sim.validate.bar import (
    bar_material,
    bar_mesh,
    bar_tissue,
    period_of,
)
from scalpel_sim.validate.beam_theory import (
    BAR_DENSITY,
    BAR_LENGTH,
    BAR_THICKNESS,
    GRAVITY,
    BeamTheory,
    beam_theory,
)
from scalpel_sim.validate.clamped_solid import ClampedSolid, clamped_solid
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
from scalpel_sim.validate.free_bar import bent_and_let_go, check_free_bar, limit
from tissue import FloatArray, Tissue, fixed_nodes

CELLS_ACROSS = (3, 6)
"""Cells through the thickness, of two meshes."""
_RATIOS = (0.0, 0.45)
"""Poisson's ratios."""
_NEAR = 0.03
"""Largest relative error of sag and period."""
_N_PERIODS = 2.5
"""Periods of the swing that is followed."""
_DT = 1e-3
"""Time between two samples of the swing [s]."""


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


def swing(poisson_ratio: float, across: int) -> BarMotion:
    """Load the clamped bar, let it go, and follow its swing.

    Args:
        poisson_ratio: Poisson's ratio of the bar.
        across: Cells through its thickness.
    """
    mesh, period = bar_mesh(across), beam_theory(poisson_ratio).period
    clamp = fixed_nodes(mesh, "left")
    loaded = bar_tissue(mesh, bar_material(poisson_ratio), fixed=clamp)
    end = loaded.material_points("right")

    def height(tissue: Tissue) -> float:
        return float(end.shares @ (tissue.positions_of(end) - end.rest)[:, 2])

    loaded.settle()
    of_weight = -height(loaded)
    weight = GRAVITY * BAR_DENSITY * BAR_LENGTH * BAR_THICKNESS**2
    loaded.push(end, (0.0, 0.0, -weight))
    loaded.settle()
    of_load = -height(loaded) - of_weight
    positions = loaded.snapshot().positions
    swinging = bar_tissue(mesh, bar_material(poisson_ratio), fixed=clamp, positions=positions)
    n = round(_N_PERIODS * period / _DT)
    heights = [height(swinging)]
    for _ in range(n):
        swinging.step(None, _DT)
        heights.append(height(swinging))
    found: FloatArray = np.array(heights)
    time: FloatArray = _DT * np.arange(n + 1, dtype=np.float64)
    return BarMotion(of_weight, of_load, period_of(time, found + of_weight), time, found)


def check_bar(
    name: str, found: BarMotion, theory: BeamTheory | ClampedSolid, whose: str = "Timoshenko's"
) -> list[Check]:
    """Return the checks of a clamped bar.

    Args:
        name: Of the bar.
        found: What it does.
        theory: What it should do.
        whose: Whose sag and period that is.
    """
    return [
        Check(f"{name}: {what} / {whose}", value / wanted, *within(_NEAR), basis=THEORY)
        for what, value, wanted in (
            ("sag under its weight", found.sag_of_weight, theory.sag_of_weight),
            ("sag under a load at the tip", found.sag_of_load, theory.sag_of_load),
            ("period of the swing", found.period, theory.period),
        )
    ]


def extrapolated(coarse: BarMotion, fine: BarMotion) -> BarMotion:
    """Return what the bar would do on an infinitely fine mesh (Richardson).

    Args:
        coarse: What it does with the first of `CELLS_ACROSS`.
        fine: What it does with the second.
    """
    ratio = CELLS_ACROSS[1] / CELLS_ACROSS[0]
    # The square of a frequency is a stiffness over a mass.
    frequencies = coarse.period**-2, fine.period**-2
    return fine._replace(
        sag_of_weight=limit(coarse.sag_of_weight, fine.sag_of_weight, ratio),
        sag_of_load=limit(coarse.sag_of_load, fine.sag_of_load, ratio),
        period=limit(*frequencies, ratio) ** -0.5,
    )


def _measure(quick: bool) -> Findings:
    """Load, bend and release bars of two Poisson's ratios on two meshes."""
    checks, curves, notes = [], [], []
    ratios = _RATIOS[-1:] if quick else _RATIOS
    n_coarse, n_fine = CELLS_ACROSS
    for ratio in ratios:
        theory, solid = beam_theory(ratio), clamped_solid(ratio)
        coarse, fine = (swing(ratio, across) for across in CELLS_ACROSS)
        name = f"Poisson's ratio {ratio:g}"
        right, whose = (solid, "the clamped solid's") if ratio > 0.0 else (theory, "Timoshenko's")
        checks += check_bar(f"{name}, {n_fine} cells across", fine, right, whose)
        to_limit = f"{name}, limit of {n_coarse} and {n_fine} cells"
        checks += check_bar(to_limit, extrapolated(coarse, fine), right, whose)
        curves += [
            Curve(f"{name}, {across} cells across", 1e3 * found.time, 1e3 * found.height)
            for across, found in zip(CELLS_ACROSS, (coarse, fine), strict=True)
        ]
        wave = np.cos(2.0 * np.pi * fine.time / right.period)
        height = -right.sag_of_weight - right.sag_of_load * wave
        curves.append(Curve("", 1e3 * fine.time, 1e3 * height, is_theory=True))
        if ratio > 0.0:  # else nothing narrows
            notes.append(_note_of_clamp(ratio, solid, theory))
    plot = Plot("The tip of a bar that is let go", "time [ms]", "height of the tip [mm]", curves)
    free_checks, free_plot = _free_bars(ratios)
    return Findings(checks + free_checks, [plot, free_plot], notes)


def _free_bars(ratios: Sequence[float]) -> tuple[list[Check], Plot]:
    """Bend bars without supports, and let them go."""
    checks, curves = [], []
    for ratio in ratios:
        bars = [bent_and_let_go(ratio, across) for across in CELLS_ACROSS]
        name = f"Poisson's ratio {ratio:g}"
        checks += check_free_bar(name, *bars)
        squares = np.array([(1e3 * BAR_THICKNESS / bar.across) ** 2 for bar in bars])
        curves.append(Curve(name, squares, np.array([bar.stiffness for bar in bars])))
    ends = np.array([0.0, (1e3 * BAR_THICKNESS / CELLS_ACROSS[0]) ** 2])
    curves.append(Curve("", ends, np.ones(2), is_theory=True))
    title = "A free bar that is bent by couples, on two meshes"
    axes = "square of the size of a cell [mm²]", "couple / (E I curvature)"
    return checks, Plot(title, *axes, curves)


def _note_of_clamp(poisson_ratio: float, solid: ClampedSolid, theory: BeamTheory) -> str:
    """Return how much of the deviation from beam theory is the clamp."""
    of_weight, of_load, of_period = (
        getattr(solid, name) / getattr(theory, name) for name in ClampedSolid._fields
    )
    return (
        f"By linear elasticity of three dimensions the clamped bar with a Poisson's ratio of "
        f"{poisson_ratio:g} sags {of_weight:.3f} of Timoshenko's beam under its weight and "
        f"{of_load:.3f} under the load, and its period is {of_period:.3f} of the beam's: that is "
        "the clamp, and no mesh changes it. What is beyond is the error of the mesh"
    )


BEAM_SCENE = ValidationScene(
    name="beam",
    title="A bar: sag, stiffness in bending and period",
    about=(
        "A bar of 10 × 3 × 3 cm is clamped at one end. It sags under its own weight, then under a "
        "load at its tip as large as its weight, and swings when the load is let go. At a "
        "Poisson's ratio of 0 sag and period are compared with those of Timoshenko's beam, with "
        "rotary inertia, within 3 %. Else a clamp keeps its section from narrowing, which a beam "
        "does not know: there the bar is compared with the clamped solid, which is computed with "
        "quadratic hexahedra. Nothing of either is in the engine. Young's modulus is 1 MPa, higher "
        "than that of an organ: the tip then sags by 2 % of the length, and a beam's theory is one "
        "of small deflections. Then the same bar without "
        "supports is bent by couples at both ends, for which E I is exact in three dimensions, "
        "and let go. All deviation is the error of linear tetrahedra in bending. It falls with "
        "the square of the size of elements: the observed order and the limit on an infinitely "
        "fine mesh, by Richardson's extrapolation, are lines of their own. The mesh is a "
        "body-centred lattice (`lattice_block`), of the kind that the organ has; a `block` of as "
        "many cells has half the tetrahedra and errs by two to three times as much "
        "([mesh study](mesh_study.md))."
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
