"""A bar without supports, bent by couples at its ends and let go: no clamp hinders its section.

A bar under a couple is bent to the curvature of the couple over E I, whatever its Poisson's ratio:
that is the exact solution of three-dimensional elasticity (Saint-Venant), and what the engine has
more of stiffness is the error of the mesh alone. Let go, it swings as a free beam.
"""

import math
from typing import NamedTuple

import numpy as np

from scalpel_sim.validate.beam_theory import (
    BAR_LENGTH,
    BAR_THICKNESS,
    bar_material,
    bar_mesh,
    beam_theory,
    period_of,
)
from scalpel_sim.validate.findings import THEORY, Check, within
from tissue import FloatArray, MaterialPoints, SolverSettings, Tissue

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
"""Order in the size of elements of the error of linear elements in the energy, and how far two
coarse meshes may be from it: with 3 and 6 cells the next term, of fourth order, has a share of some
percent in the error of the coarser mesh."""


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
    material = bar_material(poisson_ratio)
    theory = beam_theory(poisson_ratio)
    solver = SolverSettings(relaxation="verlet")
    tissue = Tissue(bar_mesh(across), material, gravity=(0.0, 0.0, 0.0), solver=solver)
    curvature = 2.0 * _STRAIN / BAR_THICKNESS
    couple = theory.rigidity * curvature
    left, right = (tissue.material_points(side) for side in ("left", "right"))
    couples = [(end, forces_of_couple(end, m)) for end, m in ((left, -couple), (right, couple))]
    loads = [tissue.push(end, forces) for end, forces in couples]

    def turned() -> float:
        """Return by how much one end is turned against the other [rad]: work over couple."""
        works = [f * (tissue.positions_of(end) - end.rest) for end, f in couples]
        return float(np.sum(works)) / couple

    tissue.settle()
    stiffness = curvature * BAR_LENGTH / turned()
    for load in loads:
        tissue.release(load)
    dt = theory.free_period / _STEPS_IN_PERIOD
    angles = [turned()]
    for _ in range(round(_N_PERIODS * _STEPS_IN_PERIOD)):
        tissue.step(None, dt)
        angles.append(turned())
    time: FloatArray = dt * np.arange(len(angles), dtype=np.float64)
    period = period_of(time, np.array(angles))
    return FreeBar(across, stiffness, period / theory.free_period)


def forces_of_couple(end: MaterialPoints, couple: float) -> FloatArray:
    """Return forces along x on the points of an end that have no resultant and make a couple [N].

    They are linear over the section. The faces of an end have diagonals: forces that only grow with
    the height would bend the bar to the side as well.

    Args:
        end: The points.
        couple: Moment about y; where it is positive the upper points are pulled along x [N m].
    """
    places = end.rest[:, 1:] - 0.5 * BAR_THICKNESS
    weighted = end.shares[:, None] * places
    forces = np.zeros((len(end), 3))
    forces[:, 0] = weighted @ np.linalg.solve(weighted.T @ places, (0.0, couple))
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
            _ORDER + _ORDER_TOLERANCE,
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
