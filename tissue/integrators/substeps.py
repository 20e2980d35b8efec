"""Steps of the integrators of all nodes, each with its damping, its contact and its slip."""

from tissue.blade.edge import Edge
from tissue.blade.forces import apply_slip
from tissue.contact.geoms.kinematic_contact import clear_geom_forces, end_geom_substep
from tissue.contact.response.forces import end_contact_substep
from tissue.core.jit import kernel
from tissue.elasticity.collapse import clear_collapse_forces
from tissue.integrators.attachments import clear_attachment_forces
from tissue.integrators.damping import change_velocities
from tissue.integrators.nystroem import three_stage_nystroem
from tissue.integrators.rigid_motion import (
    add_rigid_part,
    note_loose_positions,
    return_rigid_motion,
)
from tissue.integrators.runge_kutta import runge_kutta_nystroem
from tissue.integrators.shared_loops import DAMPING_CHANGES, run_loop
from tissue.integrators.stage_damping import (
    begin_damped_step,
    counts_stage_damping,
    end_damped_step,
)
from tissue.integrators.step_context import StepContext
from tissue.integrators.strands import slip_strands
from tissue.integrators.supports import add_support_damping
from tissue.integrators.verlet import position_verlet


@kernel
def runge_kutta_steps(
    context: StepContext, edge: Edge, dt: float, begin: float, end: float, n: int
) -> None:
    """Take `n` Runge-Kutta steps, each with its damping, its contact and the slip of the blade.

    Args:
        context: What takes part.
        edge: The cutting edge over the time step.
        dt: Length of the time step [s].
        begin: Fraction of the time step at which to begin.
        end: Fraction of the time step at which to end.
        n: Number of steps from `begin` to `end`.
    """
    share = (end - begin) / n
    for i in range(n):
        at = begin + i * share
        damp_if_due(context, i, n, share * dt)
        _runge_kutta_step(context, edge, dt, at, share)
        _end_step(context, edge, dt, share, at + share)


@kernel
def nystroem_steps(
    context: StepContext, edge: Edge, dt: float, begin: float, end: float, n: int
) -> None:
    """Take `n` Nystroem steps of three stages; see `runge_kutta_steps`.

    Args:
        context: What takes part.
        edge: The cutting edge over the time step.
        dt: Length of the time step [s].
        begin: Fraction of the time step at which to begin.
        end: Fraction of the time step at which to end.
        n: Number of steps from `begin` to `end`.
    """
    share = (end - begin) / n
    for i in range(n):
        at = begin + i * share
        damp_if_due(context, i, n, share * dt)
        three_stage_nystroem(context, edge, dt, at, share)
        _end_step(context, edge, dt, share, at + share)


@kernel
def verlet_steps(
    context: StepContext, edge: Edge, dt: float, begin: float, end: float, n: int
) -> None:
    """Take `n` steps of position Verlet; see `runge_kutta_steps`.

    Args:
        context: What takes part.
        edge: The cutting edge over the time step.
        dt: Length of the time step [s].
        begin: Fraction of the time step at which to begin.
        end: Fraction of the time step at which to end.
        n: Number of steps from `begin` to `end`.
    """
    share = (end - begin) / n
    for i in range(n):
        at = begin + i * share
        damp_if_due(context, i, n, share * dt)
        position_verlet(context, edge, dt, at, share)
        _end_step(context, edge, dt, share, at + share)


@kernel
def damp_if_due(context: StepContext, i: int, n: int, h: float) -> None:
    """Before a step, let damping act between steps if it is due.

    Args:
        context: What takes part.
        i: The step, from 0 on.
        n: Number of steps in this part of the time step.
        h: Length of a step [s].
    """
    interval = context.damping.interval
    if i % interval == 0:
        damp(context, min(interval, n - i) * h)


@kernel
def damp(context: StepContext, h: float) -> None:
    """Let half of the damping of the last steps act, and half of that of the steps to come.

    Args:
        context: What takes part.
        h: Length of the step to come, or of the two steps [s].
    """
    damping = context.damping
    seconds = damping.owed + 0.5 * h
    damping.owed = 0.5 * h
    if damping.retardation_time > 0.0 or damping.drag > 0.0:
        run_loop(context, DAMPING_CHANGES, seconds)
        factor, change = seconds * damping.drag, context.stages.change
        add_rigid_part(context.body, context.loose, context.body.velocities, factor, change)
        if context.supports.is_moving == 1:
            add_support_damping(context, seconds)
        change_velocities(damping, context.body, context.stages)


@kernel
def _runge_kutta_step(context: StepContext, edge: Edge, dt: float, at: float, share: float) -> None:
    """Take one Runge-Kutta step; count the damping in its stages. See `runge_kutta_nystroem`."""
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


@kernel
def _end_step(context: StepContext, edge: Edge, dt: float, share: float, when: float) -> None:
    """End a step: contacts slide, forces are cleared, and the blade slips.

    Args:
        context: What takes part.
        edge: The cutting edge over the time step.
        dt: Length of the time step [s].
        share: Length of the step as a fraction of the time step.
        when: End of the step, as a fraction of the time step.
    """
    seconds = share * dt
    body, external = context.body, context.stages.external
    end_contact_substep(context.contacts, body.positions, body.velocities, external)
    clear_attachment_forces(context.attachments, external)
    clear_geom_forces(context.geoms, external)
    clear_collapse_forces(context.elastic.collapsing, body, external)
    end_geom_substep(context.geoms, body, seconds, when, dt)
    apply_slip(context.blade, body, context.visits, edge, external, when, seconds)
    if context.attachments.n_caught > 0:
        slip_strands(context.attachments, body.positions, edge, when)
