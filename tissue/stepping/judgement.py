"""`StepWatch`: whether a body may move as it did in a time step, by its own laws."""

import math
from typing import Final

import numpy as np

from tissue.blade.edge import Edge
from tissue.core.array_types import FloatArray
from tissue.core.jit import SameTypes, kernel
from tissue.core.structs import Arrays, FloatCell
from tissue.core.vec3 import dot, vec3
from tissue.elasticity.energy import elastic_energy
from tissue.forces.step_context import StepContext
from tissue.forces.terms import energy_of_terms
from tissue.geometry.aabb import empty_box, with_point
from tissue.integrators.model import TissueModel
from tissue.stepping.energy_audit import RESIDUAL
from tissue.stepping.frame import FrameContext

STRAIN_UNEXPLAINED = 0.1
"""Energy that may come out of nothing, as a strain of the whole body: a tenth of the speed of waves
in all of its nodes. A cut makes the tissue around it stiffer: that adds energy that is not counted.
More: a body may shake visibly before
it is found. Less: see `SHARE_UNEXPLAINED`."""

SHARE_UNEXPLAINED = 0.5
"""The same as a share of the energy that there was and of what was done and taken since. The
account of energy is exact to some percent; the elastic energy now, which is taken to be 0 here so
that a step needs no pass over the elements, is what makes the bound wide."""

SPEED_GAINED = 10.0
"""Speed that a node may gain in a step, per speed of waves: at one already, tissue would be crushed
before its waves carry the load away. More: 1e9 N on a node are an outlier for a step, in which it
flies off, before its motion becomes unstable. Scenes stay at 3 % of the way that this allows."""

IS_FINITE, LOW, HIGH, FASTEST_NODE, KINETIC, POTENTIAL, WORK, DISSIPATED = 0, 1, 4, 7, 8, 9, 10, 11
"""Places in what `write_look` writes:

IS_FINITE, 1 if all positions and velocities are finite numbers, else 0; LOW and HIGH, three each,
the corners of the box around the nodes [m]; FASTEST_NODE, the speed of the fastest node, fixed ones
too [m/s]; KINETIC, the kinetic energy of the nodes that are not fixed, and POTENTIAL, the energy in
gravity [J]; WORK, that of blade and supports so far, and DISSIPATED, what damping, cutting and
friction took so far, as far as it is counted [J]."""

LOOK_NUMBERS = 12
"""Numbers that `write_look` writes."""

ACCEPTED: Final = 0
"""Nothing is wrong with a step."""
NOT_FINITE_NOW: Final = 1
"""A position or a velocity is not a finite number."""
LEFT_BOX: Final = 2
"""A node left the box around the body faster than nodes move."""
TOO_FAST: Final = 3
"""The nodes have more energy than the body was given."""
OUT_OF_NOTHING: Final = 4
"""The account of energy says that there is more than was given."""
FORCE_NOT_FINITE: Final = 5
"""The force on the blade is not a finite number."""


class StepWatch:
    """Judges the body after each step by what it was before.

    Args:
        model: The body.
        wave_speed: Speed of waves in it [m/s].
    """

    def __init__(self, model: TissueModel, wave_speed: float) -> None:
        rest = model.body.rest[: model.body.n_nodes]
        mass = float(model.body.masses[: model.body.n_nodes].sum())
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
            gravity=math.hypot(*model.surroundings.gravity),
            speed_gained=float(SPEED_GAINED * wave_speed),
            unexplained=0.5 * mass * (STRAIN_UNEXPLAINED * wave_speed) ** 2,
            share_unexplained=SHARE_UNEXPLAINED,
        )
        self._write_look, self._judge = SameTypes(write_look), SameTypes(judge_step)

    def look(self, context: StepContext) -> None:
        """Examine the body before a step."""
        self._write_look.call(context, self._bounds.before)

    def begin(
        self, context: StepContext, edge: Edge, when: float, work_of_loads: float, residual: float
    ) -> None:
        """Examine the body before a step, and count from now on what it is given.

        Args:
            context: The body and all that acts on it.
            edge: The cutting edge over the last time step.
            when: Instant of it, as a fraction.
            work_of_loads: Work of loads so far [J].
            residual: That of the account of energy now, if one is kept, else 0 [J].
        """
        bounds, now = self._bounds, self._bounds.before
        self.look(context)
        own = float(now[KINETIC]) + energy_in_springs(context, edge, when)
        bounds.without_gravity, bounds.potential = own, float(now[POTENTIAL])
        bounds.work, bounds.dissipated = float(now[WORK]) + work_of_loads, float(now[DISSIPATED])
        bounds.residual = residual

    def fault(self, frame: FrameContext, dt: float) -> str | None:
        """Return what is wrong with a step since it was last examined; None: nothing.

        Args:
            frame: The body after the step, what acts on it, its account of energy, and the report
                of the blade.
            dt: Length of the step [s].
        """
        found = self._judge.call(frame, self._bounds, dt)
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


