"""A bar without supports, bent by couples at its ends and let go: no clamp hinders its section.

A bar under a couple is bent to the curvature of the couple over E I, whatever its Poisson's ratio:
that is the exact solution of three-dimensional elasticity (Saint-Venant), and what the engine has
more of stiffness is the error of the mesh alone. Let go, it swings as a free beam.
"""

import math
from typing import NamedTuple

import numpy as np

from scalpel_sim.validate.bar import (
    bar_material,
    bar_mesh,
    bar_tissue,
    period_of,
)
from scalpel_sim.validate.beam_theory import BAR_LENGTH, BAR_THICKNESS, beam_theory
from scalpel_sim.validate.findings import THEORY, Check, within
from tissue import FloatArray, TetrahedralMesh, boundary_faces, fixed_nodes

_STRAIN = 0.005
"""Strain of the top and the bottom of the bent bar: so small that the theory is linear."""
_N_PERIODS = 6.5
"""Periods of the swing that is followed: the bend under couples has a few percent of faster modes,
which shift a single passage through rest by up to half a percent of a period."""
_STEPS_IN_PERIOD = 50
"""Samples of a period: a line between two of them meets the swing at rest within 1e-4 periods."""
_NEAR = 0.03
"""Largest relative error of stiffness and period."""
_ORDER, _ORDER_TOLERANCE = 2.0, 0.25
"""Order in the size of elements with which the error of linear elements in the energy falls, and
how far two coarse meshes may be below. They may be above: the elements at the surface have an error
of their own, of third order, which counts on the coarser mesh."""


class FreeBar(NamedTuple):
    """What the bar without supports does on one mesh."""

    across: int
    """Cells through its thickness."""
    stiffness: float
    """Couple over curvature, over E I."""
    period: float
    """Period of the swing over Timoshenko's."""


def bent_and_let_go(poisson_ratio: float, across: int) -> FreeBar:
    """Bend a bar by couples at its ends, let it go, and follow its swing.

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
    for _ in range(round(_N_PERIODS * _STEPS_IN_PERIOD)):
        swinging.step(None, dt)
        angles.append(turned(swinging.snapshot().positions))
    time: FloatArray = dt * np.arange(len(angles), dtype=np.float64)
    period = period_of(time, np.array(angles))
    return FreeBar(across, curvature * BAR_LENGTH / angles[0], period / theory.free_period)


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
    # The square of a frequency is a stiffness over a mass.
    frequencies = coarse.period**-2, fine.period**-2
    return [
        Check(f"{finer}: couple / (E I curvature)", fine.stiffness, *within(_NEAR), basis=THEORY),
        Check(f"{finer}: period / Timoshenko's", fine.period, *within(_NEAR), basis=THEORY),
        Check(
            f"{to_limit}: order of the error of the stiffness",
            order(coarse.stiffness, fine.stiffness, ratio),
            _ORDER - _ORDER_TOLERANCE,
            math.inf,
            basis=THEORY,
        ),
        Check(
            f"{to_limit}: limit of couple / (E I curvature)",
            limit(coarse.stiffness, fine.stiffness, ratio),
            *within(_NEAR),
            basis=THEORY,
        ),
        Check(
            f"{to_limit}: limit of the period / Timoshenko's",
            limit(*frequencies, ratio) ** -0.5,
            *within(_NEAR),
            basis=THEORY,
        ),
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
