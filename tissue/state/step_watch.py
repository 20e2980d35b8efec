"""`StepWatch`: whether a body may move as it did in a time step, by its own laws."""

import math
from typing import NamedTuple

import numpy as np

from tissue.blade.edge import Edge
from tissue.core.jit import SameTypes
from tissue.integrators.frame_look import (
    FrameLook,
    energy_in_springs,
    look_of,
    room_for_look,
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


class EnergyGiven(NamedTuple):
    """The energy of a body at one time, and what it had been given and had lost until then."""

    total: float
    """Elastic, kinetic, in gravity, and in all that holds and touches it [J]."""
    without_gravity: float
    """The part of it that is not in gravity [J]."""
    work: float
    """Work done on it [J]."""
    dissipated: float
    """Energy taken from it [J]."""
    residual: float
    """`Energies.residual`, where an account of energy is kept, else 0 [J]."""


class StepWatch:
    """Looks at a body before and after each step.

    Args:
        system: The body.
        wave_speed: Speed of waves in it [m/s].
    """

    def __init__(self, system: System, wave_speed: float) -> None:
        rest = system.body.rest[: system.body.n_nodes]
        self._diagonal = float(np.linalg.norm(np.ptp(rest, axis=0)))
        mass = float(system.body.masses[: system.body.n_nodes].sum())
        self._unexplained = 0.5 * mass * (STRAIN_UNEXPLAINED * wave_speed) ** 2
        self._gravity = math.hypot(*system.surroundings.gravity)
        self._numbers = room_for_look()
        self._write_look = SameTypes(write_look)
        self._given = EnergyGiven(0.0, 0.0, 0.0, 0.0, 0.0)

    def look(self, system: System) -> FrameLook:
        """Return how the body moves now."""
        self._write_look.call(system.context, self._numbers)
        return look_of(self._numbers)

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
        look = self.look(system)
        own = look.kinetic + energy_in_springs(system.context, edge, when)
        work = look.work + work_of_loads
        self._given = EnergyGiven(own + look.potential, own, work, look.dissipated, residual)

    def fault(
        self,
        before: FrameLook,
        after: FrameLook,
        dt: float,
        work_of_loads: float,
        residual: float,
    ) -> str | None:
        """Return what is wrong with a step; None: nothing.

        Args:
            before: The body before it.
            after: The body after it.
            dt: Length of the step [s].
            work_of_loads: Work of loads so far [J].
            residual: That of the account of energy after it, if one is kept, else 0 [J].
        """
        if not after.is_finite:
            return "the position or velocity of a node is not a finite number"
        # The sides of the box move as fast as nodes do; what turns round within the step moves by
        # less than the body is long.
        reach = self._diagonal + (before.fastest + after.fastest) * dt + self._gravity * dt * dt
        ways = (
            *(x - y for x, y in zip(before.low, after.low, strict=True)),
            *(y - x for x, y in zip(before.high, after.high, strict=True)),
        )
        if not max(ways) <= reach:
            return f"a node went {max(ways):.3g} m out of the box around the body"
        given = self._given
        work = after.work + work_of_loads - given.work
        dissipated = after.dissipated - given.dissipated
        excess = after.kinetic + after.potential - (given.total + work - dissipated)
        through = abs(given.without_gravity) + abs(work) + dissipated
        allowed = self._unexplained + SHARE_UNEXPLAINED * through
        if not excess <= allowed:
            return (
                f"its nodes have {after.kinetic:.3g} J of kinetic energy, {excess:.3g} J more than "
                "blade, loads and gravity gave"
            )
        if not given.residual - residual <= allowed:
            return f"{given.residual - residual:.3g} J of energy came out of nothing"
        return None
