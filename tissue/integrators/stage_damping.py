"""What is lost in damping in a step whose stages are damped, for an account of energy.

The power is integrated by Simpson's rule, from the motion at the begin, the middle and the end of
the step: one order below the motion itself.
"""

from tissue.core.jit import kernel
from tissue.core.simd import point, store_point, times
from tissue.elasticity.energy import dissipated_power
from tissue.integrators.step_context import StepContext


@kernel
def counts_stage_damping(context: StepContext) -> bool:
    """Return whether stages are damped, and the loss is to be counted."""
    around = context.surroundings
    is_damped = around.retardation_time > 0.0 or around.drag > 0.0
    return is_damped and context.damping.is_counted == 1


@kernel
def begin_damped_step(context: StepContext) -> float:
    """Note the motion before a step; return the power that is lost in damping now [W]."""
    body, stages = context.body, context.stages
    for i in range(body.n_nodes):
        store_point(stages.start_positions, i, point(body.positions, i))
        store_point(stages.start_velocities, i, point(body.velocities, i))
    return dissipated_power(
        body,
        context.elastic,
        context.surroundings,
        body.positions,
        body.velocities,
        stages.change,
    )


@kernel
def end_damped_step(context: StepContext, before: float, h: float) -> None:
    """Count what a step of `h` [s] lost; `before` is the power at its begin [W]."""
    body, stages = context.body, context.stages
    elastic, around = context.elastic, context.surroundings
    after = dissipated_power(body, elastic, around, body.positions, body.velocities, stages.change)
    # Simpson's rule for the displacement gives the velocity half-way, of 4th order as the rest.
    middle = stages.start_velocities
    for i in range(body.n_nodes):
        way = point(body.positions, i) - point(stages.start_positions, i)
        ends = point(middle, i) + point(body.velocities, i)
        store_point(middle, i, times(1.5 / h, way) - times(0.25, ends))
    half_way = dissipated_power(body, elastic, around, stages.positions, middle, stages.change)
    context.damping.dissipated += h / 6.0 * (before + 4.0 * half_way + after)
