"""Increments of the methods that move all nodes together."""

from tissue.blade.edge import Edge
from tissue.core.jit import kernel
from tissue.integrators.step_choice import StepChoice, next_part
from tissue.integrators.step_context import StepContext
from tissue.integrators.substeps import (
    nystroem_steps,
    runge_kutta_steps,
    verlet_steps,
)


@kernel
def advance_by_nystroem(choice: StepChoice, context: StepContext, edge: Edge) -> None:
    """Advance the motion by the increment of `begin_increment`, by the Nystroem method."""
    while next_part(choice, context):
        begin, end, n = choice.begin, choice.part_end, choice.n_steps
        nystroem_steps(context, edge, choice.dt, begin, end, n)


@kernel
def advance_by_verlet(choice: StepChoice, context: StepContext, edge: Edge) -> None:
    """Advance the motion by the increment of `begin_increment`, by position Verlet."""
    while next_part(choice, context):
        begin, end, n = choice.begin, choice.part_end, choice.n_steps
        verlet_steps(context, edge, choice.dt, begin, end, n)


@kernel
def advance_by_runge_kutta(choice: StepChoice, context: StepContext, edge: Edge) -> None:
    """Advance the motion by the increment of `begin_increment`, by the Runge-Kutta method."""
    while next_part(choice, context):
        begin, end, n = choice.begin, choice.part_end, choice.n_steps
        runge_kutta_steps(context, edge, choice.dt, begin, end, n)
