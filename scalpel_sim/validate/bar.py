"""The bar of the validation in the engine: its mesh, its material, and how it swings."""

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
