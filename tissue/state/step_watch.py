"""`StepWatch`: whether a body may move as it did in a time step, by its own laws."""

import math

import numpy as np

from tissue.blade.edge import Edge
from tissue.core.jit import SameTypes
from tissue.integrators.step_judgement import (
    ACCEPTED,
    DISSIPATED,
    IS_FINITE,
    KINETIC,
    LEFT_BOX,
    LOOK_NUMBERS,
    NOT_FINITE_NOW,
    POTENTIAL,
    TOO_FAST,
    WORK,
    StepBounds,
    energy_in_springs,
    judge_step,
    write_look,
)
from tissue.integrators.system import System

STRAIN_UNEXPLAINED = 0.1
"""Energy that may come out of nothing, as a strain of the whole body: a tenth of the speed of waves
in all of its nodes. Contact by impulses lifts what has sunk into a floor, and a cut makes the
tissue around it stiffer: both add energy that is not counted. More: a body may shake visibly before
it is found. Less: see `SHARE_UNEXPLAINED`."""

SHARE_UNEXPLAINED = 0.5
"""The same as a share of the energy that there was and of what was done and taken since. The
account of energy is exact to some percent; the elastic energy now, which is taken to be 0 here so
that a step needs no look at the elements, is what makes the bound wide."""


class StepWatch:
    """Looks at a body before and after each step.

    Args:
        system: The body.
        wave_speed: Speed of waves in it [m/s].
    """

    def __init__(self, system: System, wave_speed: float) -> None:
        rest = system.body.rest[: system.body.n_nodes]
        mass = float(system.body.masses[: system.body.n_nodes].sum())
        self._bounds = StepBounds(
            total=0.0,
            without_gravity=0.0,
            work=0.0,
            dissipated=0.0,
            residual=0.0,
            excess=0.0,
            diagonal=float(np.linalg.norm(np.ptp(rest, axis=0))),
            gravity=math.hypot(*system.surroundings.gravity),
            unexplained=0.5 * mass * (STRAIN_UNEXPLAINED * wave_speed) ** 2,
            share_unexplained=SHARE_UNEXPLAINED,
        )
        self._before, self._after = np.zeros((2, LOOK_NUMBERS))
        self._write_look, self._judge = SameTypes(write_look), SameTypes(judge_step)

    def look(self, system: System) -> bool:
        """Look at the body before a step; return whether all of its motion is finite."""
        self._write_look.call(system.context, self._before)
        return bool(self._before[IS_FINITE] == 1.0)

    def begin(
        self, system: System, edge: Edge, when: float, work_of_loads: float, residual: float
    ) -> None:
        """Count from now on what the body is given.

        Args:
            system: The body.
            edge: The cutting edge over the last time step.
            when: Instant of it, as a fraction.
            work_of_loads: Work of loads so far [J].
            residual: That of the account of energy now, if one is kept, else 0 [J].
        """
        bounds, now = self._bounds, self._after
        self._write_look.call(system.context, now)
        own = float(now[KINETIC]) + energy_in_springs(system.context, edge, when)
        bounds.without_gravity, bounds.total = own, own + float(now[POTENTIAL])
        bounds.work, bounds.dissipated = float(now[WORK]) + work_of_loads, float(now[DISSIPATED])
        bounds.residual = residual

    def fault(self, system: System, dt: float, work_of_loads: float, residual: float) -> str | None:
        """Return what is wrong with a step since the last look; None: nothing.

        Args:
            system: The body after it.
            dt: Length of the step [s].
            work_of_loads: Work of loads so far [J].
            residual: That of the account of energy after it, if one is kept, else 0 [J].
        """
        where = (system.context, self._bounds, self._before, self._after)
        found = self._judge.call(*where, dt, work_of_loads, residual)
        if found == ACCEPTED:
            return None
        if found == NOT_FINITE_NOW:
            return "the position or velocity of a node is not a finite number"
        excess = self._bounds.excess
        if found == LEFT_BOX:
            return f"a node went {excess:.3g} m out of the box around the body"
        if found == TOO_FAST:
            return (
                f"its nodes have {self._after[KINETIC]:.3g} J of kinetic energy, {excess:.3g} J "
                "more than blade, loads and gravity gave"
            )
        return f"{excess:.3g} J of energy came out of nothing"
