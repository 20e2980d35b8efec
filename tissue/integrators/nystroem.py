"""Three-stage Runge-Kutta-Nystroem method of 4th order, for forces that depend on positions.

    a1 = a(t,          x)
    a2 = a(t + h/3,    x + h/3 v  + h^2/18 a1)
    a3 = a(t + 5 h/6,  x + 5 h/6 v + h^2 (5/144 a1 + 5/16 a2))
    x <- x + h v + h^2 (a1/10 + a2/3 + a3/15)
    v <- v + h (a1/10 + a2/2 + 2/5 a3)

The methods of 4th order with three stages, the first at t, are a family with one parameter, the
instant c of the second stage: the third is at (3 - 4 c) / (4 - 6 c), for the weights must integrate
polynomials of third degree, and the other coefficients follow (Hairer, Norsett and Wanner, Solving
Ordinary Differential Equations I, II.14). For x'' = -w^2 x and z = w h the energy of a mode falls
by the factor 1 - d z^6 in a step. Nystroem's own method has c = 1/2, d = 1/288 and is stable up to
z = 2.59; at c = 1/3 both are best: d = 1/864, and z up to sqrt(12) = 3.46.

Contact and friction depend on velocities, too. For them the stages have the velocities

    v2 = v + h/3 a1,   v3 = v + h (5/4 a2 - 5/12 a1),

a Runge-Kutta method of third order.
"""

from typing import Final

from tissue.blade.edge import Edge
from tissue.core.jit import inlined, kernel
from tissue.forces.acceleration import is_solid
from tissue.forces.step_context import Instant, StepContext
from tissue.integrators.core_motion import hold_cores
from tissue.integrators.evaluation import evaluate_forces
from tissue.integrators.node_loops import (
    DEFORMED,
    DISPLACED,
    DISPLACEMENTS,
    DISPLACEMENTS_2,
    DISPLACEMENTS_LAST,
    NYSTROEM_FIRST,
    NYSTROEM_SECOND,
    NYSTROEM_THIRD,
    run_loop,
)

INSTANTS: Final = (0.0, 1.0 / 3.0, 5.0 / 6.0)
"""Instants of the stages, as fractions of the step."""

WEIGHTS: Final = (1.0 / 10.0, 1.0 / 2.0, 2.0 / 5.0)
"""Weights of the stages in an integral over the step."""


@kernel
def nystroem_step(context: StepContext, edge: Edge, dt: float, at: float, share: float) -> None:
    """Take one step, without damping, the end of contact or slip.

    Args:
        context: What takes part.
        edge: The cutting edge over the time step.
        dt: Length of the time step [s].
        at: Fraction of the time step at which the step begins.
        share: Length of the step as a fraction of the time step.
    """
    body, stages, solid, h = context.body, context.stages, context.elastic.solid, share * dt
    is_displaced = is_solid(context)
    x1, v1 = body.positions, body.velocities
    loop = DEFORMED if solid.are_gradients_known == 1 else DISPLACEMENTS
    evaluate_forces(context, edge, x1, v1, loop, _instant(0, at, share, dt))
    solid.are_gradients_known = 0
    run_loop(context, NYSTROEM_FIRST, h)
    x2, v2 = stages.positions, stages.velocities
    hold_cores(context, x2, v2)
    loop = DISPLACED if is_displaced else DISPLACEMENTS_2
    evaluate_forces(context, edge, x2, v2, loop, _instant(1, at, share, dt))
    run_loop(context, NYSTROEM_SECOND, h)
    x3, v3 = stages.last_positions, stages.velocities
    hold_cores(context, x3, v3)
    loop = DISPLACED if is_displaced else DISPLACEMENTS_LAST
    evaluate_forces(context, edge, x3, v3, loop, _instant(2, at, share, dt))
    run_loop(context, NYSTROEM_THIRD, h)
    hold_cores(context, x1, v1)


@inlined
def _instant(stage: int, at: float, share: float, dt: float) -> Instant:
    """Return the instant of a stage of a step, from `at` on, and its weight."""
    weight = WEIGHTS[stage]
    return Instant(at + INSTANTS[stage] * share, share * weight, share * dt * weight, dt)
