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
by
the factor 1 - d z^6 in a step. Nystroem's own method has c = 1/2, d = 1/288 and is stable up to
z = 2.59; at c = 1/3 both are best: d = 1/864, and z up to sqrt(12) = 3.46.

Contact and friction depend on velocities, too. For them the stages have the velocities

    v2 = v + h/3 a1,   v3 = v + h (5/4 a2 - 5/12 a1),

a Runge-Kutta method of third order.
"""

from typing import Final

from tissue.blade.edge import Edge
from tissue.core.jit import kernel
from tissue.integrators.geom_reactions import add_geom_reactions
from tissue.integrators.node_loops import is_solid
from tissue.integrators.runge_kutta import apply_outer_forces
from tissue.integrators.shared_loops import (
    DEFORMED,
    DISPLACED,
    DISPLACEMENTS,
    DISPLACEMENTS_2,
    DISPLACEMENTS_LAST,
    NYSTROEM_FIRST,
    NYSTROEM_SECOND,
    NYSTROEM_THIRD,
    deform_shared,
    run_loop,
)
from tissue.integrators.step_context import StepContext
from tissue.integrators.supports import add_support_work

INSTANTS: Final = (0.0, 1.0 / 3.0, 5.0 / 6.0)
"""Instants of the stages, as fractions of the step."""

WEIGHTS: Final = (1.0 / 10.0, 1.0 / 2.0, 2.0 / 5.0)
"""Weights of the stages in an integral over the step."""


@kernel
def three_stage_nystroem(
    context: StepContext, edge: Edge, dt: float, at: float, share: float
) -> None:
    """Take one step, without damping, contact impulses or slip.

    Args:
        context: What takes part.
        edge: The cutting edge over the time step.
        dt: Length of the time step [s].
        at: Fraction of the time step at which the step begins.
        share: Length of the step as a fraction of the time step.
    """
    body, stages, h = context.body, context.stages, share * dt
    is_moving, is_displaced = context.supports.is_moving == 1, is_solid(context)
    x1, v1, w1 = body.positions, body.velocities, WEIGHTS[0]
    apply_outer_forces(context, edge, x1, v1, at + INSTANTS[0] * share, share * w1, dt)
    solid = context.elastic.solid
    deform_shared(context, DEFORMED if solid.are_gradients_known == 1 else DISPLACEMENTS)
    solid.are_gradients_known = 0
    add_geom_reactions(context, x1, v1, share * w1, dt)
    if is_moving:
        add_support_work(context, x1, v1, h * w1)
    run_loop(context, NYSTROEM_FIRST, h)
    x2, v2, w2 = stages.positions, stages.velocities, WEIGHTS[1]
    apply_outer_forces(context, edge, x2, v2, at + INSTANTS[1] * share, share * w2, dt)
    deform_shared(context, DISPLACED if is_displaced else DISPLACEMENTS_2)
    add_geom_reactions(context, x2, v2, share * w2, dt)
    if is_moving:
        add_support_work(context, x2, v2, h * w2)
    run_loop(context, NYSTROEM_SECOND, h)
    x3, v3, w3 = stages.last_positions, stages.velocities, WEIGHTS[2]
    apply_outer_forces(context, edge, x3, v3, at + INSTANTS[2] * share, share * w3, dt)
    deform_shared(context, DISPLACED if is_displaced else DISPLACEMENTS_LAST)
    add_geom_reactions(context, x3, v3, share * w3, dt)
    if is_moving:
        add_support_work(context, x3, v3, h * w3)
    run_loop(context, NYSTROEM_THIRD, h)