class StepBounds(Arrays):
    """Quantities by which a step of a body is judged."""

    before: FloatArray
    """Numbers that `write_look` wrote before the step, shape (`LOOK_NUMBERS`,)."""
    after: FloatArray
    """Numbers that it wrote after the step that was judged last, shape (`LOOK_NUMBERS`,)."""
    without_gravity: FloatCell
    """Energy of the body when counting began: elastic and kinetic, and in all that holds and
    touches it [J]."""
    potential: FloatCell
    """Energy in gravity then [J]."""
    work: FloatCell
    """Work done on it until then [J]."""
    dissipated: FloatCell
    """Energy taken from it until then [J]."""
    residual: FloatCell
    """`Energies.residual` then, where an account of energy is kept, else 0 [J]."""
    excess: FloatCell
    """By how much the step that was judged last was off: in m, or in J."""
    diagonal: float
    """Length of the body at rest [m]."""
    gravity: float
    """Acceleration of free fall [m/s2]."""
    speed_gained: float
    """Speed that a node may gain in a step in addition to that by gravity [m/s]."""
    unexplained: float
    """Energy that may come out of nothing [J]."""
    share_unexplained: float
    """The same as a share of the energy that there was and of what was done and taken since."""


@kernel
def write_look(context: StepContext, out: FloatArray) -> None:
    """Examine the body; it costs one pass over the nodes.

    Args:
        context: The body and all that acts on it.
        out: Written, shape (`LOOK_NUMBERS`,).
    """
    body, gravity = context.body, context.surroundings.gravity
    box, is_finite = empty_box(), True
    squared = kinetic = potential = 0.0
    for node in range(body.n_nodes):
        x, v = vec3(body.positions, node), vec3(body.velocities, node)
        speed_squared, mass = dot(v, v), body.masses[node]
        # A comparison with nan is false: min and max would overlook it.
        is_finite = is_finite and math.isfinite(x.x + x.y + x.z + speed_squared)
        box = with_point(box, x)
        squared = max(squared, speed_squared)
        kinetic += 0.0 if body.fixed[node] else 0.5 * mass * speed_squared
        potential -= (mass - body.added_masses[node]) * dot(gravity, x)
    for c in range(3):
        out[LOW + c], out[HIGH + c] = box.low[c], box.high[c]
    totals, attachments = context.blade.totals, context.attachments
    out[IS_FINITE] = 1.0 if is_finite else 0.0
    out[FASTEST_NODE], out[KINETIC], out[POTENTIAL] = math.sqrt(squared), kinetic, potential
    out[WORK] = totals.work_of_blade + context.supports.work
    spent = totals.work_of_cutting + totals.work_of_breaking + totals.work_of_friction
    spent += attachments.dissipated + attachments.severing
    out[DISSIPATED] = context.damping.dissipated + spent


@kernel
def energy_in_springs(context: StepContext, edge: Edge, when: float) -> float:
    """Return the energy in the body's strain, and in all that holds and touches it [J].

    Args:
        context: The body and all that acts on it.
        edge: The cutting edge over a time step.
        when: Instant of it, as a fraction.
    """
    stored = energy_of_terms(context, edge, when)
    held: float = stored.edge + stored.sides + stored.contacts + stored.attachments
    energy: float = elastic_energy(context.elastic, context.body) + held
    return energy


@kernel
def judge_step(frame: FrameContext, bounds: StepBounds, dt: float) -> int:
    """Return ACCEPTED, or what is wrong with a step.

    What is seen after a step that is accepted is what is there before the next one.

    Args:
        frame: The body after the step, what acts on it, its account of energy, and the report of
            the blade.
        bounds: What it is judged by; `before`, `after` and `excess` are written.
        dt: Length of the step [s].
    """
    before, after = bounds.before, bounds.after
    write_look(frame.relaxation.step, after)
    if after[IS_FINITE] != 1.0:
        return NOT_FINITE_NOW
    # In no time nothing moves, and a blade that cuts is where no motion has led it.
    account, found = frame.account, ACCEPTED
    if dt != 0.0:
        found = _fault(bounds, dt, account.work_of_loads, account.energies[RESIDUAL])
    if found != ACCEPTED:
        return found
    report, total = frame.relaxation.blade.report, 0.0
    for axis in range(3):
        total += report.mean_wrench[0, axis] + report.mean_wrench[1, axis] + report.tip[axis]
    if not math.isfinite(total):
        return FORCE_NOT_FINITE
    for i in range(LOOK_NUMBERS):
        before[i] = after[i]
    return ACCEPTED


@kernel
def _fault(bounds: StepBounds, dt: float, work_of_loads: float, residual: float) -> int:
    """Return ACCEPTED, or which law the motion in a step breaks; see `judge_step`."""
    before, after = bounds.before, bounds.after
    # The sides of the box move as fast as nodes do; what turns round within the step moves by
    # less than the body is long.
    speed = 2.0 * before[FASTEST_NODE] + bounds.speed_gained
    reach = bounds.diagonal + speed * dt + bounds.gravity * dt * dt
    way = 0.0
    for c in range(3):
        way = max(way, before[LOW + c] - after[LOW + c], after[HIGH + c] - before[HIGH + c])
    if not way <= reach:
        bounds.excess = way
        return LEFT_BOX
    work = abs(after[WORK] + work_of_loads - bounds.work)
    dissipated = after[DISSIPATED] - bounds.dissipated
    allowed = bounds.unexplained
    allowed += bounds.share_unexplained * (abs(bounds.without_gravity) + work + dissipated)
    # In either direction: a blade that is led backward takes hold of tissue that is bent already,
    # and what that gives it is not counted as work.
    given = bounds.without_gravity + (bounds.potential - after[POTENTIAL]) + work
    excess = after[KINETIC] - given
    if not excess <= allowed:
        bounds.excess = excess
        return TOO_FAST
    if not bounds.residual - residual <= allowed:
        bounds.excess = bounds.residual - residual
        return OUT_OF_NOTHING
    return ACCEPTED
