"""A bar: clamped, its sag and the period of its swing; free, its stiffness and its swing.

The clamped bar sags under its weight and under a load at its tip, and swings when the load is
released. How far and how fast follows from Timoshenko's beam (`bar.beam_theory`), for sections that
nothing hinders, and from linear elasticity for the clamped solid (`clamped_solid`). The difference
of the two is the clamp. The free bar has none: bent by couples at its ends it has the curvature of
the couple over E I, whatever its Poisson's ratio, which is the exact solution of three-dimensional
elasticity (Saint-Venant). All that the engine is stiffer is the error of the mesh.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from scalpel_sim.validate.bar import (
    BAR_DENSITY,
    BAR_LENGTH,
    BAR_THICKNESS,
    GRAVITY,
    BeamTheory,
    bar_material,
    bar_mesh,
    bar_tissue,
    beam_theory,
    period_of,
)
from scalpel_sim.validate.clamped_solid import ClampedSolid, clamped_solid
from scalpel_sim.validate.findings import Check, Curve, Findings, Plot, lines_of
from scalpel_sim.validate.torsion import torsion_checks
from tissue import FloatArray, TetrahedralMesh, Tissue, boundary_faces, fixed_nodes

CELLS_ACROSS = (3, 6)
"""Cells through the thickness, of two meshes."""
_LINES = lines_of("beam")
_RATIOS = (0.0, 0.45)
"""Poisson's ratios."""
_N_PERIODS = 2.5
"""Periods of the swing that is followed."""
_DT = 1e-3
"""Time between two samples of the swing [s]."""
_STRAIN = 0.005
"""Strain of the top and the bottom of the bent bar: so small that the theory is linear."""
_N_FREE_PERIODS = 6.5
"""Periods of the swing that is followed."""
_STEPS_IN_PERIOD = 50
"""Samples of a period: a line between two of them meets the swing at rest within 1e-4 periods."""


class FreeBar(NamedTuple):
    """Behaviour of the bar without supports on one mesh."""

    across: int
    """Cells through its thickness."""
    stiffness: float
    """Couple over curvature, over E I."""
    period: float
    """Period of the swing over Timoshenko's."""


class BarMotion(NamedTuple):
    """Behaviour of the bar."""

    sag_of_weight: float
    """Deflection of the tip under its own weight [m]."""
    sag_of_load: float
    """Deflection of the tip under a load there, as large as the weight [m]."""
    period: float
    """Period of the swing after the load is released [s]."""
    time: FloatArray
    """Times of the swing [s]."""
    height: FloatArray
    """Height of the tip above its rest [m]."""


