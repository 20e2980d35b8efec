"""The two-level Runge-Kutta method: positions and velocities in one step of 4th order.

Nystroem's form (Collatz, chapter 2: the paper's reference [4]):

    a1 = a(t,       x,   v           )
    X  = x + h/2 v + h^2/8 a1                  one position for stages 2 and 3
    a2 = a(t + h/2, X,   v + h/2 a1  )
    a3 = a(t + h/2, X,   v + h/2 a2  )
    x4 = x + h v + h^2/2 a3
    a4 = a(t + h,   x4,  v + h a3    )
    x <- x + h v + h^2/6 (a1 + a2 + a3)        the paper's correction terms are those in h^2
    v <- v + h/6 (a1 + 2 a2 + 2 a3 + a4)

Elastic forces are evaluated three times a step. Damping is evaluated four times where it acts in
every stage, for the full order; by default it acts between the steps
(`tissue.integrators.damping`).
"""

from tissue.blade.edge import Edge
from tissue.core.jit import kernel
from tissue.elasticity.viscous_stress import is_viscous
from tissue.forces.rigid_motion import note_loose_positions, return_rigid_motion
from tissue.forces.step_context import Instant, StepContext
from tissue.integrators.core_motion import hold_cores
from tissue.integrators.damping import (
    begin_damped_step,
    counts_stage_damping,
    end_damped_step,
)
from tissue.integrators.evaluation import evaluate_forces
from tissue.integrators.node_loops import (
    DISPLACEMENTS,
    DISPLACEMENTS_2,
    DISPLACEMENTS_LAST,
    FIRST_STAGE,
    FOURTH_STAGE,
    SECOND_STAGE,
    THIRD_STAGE,
    resist_shared,
    run_loop,
)


@kernel
def runge_kutta_step(context: StepContext, edge: Edge, dt: float, at: float, share: float) -> None:
    """Take one step, without the end of contact and the slip of the blade.

    The damping in its stages is counted; loose pieces get back what drag took from their motion.

    Args:
        context: What takes part.
        edge: The cutting edge over the time step.
        dt: Length of the time step [s].
        at: Fraction of the time step at which the step begins.
        share: Length of the step as a fraction of the time step.
    """
    is_counted = counts_stage_damping(context)
    is_dragged = context.surroundings.drag > 0.0 and len(context.loose.node) > 0
    before = begin_damped_step(context) if is_counted else 0.0
    if is_dragged:
        note_loose_positions(context)
    runge_kutta_nystroem(context, edge, dt, at, share)
    if is_counted:
        end_damped_step(context, before, share * dt)
    if is_dragged:
        return_rigid_motion(context, share * dt)
    hold_cores(context, context.body.positions, context.body.velocities)


@kernel
def runge_kutta_nystroem(
    context: StepContext, edge: Edge, dt: float, at: float, share: float
) -> None:
    """Take the stages of one step.

    Args:
        context: What takes part.
        edge: The cutting edge over the time step.
        dt: Length of the time step [s].
        at: Fraction of the time step at which the step begins.
        share: Length of the step as a fraction of the time step.
    """
    body, stages, h = context.body, context.stages, share * dt
    half, end = at + 0.5 * share, at + share
    x1, v1 = body.positions, body.velocities
    first = Instant(at, share / 6.0, h / 6.0, dt)
    evaluate_forces(context, edge, x1, v1, DISPLACEMENTS, first)
    run_loop(context, FIRST_STAGE, h)
    x2, v2 = stages.positions, stages.velocities
    hold_cores(context, x2, v2)
    middle = Instant(half, share * 2.0 / 3.0, h * 2.0 / 3.0, dt)
    evaluate_forces(context, edge, x2, v2, DISPLACEMENTS_2, middle)
    run_loop(context, SECOND_STAGE, h)
    if context.surroundings.retardation_time > 0.0:
        if is_viscous(context.elastic.viscosity):
            resist_shared(context, stages.change)
        run_loop(context, THIRD_STAGE, h)
    x4, v4 = stages.last_positions, stages.velocities
    hold_cores(context, x4, v4)
    last = Instant(end, share / 6.0, h / 6.0, dt)
    evaluate_forces(context, edge, x4, v4, DISPLACEMENTS_LAST, last)
    run_loop(context, FOURTH_STAGE, h)
