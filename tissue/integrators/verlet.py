"""Position Verlet: half a step of drift, one evaluation of the forces, half a step of drift.

    x <- x + h/2 v
    v <- v + h a(x)
    x <- x + h/2 v

Of second order, symplectic, one evaluation where the Runge-Kutta method takes three. Damping acts
between the steps (`tissue.integrators.damping`).
"""

from tissue.blade.edge import Edge
from tissue.core.jit import kernel
from tissue.core.simd import point, store_point, times
from tissue.elasticity.internal_forces import deform
from tissue.integrators.runge_kutta import acceleration, apply_outer_forces
from tissue.integrators.step_context import StepContext


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
    body, h = context.body, share * dt
    x, v = body.positions, body.velocities
    for i in range(body.n_nodes):
        store_point(x, i, point(x, i) + times(0.5 * h, point(v, i)))
    apply_outer_forces(context, edge, x, v, at + 0.5 * share, share, dt)
    deform(context.elastic, body, x)
    for i in range(body.n_nodes):
        store_point(v, i, point(v, i) + times(h, acceleration(context, i, x, v)))
    # Only now: until here springs saw all nodes at the middle of the step.
    for i in range(body.n_nodes):
        store_point(x, i, point(x, i) + times(0.5 * h, point(v, i)))
