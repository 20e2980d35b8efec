"""Position Verlet: half a step of drift, one evaluation of the forces, half a step of drift.

    x <- x + h/2 v
    v <- v + h a(x)
    x <- x + h/2 v

Of second order, symplectic, one evaluation where the Runge-Kutta method takes three. Damping acts
between the steps (`tissue.integrators.damping`).
"""

from tissue.blade.edge import Edge
from tissue.core.jit import kernel
from tissue.forces.acceleration import is_solid
from tissue.forces.step_context import Instant, StepContext
from tissue.integrators.core_motion import drift_cores
from tissue.integrators.evaluation import evaluate_forces
from tissue.integrators.node_loops import DISPLACED, DISPLACEMENTS, DRIFTING, KICKING, run_loop


@kernel
def verlet_step(context: StepContext, edge: Edge, dt: float, at: float, share: float) -> None:
    """Take one step, without damping, the end of contact or slip.

    Args:
        context: What takes part.
        edge: The cutting edge over the time step.
        dt: Length of the time step [s].
        at: Fraction of the time step at which the step begins.
        share: Length of the step as a fraction of the time step.
    """
    h, moves_in_loops = share * dt, is_solid(context)
    run_loop(context, DRIFTING, 0.5 * h)
    drift_cores(context, 0.5 * h)
    x, v = context.body.positions, context.body.velocities
    loop = DISPLACED if moves_in_loops else DISPLACEMENTS
    evaluate_forces(context, edge, x, v, loop, Instant(at + 0.5 * share, share, h, dt))
    run_loop(context, KICKING, h)
    if not moves_in_loops:
        # Only now: until here springs saw all nodes at the middle of the step.
        run_loop(context, DRIFTING, 0.5 * h)
    drift_cores(context, 0.5 * h)