def swing(poisson_ratio: float, across: int) -> BarMotion:
    """Load the clamped bar, release it, and follow its swing.

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
        _LINES[key].check(name, getattr(found, key) / getattr(theory, key), whose=whose)
        for key in ("sag_of_weight", "sag_of_load", "period")
    ]


def extrapolated(coarse: BarMotion, fine: BarMotion) -> BarMotion:
    """Return what the bar would do on an infinitely fine mesh (Richardson).

    Args:
        coarse: What it does with the first of `CELLS_ACROSS`.
        fine: What it does with the second.
    """
    ratio = CELLS_ACROSS[1] / CELLS_ACROSS[0]
    return fine._replace(
        sag_of_weight=limit(coarse.sag_of_weight, fine.sag_of_weight, ratio),
        sag_of_load=limit(coarse.sag_of_load, fine.sag_of_load, ratio),
        period=limit_of_period(coarse.period, fine.period, ratio),
    )


def measure_beam(quick: bool) -> Findings:
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
    plot = Plot("The tip of a bar that is released", "time [ms]", "height of the tip [mm]", curves)
    free_checks, free_plot = _free_bars(ratios)
    return Findings(checks + free_checks + torsion_checks(quick), [plot, free_plot], notes)


def _free_bars(ratios: Sequence[float]) -> tuple[list[Check], Plot]:
    """Bend bars without supports, and release them."""
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


def bent_and_let_go(poisson_ratio: float, across: int) -> FreeBar:
    """Bend a bar by couples at its ends, release it, and follow its swing.

    Args:
        poisson_ratio: Poisson's ratio of the bar.
        across: Cells through its thickness.
    """
    theory = beam_theory(poisson_ratio)
    curvature = 2.0 * _STRAIN / BAR_THICKNESS
    couple = theory.rigidity * curvature
    mesh = bar_mesh(across)
    forces = forces_of_couple(mesh, "right", couple) - forces_of_couple(mesh, "left", couple)

    def turned(positions: FloatArray) -> float:
        """Return by how much one end is turned against the other [rad]: work over couple."""
        return float((forces * (positions - mesh.positions)).sum()) / couple

    bent = bar_tissue(mesh, bar_material(poisson_ratio), weighs=False)
    nodes = np.flatnonzero(forces.any(axis=1))
    bent.push(nodes, forces[nodes])
    bent.settle()
    positions = bent.snapshot().positions
    swinging = bar_tissue(mesh, bar_material(poisson_ratio), positions=positions, weighs=False)
    dt = theory.free_period / _STEPS_IN_PERIOD
    angles = [turned(positions)]
    for _ in range(round(_N_FREE_PERIODS * _STEPS_IN_PERIOD)):
        swinging.step(None, dt)
        angles.append(turned(swinging.snapshot().positions))
    time: FloatArray = dt * np.arange(len(angles), dtype=np.float64)
    period = strongest_period(time, np.array(angles))
    return FreeBar(across, curvature * BAR_LENGTH / angles[0], period / theory.free_period)


def strongest_period(time: FloatArray, swing: FloatArray) -> float:
    """Return the period of the strongest motion [s]: the peak of the spectrum behind a window.

    A bar that couples have bent has a quarter of its energy in faster modes, with passages through
    rest of their own.
    """
    from scipy.optimize import minimize_scalar

    windowed = np.hanning(len(swing)) * (swing - swing.mean())
    spacing = 1.0 / (time[-1] - time[0])

    def strength(frequency: float) -> float:
        return -float(abs(np.exp(-2j * np.pi * frequency * time) @ windowed))

    coarse = min(spacing * np.arange(1, len(time) // 2), key=strength)
    found = minimize_scalar(
        strength, bounds=(coarse - spacing, coarse + spacing), options={"xatol": 1e-6 * spacing}
    )
    return float(1.0 / found.x)


def forces_of_couple(mesh: TetrahedralMesh, end: str, couple: float) -> FloatArray:
    """Return the forces of a traction along x that grows with the height, shape (n_nodes, 3) [N].

    It is the stress of a bent beam, integrated exactly over the faces of the end.

    Args:
        mesh: The bar.
        end: "left" or "right".
        couple: Moment about y; where it is positive the upper nodes are pulled along x [N m].
    """
    at_end = fixed_nodes(mesh, end)
    faces = boundary_faces(mesh.tetrahedra)
    faces = faces[at_end[faces].all(axis=1)]
    a, b, c = (mesh.positions[faces[:, k]] for k in range(3))
    area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
    height = mesh.positions[:, 2] - 0.5 * BAR_THICKNESS
    traction = couple * 12.0 / BAR_THICKNESS**4 * height[faces]
    shares = area[:, None] / 12.0 * (traction + traction.sum(axis=1, keepdims=True))
    forces = np.zeros_like(mesh.positions)
    forces[:, 0] = np.bincount(faces.ravel(), weights=shares.ravel(), minlength=len(forces))
    return forces


def check_free_bar(name: str, coarse: FreeBar, fine: FreeBar) -> list[Check]:
    """Return the checks of a bar on two meshes: its error on the finer one, order and limit."""
    finer = f"{name}, free, {fine.across} cells across"
    to_limit = f"{name}, free, {coarse.across} and {fine.across} cells"
    ratio = fine.across / coarse.across
    stiffness = coarse.stiffness, fine.stiffness, ratio
    period = limit_of_period(coarse.period, fine.period, ratio)
    return [
        _LINES["free_stiffness"].check(finer, fine.stiffness),
        _LINES["free_period"].check(finer, fine.period),
        _LINES["order"].check(to_limit, order(*stiffness)),
        _LINES["limit_of_stiffness"].check(to_limit, limit(*stiffness)),
        _LINES["limit_of_period"].check(to_limit, period),
    ]


def order(coarse: float, fine: float, ratio: float) -> float:
    """Return the order of the error of a value that is 1 by theory.

    Args:
        coarse: The value on the coarser mesh.
        fine: The value on the finer one.
        ratio: Size of an element of the coarser mesh over that of the finer one.
    """
    errors = (coarse - 1.0) / (fine - 1.0) if fine != 1.0 else math.inf
    return math.log(errors) / math.log(ratio) if errors > 0.0 else math.nan


def limit(coarse: float, fine: float, ratio: float) -> float:
    """Return where a value with an error of second order goes (Richardson)."""
    return fine + (fine - coarse) / (ratio * ratio - 1.0)


def limit_of_period(coarse: float, fine: float, ratio: float) -> float:
    """Return where a period goes: the square of a frequency is a stiffness over a mass."""
    return float(limit(coarse**-2, fine**-2, ratio) ** -0.5)
