"""The step of quasi-linear viscoelasticity, between the steps of an integrator."""

from tissue.core.jit import kernel
from tissue.elasticity.energy import relaxed_energy
from tissue.elasticity.finite_elements import n_blocks
from tissue.elasticity.neo_hookean import has_averaged_volumes
from tissue.elasticity.viscoelasticity import prepare_relaxation
from tissue.integrators.shared_loops import (
    DISPLACEMENTS,
    GRADIENTS,
    PRESSURES,
    STRESS_RELAXATION,
    run_loop,
)
from tissue.integrators.step_context import StepContext


@kernel
def relax_stress(context: StepContext, seconds: float) -> None:
    """Let stress relax for that time [s], which may be infinite, where the body is.

    What Maxwell elements dissipate is counted with the damping where an account is kept.
    """
    solid = context.elastic.solid
    is_counted = context.damping.is_counted == 1
    blocks = n_blocks(solid, context.body.n_tetrahedra)
    prepare_relaxation(solid, seconds)
    run_loop(context, DISPLACEMENTS, 0.0)
    run_loop(context, GRADIENTS, 0.0)
    if has_averaged_volumes(solid):
        run_loop(context, PRESSURES, 0.0)
    before = relaxed_energy(solid, blocks) if is_counted else 0.0
    run_loop(context, STRESS_RELAXATION, 0.0)
    if is_counted:
        context.damping.dissipated += before - relaxed_energy(solid, blocks)
