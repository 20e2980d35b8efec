"""Whether a body may move as it did in a time step, by its own laws."""

import math
from typing import Final

from tissue.blade.edge import Edge
from tissue.blade.forces import edge_energy
from tissue.blade.side_contact import sides_energy
from tissue.core.array_types import FloatArray
from tissue.core.jit import kernel
from tissue.core.structs import Arrays, FloatCell
from tissue.core.vec3 import dot, vec3
from tissue.elasticity.internal_forces import elastic_energy
from tissue.geometry.aabb import empty_box, with_point
from tissue.integrators.attachments import attached_energy
from tissue.integrators.step_context import StepContext

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


class StepBounds(Arrays):
    """What a step of a body is judged by."""

    before: FloatArray
    """What `write_look` wrote before the step, shape (`LOOK_NUMBERS`,)."""
    after: FloatArray
    """What it wrote after the step that was judged last, shape (`LOOK_NUMBERS`,)."""
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
    """Speed that a node may gain in a step beside that by gravity [m/s]."""
    unexplained: float
    """Energy that may come out of nothing [J]."""
    share_unexplained: float
    """The same as a share of the energy that there was and of what was done and taken since."""


@kernel
def write_look(context: StepContext, out: FloatArray) -> None:
    """Look at the body; it costs one pass over the nodes.

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
    body, blade, attachments = context.body, context.blade, context.attachments
    held: float = edge_energy(blade, body, edge, when) + sides_energy(blade.sides)
    held += context.contacts.stored
    held += attached_energy(attachments, body.positions, 0, len(attachments.nodes))
    energy: float = elastic_energy(context.elastic, body) + held
    return energy


@kernel
def judge_step(
    context: StepContext,
    bounds: StepBounds,
    dt: float,
    work_of_loads: float,
    residual: float,
    force: float,
) -> int:
    """Return ACCEPTED, or what is wrong with a step.

    What is seen after a step that is accepted is what is there before the next one.

    Args:
        context: The body after the step, and all that acts on it.
        bounds: What it is judged by; `before`, `after` and `excess` are written.
        dt: Length of the step [s].
        work_of_loads: Work of loads so far [J].
        residual: `Energies.residual`, where an account of energy is kept, else 0 [J].
        force: A sum of what the blade feels: finite, or not.
    """
    before, after = bounds.before, bounds.after
    write_look(context, after)
    if after[IS_FINITE] != 1.0:
        return NOT_FINITE_NOW
    # In no time nothing moves, and a blade that cuts is where no motion has led it.
    found = ACCEPTED if dt == 0.0 else _fault(bounds, dt, work_of_loads, residual)
    if found != ACCEPTED:
        return found
    if not math.isfinite(force):
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
