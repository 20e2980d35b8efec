"""From the choice of a relaxation to what relaxes the body."""

from tissue.elasticity.elasticity import Elasticity
from tissue.integrators.global_stepper import GlobalStepper
from tissue.integrators.options import Hierarchical, LocalTimeStepping, Relaxing
from tissue.integrators.step_context import Relaxation
from tissue.mesh.body import Body


def relaxation_of(
    relaxing: Relaxing, all_together: GlobalStepper, body: Body, elasticity: Elasticity
) -> Relaxation:
    """Return what relaxes a body. Imported late: kernels that are not used cost no start."""
    if isinstance(relaxing, Hierarchical):
        from tissue.integrators.hierarchical.stepper import HierarchicalStepper

        return HierarchicalStepper(relaxing, len(body.rest))
    if isinstance(relaxing, LocalTimeStepping):
        from tissue.integrators.local.stepper import LocalStepper

        return LocalStepper(relaxing, body, elasticity)
    return all_together
