"""Position Verlet: half a step of drift, one evaluation of the forces, half a step of drift.

    x <- x + h/2 v
    v <- v + h a(x)
    x <- x + h/2 v

Of second order, symplectic, one evaluation where the Runge-Kutta method takes three. Damping acts
between the steps (`tissue.integrators.damping`).
"""

from tissue.blade.edge import Edge
from tissue.core.jit import kernel
from tissue.integrators.geom_reactions import add_geom_reactions
from tissue.integrators.node_loops import is_solid
from tissue.integrators.runge_kutta import apply_outer_forces
from tissue.integrators.shared_loops import (
    DISPLACED,
    DISPLACEMENTS,
    DRIFTING,
    KICKING,
    deform_shared,
    run_loop,
)
from tissue.integrators.step_context import StepContext
from tissue.integrators.supports import add_support_work


@kernel
def position_verlet(context: StepContext, edge: Edge, dt: float, at: float, share: float) -> None:
    """Take one step, without damping, contact or slip.

    Args:
        context: What takes part.
        edge: The cutting edge over the time step.
        dt: Length of the time step [s].
        at: Fraction of the time step at which the step begins.
        share: Length of the step as a fraction of the time step.
    """
    body, h, moves_in_loops = context.body, share * dt, is_solid(context)
    run_loop(context, DRIFTING, 0.5 * h)
    at_middle = at + 0.5 * share
    apply_outer_forces(context, edge, body.positions, body.velocities, at_middle, share, dt)
    deform_shared(context, DISPLACED if moves_in_loops else DISPLACEMENTS)
    add_geom_reactions(context, body.positions, body.velocities, share, dt)
    if context.supports.is_moving == 1:
        add_support_work(context, body.positions, body.velocities, h)
    run_loop(context, KICKING, h)
    if not moves_in_loops:
        # Only now: until here springs saw all nodes at the middle of the step.
        run_loop(context, DRIFTING, 0.5 * h)
