"""The bar of the validation: in the engine, and as Timoshenko's beam of the same measures.

The beam has bending and shear, with rotary inertia, and a square section.
"""

import math
from typing import NamedTuple

import numpy as np
from scipy.linalg import eigh

from tissue import (
    BoolArray,
    FloatArray,
    Material,
    SolverSettings,
    TetrahedralMesh,
    Tissue,
    lattice_block,
)

BAR_LENGTH, BAR_THICKNESS = 0.1, 0.03
"""Length of the bar and sides of its section [m]."""
BAR_STIFFNESS, BAR_DENSITY = 1e6, 1000.0
"""Young's modulus [Pa] and density [kg/m3]: clamped, the tip sags by 2 % of the length, and a beam
whose deflection is small is what the theory is about."""
GRAVITY = 9.81
"""[m/s2]."""
_N_ELEMENTS = 100
"""Elements of the beam of the theory: its periods are then right to 1e-4."""


class BeamTheory(NamedTuple):
    """Behaviour of Timoshenko's beam."""

    sag_of_weight: float
    """Deflection of the tip of the clamped beam under its own weight [m]."""
    sag_of_load: float
    """Deflection of its tip under a load there, as large as the weight [m]."""
    period: float
    """Period of its first mode of bending [s]."""
    free_period: float
    """Period of the first mode of bending without supports [s]."""
    rigidity: float
    """E I, the couple over the curvature that it makes [N m2]."""


def bar_mesh(across: int) -> TetrahedralMesh:
    """Return the bar along x, of so many cells of a body-centred lattice through its thickness.

    Args:
        across: Number of cells.
    """
    along = round(across * BAR_LENGTH / BAR_THICKNESS)
    return lattice_block((along, across, across), (BAR_LENGTH, BAR_THICKNESS, BAR_THICKNESS))


def bar_material(poisson_ratio: float) -> Material:
    """Return what the bar is made of.

    Args:
        poisson_ratio: Poisson's ratio.
    """
    return Material(
        young_modulus=BAR_STIFFNESS,
        poisson_ratio=poisson_ratio,
        density=BAR_DENSITY,
        law="neo_hookean",
        viscous_damping=0.0,
        retardation_time=0.0,
    )


def bar_tissue(
    mesh: TetrahedralMesh,
    material: Material,
    *,
    fixed: BoolArray | None = None,
    positions: FloatArray | None = None,
    weighs: bool = True,
) -> Tissue:
    """Return the bar.

    Args:
        mesh: Its mesh.
        material: What it is made of.
        fixed: Its clamp, shape (n_nodes,).
        positions: Where its nodes are at first [m], shape (n_nodes, 3); default at rest.
        weighs: Whether there is gravity.
    """
    gravity = (0.0, 0.0, -GRAVITY if weighs else 0.0)
    solver = SolverSettings(relaxation="verlet")
    return Tissue(
        mesh, material, fixed=fixed, positions=positions, gravity=gravity, solver=solver
    )  # fmt: skip


def period_of(time: FloatArray, swing: FloatArray) -> float:
    """Return the mean time between two passages through zero in the same direction [s]."""
    before = np.flatnonzero((swing[:-1] < 0.0) & (swing[1:] >= 0.0))
    y0, y1 = swing[before], swing[before + 1]
    passages = time[before] + (time[1] - time[0]) * y0 / (y0 - y1)
    return float(np.diff(passages).mean()) if len(passages) > 1 else math.nan


def beam_theory(poisson_ratio: float) -> BeamTheory:
    """Return what a beam with the bar's measures does."""
    length, side = BAR_LENGTH, BAR_THICKNESS
    bending = BAR_STIFFNESS * side**4 / 12.0
    # Cowper 1966: the shear coefficient of a rectangle.
    coefficient = 10.0 * (1.0 + poisson_ratio) / (12.0 + 11.0 * poisson_ratio)
    shear = coefficient * side**2 * BAR_STIFFNESS / (2.0 * (1.0 + poisson_ratio))
    per_length = GRAVITY * BAR_DENSITY * side**2
    weight = per_length * length
    return BeamTheory(
        per_length * length**4 / (8.0 * bending) + per_length * length**2 / (2.0 * shear),
        weight * length**3 / (3.0 * bending) + weight * length / shear,
        _beam_period(bending, shear, is_clamped=True),
        _beam_period(bending, shear, is_clamped=False),
        bending,
    )


def _beam_period(bending: float, shear: float, *, is_clamped: bool) -> float:
    """Return the period of the first mode of a Timoshenko beam [s], by finite elements.

    Args:
        bending: Young's modulus times second moment of area [N m2].
        shear: Shear coefficient times area times shear modulus [N].
        is_clamped: Whether one end is clamped; if not, the beam is free.
    """
    h = BAR_LENGTH / _N_ELEMENTS
    n = 2 * (_N_ELEMENTS + 1)  # deflection and rotation of each node
    stiffness, mass = np.zeros((n, n)), np.zeros((n, n))
    turned = np.array([0.0, -1.0, 0.0, 1.0]) / h
    sheared = np.array([-1.0 / h, -0.5, 1.0 / h, -0.5])  # at the middle, else it would lock
    area, moment = BAR_THICKNESS**2, BAR_THICKNESS**4 / 12.0
    linear = np.array([[2.0, 1.0], [1.0, 2.0]]) * BAR_DENSITY * h / 6.0
    for i in range(_N_ELEMENTS):
        at = slice(2 * i, 2 * i + 4)
        stiffness[at, at] += h * bending * np.outer(turned, turned)
        stiffness[at, at] += h * shear * np.outer(sheared, sheared)
        mass[at, at][::2, ::2] += area * linear
        mass[at, at][1::2, 1::2] += moment * linear
    # The clamp takes deflection and rotation of the first node; the free beam has two rigid modes.
    held, which = (2, 0) if is_clamped else (0, 2)
    squares = eigh(
        stiffness[held:, held:], mass[held:, held:], eigvals_only=True,
        subset_by_index=[which, which],
    )  # fmt: skip
    return float(2.0 * math.pi / math.sqrt(squares[0]))
