"""`StepWatch`: whether a body may move as it did in a time step, by its own laws."""

import math

import numpy as np

from tissue.blade.edge import Edge
from tissue.core.jit import SameTypes
from tissue.integrators.model import TissueModel
from tissue.integrators.step_judgement import (
    ACCEPTED,
    DISSIPATED,
    FORCE_NOT_FINITE,
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
from tissue.mesh.finite_motion import is_motion_finite

STRAIN_UNEXPLAINED = 0.1
"""Energy that may come out of nothing, as a strain of the whole body: a tenth of the speed of waves
in all of its nodes. A cut makes the tissue around it stiffer: that adds energy that is not counted.
More: a body may shake visibly before
it is found. Less: see `SHARE_UNEXPLAINED`."""

SHARE_UNEXPLAINED = 0.5
"""The same as a share of the energy that there was and of what was done and taken since. The
account of energy is exact to some percent; the elastic energy now, which is taken to be 0 here so
that a step needs no look at the elements, is what makes the bound wide."""


SPEED_GAINED = 10.0
"""Speed that a node may gain in a step, per speed of waves: at one already, tissue would be crushed
before its waves carry the load away. More: 1e9 N on a node are an outlier for a step, in which it
flies off, before its motion becomes unstable. Scenes stay at 3 % of the way that this allows."""


class StepWatch:
    """Looks at a body after each step, and before one where it was not left as it was then.

    Args:
        system: The body.
        wave_speed: Speed of waves in it [m/s].
    """

    def __init__(self, system: TissueModel, wave_speed: float) -> None:
        rest = system.body.rest[: system.body.n_nodes]
        mass = float(system.body.masses[: system.body.n_nodes].sum())
        self._bounds = StepBounds(
            before=np.zeros(LOOK_NUMBERS),
            after=np.zeros(LOOK_NUMBERS),
            without_gravity=0.0,
            potential=0.0,
            work=0.0,
            dissipated=0.0,
            residual=0.0,
            excess=0.0,
            diagonal=float(np.linalg.norm(np.ptp(rest, axis=0))),
            gravity=math.hypot(*system.surroundings.gravity),
            speed_gained=float(SPEED_GAINED * wave_speed),
            unexplained=0.5 * mass * (STRAIN_UNEXPLAINED * wave_speed) ** 2,
            share_unexplained=SHARE_UNEXPLAINED,
        )
        self._write_look, self._judge = SameTypes(write_look), SameTypes(judge_step)
        self._is_finite = SameTypes(is_motion_finite)

    def is_finite(self, system: TissueModel) -> bool:
        """Return whether all of the motion of the body is finite."""
        return self._is_finite.call(system.body)

    def look(self, system: TissueModel) -> None:
        """Look at the body before a step."""
        self._write_look.call(system.context, self._bounds.before)

    def begin(
        self, system: TissueModel, edge: Edge, when: float, work_of_loads: float, residual: float
    ) -> None:
        """Look at the body before a step, and count from now on what it is given.

        Args:
            system: The body.
            edge: The cutting edge over the last time step.
            when: Instant of it, as a fraction.
            work_of_loads: Work of loads so far [J].
            residual: That of the account of energy now, if one is kept, else 0 [J].
        """
        bounds, now = self._bounds, self._bounds.before
        self.look(system)
        own = float(now[KINETIC]) + energy_in_springs(system.context, edge, when)
        bounds.without_gravity, bounds.potential = own, float(now[POTENTIAL])
        bounds.work, bounds.dissipated = float(now[WORK]) + work_of_loads, float(now[DISSIPATED])
        bounds.residual = residual

    def fault(
        self, system: TissueModel, dt: float, work_of_loads: float, residual: float, force: float
    ) -> str | None:
        """Return what is wrong with a step since the last look; None: nothing.

        Args:
            system: The body after it.
            dt: Length of the step [s].
            work_of_loads: Work of loads so far [J].
            residual: That of the account of energy after it, if one is kept, else 0 [J].
            force: A sum of what the blade feels: finite, or not.
        """
        bounds = self._bounds
        found = self._judge.call(system.context, bounds, dt, work_of_loads, residual, force)
        return None if found == ACCEPTED else self._named(found)

    def _named(self, found: int) -> str:
        """Return what is wrong with a step, of which `judge_step` found this."""
        if found == NOT_FINITE_NOW:
            return "the position or velocity of a node is not a finite number"
        if found == FORCE_NOT_FINITE:
            return "the force on the blade is not a finite number"
        excess = self._bounds.excess
        if found == LEFT_BOX:
            return f"a node went {excess:.3g} m out of the box around the body"
        if found == TOO_FAST:
            return (
                f"its nodes have {self._bounds.after[KINETIC]:.3g} J of kinetic energy, "
                f"{excess:.3g} J more than blade, loads and gravity gave"
            )
        return f"{excess:.3g} J of energy came out of nothing"
