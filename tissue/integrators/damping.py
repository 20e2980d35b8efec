"""Damping once a step: dampers and drag change the velocities between two elastic steps.

With D the damping and E the elastic motion the steps are D(h/2) E(h) D(h) E(h) D(h) ..., Strang's
splitting. Each D is one explicit step at the positions as they are,

    v <- v + s (viscous force / m - drag v)

of first order: a motion that dies away at the rate r does so at r (1 + r h / 2). A second
evaluation of the dampers in each step would be needed for the second order.

It is stable up to s times the highest rate = 2 (`tissue.integrators.stability`). What it takes from
the kinetic energy is what the dampers dissipate, so that no integral of a power is needed.
"""

from tissue.core.jit import kernel
from tissue.core.simd import point, point_of, store_point, times
from tissue.core.structs import Arrays, FloatCell
from tissue.core.vec3 import dot, vec3
from tissue.elasticity.internal_forces import Elastic, viscous_force
from tissue.integrators.stages import Stages
from tissue.mesh.body import Body


class Damping(Arrays):
    """Damping that acts once a step, and the loss in damping either way."""

    owed: FloatCell
    """Time for which it has yet to act [s]: the second half of the last step."""
    dissipated: FloatCell
    """Energy lost in viscosity and drag so far [J]; where damping acts in every stage it is counted
    for an account of energy alone."""
    retardation_time: float
    """Damping along each edge, per stiffness of the edge [s]; 0 where it acts in every stage."""
    drag: float
    """Rate at which free motion dies away [1/s]; 0 where it acts in every stage."""


@kernel
def damp(damping: Damping, body: Body, elastic: Elastic, stages: Stages, h: float) -> None:
    """Let half of the damping of the last step act, and half of that of the step to come.

    Args:
        damping: What is owed and what is dissipated are written.
        body: Velocities are written.
        elastic: The dampers.
        stages: Scratch.
        h: Length of the step to come [s].
    """
    seconds = damping.owed + 0.5 * h
    damping.owed = 0.5 * h
    time, drag = damping.retardation_time, damping.drag
    if time == 0.0 and drag == 0.0:
        return
    x, v = body.positions, body.velocities
    for i in range(body.n_nodes):
        change = point_of(0.0, 0.0, 0.0)
        if not body.fixed[i]:
            change = times(-drag, point(v, i))
            if time > 0.0:
                force = viscous_force(elastic, i, x, v, time)
                change = change + times(1.0 / body.masses[i], force)
        store_point(stages.change, i, times(seconds, change))
    dissipated = 0.0
    for i in range(body.n_nodes):
        before = vec3(v, i)
        store_point(v, i, point(v, i) + point(stages.change, i))
        after = vec3(v, i)
        dissipated += 0.5 * body.masses[i] * (dot(before, before) - dot(after, after))
    damping.dissipated += dissipated
