"""From the choice of a relaxation to what relaxes the body."""

from tissue.body import Body
from tissue.elasticity import Elasticity
from tissue.relaxation.all_together import AllTogether
from tissue.relaxation.motion import Relaxation
from tissue.relaxation.options import Hierarchical, LocalTimeStepping, Relaxing


def relaxation_of(
    relaxing: Relaxing, all_together: AllTogether, body: Body, elasticity: Elasticity
) -> Relaxation:
    """Return what relaxes a body. Imported late: kernels that are not used cost no start."""
    if isinstance(relaxing, Hierarchical):
        from tissue.relaxation.by_rings import ByRings

        return ByRings(relaxing, len(body.rest))
    if isinstance(relaxing, LocalTimeStepping):
        from tissue.relaxation.by_stiffness import ByStiffness

        return ByStiffness(relaxing, body, elasticity)
    return all_together
