"""The bar of the validation in the engine: its mesh, its material, and how it comes to rest."""

import math

import numpy as np

from scalpel_sim.validate.beam_theory import (
    BAR_DENSITY,
    BAR_LENGTH,
    BAR_STIFFNESS,
    BAR_THICKNESS,
    GRAVITY,
)
from tissue import (
    BoolArray,
    FloatArray,
    Material,
    SolverSettings,
    TetrahedralMesh,
    Tissue,
    lattice_block,
)

_PERIODS_TO_REST = 3.0
"""Periods of the slowest mode in which a bar whose damping is critical for it comes to rest: within
2e-7 of its displacement."""
_STEPS_TO_REST = 100
"""Calls of the engine in that time."""


def bar_mesh(across: int) -> TetrahedralMesh:
    """Return the bar along x, of so many cells of a body-centred lattice through its thickness.

    Args:
        across: Number of cells.
    """
    along = round(across * BAR_LENGTH / BAR_THICKNESS)
    return lattice_block((along, across, across), (BAR_LENGTH, BAR_THICKNESS, BAR_THICKNESS))


def bar_material(poisson_ratio: float, drag: float = 0.0) -> Material:
    """Return what the bar is made of.

    Args:
        poisson_ratio: Poisson's ratio.
        drag: Viscous damping [1/s].
    """
    return Material(
        young_modulus=BAR_STIFFNESS,
        poisson_ratio=poisson_ratio,
        density=BAR_DENSITY,
        law="neo_hookean",
        viscous_damping=drag,
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


def critical_drag(period: float) -> float:
    """Return the viscous damping [1/s] that is critical for a mode of that period [s]."""
    return 4.0 * math.pi / period


def come_to_rest(tissue: Tissue, period: float) -> None:
    """Let a tissue come to rest whose damping is critical for its slowest mode.

    `Tissue.settle` stops all nodes at peaks of the kinetic energy, and the fast modes of a stiff
    bar on a fine mesh have many of them: after all its steps the tip may be 3 % from its rest.

    Args:
        tissue: The bar.
        period: Period of its slowest mode [s].
    """
    for _ in range(_STEPS_TO_REST):
        tissue.step(None, _PERIODS_TO_REST * period / _STEPS_TO_REST)


def period_of(time: FloatArray, swing: FloatArray) -> float:
    """Return the mean time between two passages through zero in the same direction [s]."""
    before = np.flatnonzero((swing[:-1] < 0.0) & (swing[1:] >= 0.0))
    y0, y1 = swing[before], swing[before + 1]
    passages = time[before] + (time[1] - time[0]) * y0 / (y0 - y1)
    return float(np.diff(passages).mean()) if len(passages) > 1 else math.nan
