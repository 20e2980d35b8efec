"""Damping and relaxation of stress, which act between the steps of an integrator.

Viscosity and drag change velocities between two elastic steps or pairs.

With D the damping and E the elastic motion the steps are D(s/2) E(s) D(s) E(s) D(s) ..., Strang's
splitting. E(s) is one step of the integrator or, where damping is slow, two. Each D is one explicit
step at the positions as they are,

    v <- v + s (viscous force / m - drag v)

of first order: a motion that dies away at the rate r does so at about r (1 + r s / 2). A second
evaluation of the viscosity would be needed for the second order.

It is stable up to s times the highest rate = 2 (`tissue.integrators.stability`). What it takes from
the kinetic energy is what is dissipated, so that no integral of a power is needed.

Where damping acts in every stage of a step instead, its power is integrated for an account of
energy by Simpson's rule, from the motion at the begin, the middle and the end of the step: one
order below the motion itself.
"""

from typing import Final

from tissue.core.jit import kernel
from tissue.core.simd import point, store_point, times
from tissue.core.vec3 import dot, vec3
from tissue.elasticity.energy import dissipated_power, relaxed_energy
from tissue.elasticity.finite_elements import averages_shear
from tissue.elasticity.gradients import keeps_gradients
from tissue.elasticity.neo_hookean import has_averages
from tissue.elasticity.viscoelasticity import prepare_relaxation
from tissue.elasticity.viscous_stress import is_viscous
from tissue.forces.attachment_dampers import change_by_dampers
from tissue.forces.rigid_motion import add_rigid_part
from tissue.forces.step_context import Damping, Stages, StepContext
from tissue.forces.supports import add_support_damping
from tissue.integrators.core_motion import change_cores_as_one
from tissue.integrators.methods import METHODS, OF_NEXT_STEP
from tissue.integrators.node_loops import (
    AVERAGES,
    DAMPING_CHANGES,
    DISPLACEMENTS,
    GRADIENTS,
    NODE_RELAXATION,
    STRESS_RELAXATION,
    resist_shared,
    run_loop,
)
from tissue.mesh.body import Body

SLOW_DAMPING = 0.8
"""Highest rate of damping times two steps up to which damping acts once in two steps; with Verlet
that of the uncut body. What dies away fastest does so at 2.0 times its rate then, a mode of single
elements; one of half its frequency at 1.12 times. In liver the product is 0.62 with four steps of
Verlet in a millisecond, and 1.24 with two of the Nystroem method, with which damping acts in
each."""

FASTEST_DECAY = 1.0
"""The same for the body as it is cut, with Verlet: up to here damping stops no motion in less than
the interval, and turns none round. Slivers die away faster than by their rate then. After the
organ's cut, whose slivers raise the highest rate by half, it is 0.91 with four steps."""

_GRADIENTS: Final = tuple(method.gradients for method in METHODS.values())

LONGEST_INTERVAL = 2
"""Steps between two times that damping acts, at most. What turns by pi in an interval, at the same
phase each time, would keep the part of its motion that is not velocity: in two steps that is the
fastest mode there may be."""


@kernel
def change_velocities(damping: Damping, body: Body, stages: Stages) -> None:
    """Change all velocities as `damping_changes` found, and count what is dissipated."""
    v = body.velocities
    dissipated = 0.0
    for i in range(body.n_nodes):
        before = vec3(v, i)
        store_point(v, i, point(v, i) + point(stages.change, i))
        after = vec3(v, i)
        dissipated += 0.5 * body.masses[i] * (dot(before, before) - dot(after, after))
    damping.dissipated += dissipated


@kernel
def damp_if_due(context: StepContext, method: int, i: int, n: int, h: float, dt: float) -> None:
    """Apply the damping between steps, before a step, if it is due.

    Args:
        context: What takes part.
        method: Number of the method (`tissue.integrators.methods`).
        i: The step, from 0 on.
        n: Number of steps in this part of the time step.
        h: Length of a step [s].
        dt: Length of the time step [s].
    """
    interval = context.damping.interval
    if i % interval == 0:
        damp(context, min(interval, n - i) * h, dt, _GRADIENTS[method] == OF_NEXT_STEP)


@kernel
def damp(context: StepContext, h: float, dt: float, begins_here: bool) -> None:
    """Apply half of the damping of the last steps, and half of that of the steps to come.

    Args:
        context: What takes part.
        h: Length of the step to come, or of the two steps [s].
        dt: Length of the time step [s].
        begins_here: Whether that step begins with forces where the body is now.
    """
    damping = context.damping
    seconds = damping.owed + 0.5 * h
    damping.owed = 0.5 * h
    has_dampers = len(context.attachments.nodes) > 0
    if damping.retardation_time > 0.0 or damping.drag > 0.0 or has_dampers:
        if damping.retardation_time > 0.0 and is_viscous(context.elastic.viscosity):
            _resist(context, begins_here)
        run_loop(context, DAMPING_CHANGES, seconds)
        factor, change = seconds * damping.drag, context.stages.change
        add_rigid_part(context.body, context.loose, context.body.velocities, factor, change)
        if has_dampers:
            change_by_dampers(context, seconds, dt)
        change_cores_as_one(context, change)
        if context.supports.is_moving == 1:
            add_support_damping(context, seconds)
        change_velocities(damping, context.body, context.stages)


@kernel
def _resist(context: StepContext, begins_here: bool) -> None:
    """Evaluate how tetrahedra resist the motion; see `damp`.

    Gradients that are kept are found for both, the damping and the step.
    """
    solid = context.elastic.solid
    if solid.are_gradients_known == 0:
        run_loop(context, DISPLACEMENTS, 0.0)
        if begins_here and keeps_gradients(solid):
            run_loop(context, GRADIENTS, 0.0)
            if averages_shear(solid):
                run_loop(context, AVERAGES, 0.0)
            solid.are_gradients_known = 1
    resist_shared(context, context.body.velocities)


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
    # Simpson's rule for the displacement gives the velocity half-moved, of 4th order as the rest.
    middle = stages.start_velocities
    for i in range(body.n_nodes):
        moved = point(body.positions, i) - point(stages.start_positions, i)
        ends = point(middle, i) + point(body.velocities, i)
        store_point(middle, i, times(1.5 / h, moved) - times(0.25, ends))
    half_way = dissipated_power(body, elastic, around, stages.positions, middle, stages.change)
    context.damping.dissipated += h / 6.0 * (before + 4.0 * half_way + after)


@kernel
def relax_stress(context: StepContext, seconds: float) -> None:
    """Relax the stress of quasi-linear viscoelasticity for that time [s], which may be infinite.

    What Maxwell elements dissipate is counted with the damping where an account is kept.
    """
    solid = context.elastic.solid
    is_counted = context.damping.is_counted == 1
    prepare_relaxation(solid, seconds)
    run_loop(context, DISPLACEMENTS, 0.0)
    run_loop(context, GRADIENTS, 0.0)
    if has_averages(solid):
        run_loop(context, AVERAGES, 0.0)
    before = relaxed_energy(solid, context.body) if is_counted else 0.0
    run_loop(context, STRESS_RELAXATION, 0.0)
    if averages_shear(solid):
        run_loop(context, NODE_RELAXATION, 0.0)
    if is_counted:
        context.damping.dissipated += before - relaxed_energy(solid, context.body)
