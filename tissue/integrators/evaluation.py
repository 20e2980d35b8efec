"""All forces on the body at one instant, as each stage of every method evaluates them."""

from tissue.blade.edge import Edge
from tissue.core.array_types import FloatArray
from tissue.core.jit import kernel
from tissue.elasticity.finite_elements import averages_shear
from tissue.elasticity.internal_forces import keep_viscous_forces
from tissue.elasticity.neo_hookean import has_averages
from tissue.elasticity.viscous_stress import is_viscous
from tissue.forces.step_context import Instant, StepContext
from tissue.forces.terms import add_reactions, add_terms
from tissue.integrators.node_loops import (
    AVERAGES,
    CORNER_FORCES,
    DEFORMED,
    GRADIENTS,
    resist_shared,
    run_loop,
)


@kernel
def evaluate_forces(
    context: StepContext,
    edge: Edge,
    positions: FloatArray,
    velocities: FloatArray,
    loop_of_displacements: int,
    instant: Instant,
) -> None:
    """Evaluate the forces inside the body and on its nodes; count impulses and works.

    Args:
        context: Forces are written to its stages and its elasticity.
        edge: The cutting edge over the time step.
        positions: Positions of the nodes [m].
        velocities: Velocities of the nodes [m/s].
        loop_of_displacements: The loop that finds the displacements at these positions; `DISPLACED`
            where they are known, `DEFORMED` where their gradients are.
        instant: The instant, and its weight.
    """
    add_terms(context, edge, positions, velocities, instant)
    _deform(context, velocities, loop_of_displacements)
    add_reactions(context, positions, velocities, instant)


@kernel
def _deform(context: StepContext, velocities: FloatArray, loop_of_displacements: int) -> None:
    """Evaluate all tetrahedra, with threads; see `tissue.elasticity.internal_forces.deform`."""
    elastic = context.elastic
    if elastic.has_tetrahedra:
        solid = elastic.solid
        if loop_of_displacements >= 0:
            run_loop(context, loop_of_displacements, 0.0)
        if loop_of_displacements != DEFORMED:
            run_loop(context, GRADIENTS, 0.0)
        if context.surroundings.retardation_time > 0.0 and is_viscous(elastic.viscosity):
            resist_shared(context, velocities)
            keep_viscous_forces(elastic, context.body)
        if has_averages(solid) and not (
            loop_of_displacements == DEFORMED and averages_shear(solid)
        ):
            run_loop(context, AVERAGES, 0.0)
        run_loop(context, CORNER_FORCES, 0.0)
