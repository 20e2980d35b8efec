"""Mass scaling at the blade: light nodes that hang on the stiff edge get mass.

The edge lets go of them one by one, and sets their fastest modes going. Near its limit a
Runge-Kutta step takes energy from these, and damping after a Verlet step is counted too high
(`tissue.integrators.stability`). So they are kept further from the limit than the rest of the body.
"""

from tissue.blade.anchors import ANCHORED, add_anchor_stiffness, holding_node, n_holding_nodes
from tissue.blade.blade_state import BladeState
from tissue.blade.blunt_contact import PRESSING
from tissue.blade.blunt_forces import add_blunt_stiffness
from tissue.blade.forces import clear_blade_forces
from tissue.blade.side_forces import add_side_stiffness
from tissue.core.array_types import FloatArray
from tissue.core.jit import kernel
from tissue.elasticity.frequency.strained import limited_frequency
from tissue.elasticity.internal_forces import Elastic
from tissue.mesh.body import Body

LIMIT_AT_BLADE = 0.5
"""The limit of w^2 at the blade, as a share of that elsewhere. In the organ's stroke the account of
energy left 0.77 % at 1.0, 0.57 % at 0.7 and 0.38 % at 0.5 with two Runge-Kutta steps a millisecond,
and -1.31 % and -0.72 % at 1.0 and 0.5 with four of Verlet; lower, nodes get more mass."""


@kernel
def limit_frequency_at_blade(
    blade: BladeState, elastic: Elastic, body: Body, scratch: FloatArray
) -> float:
    """Give mass to nodes that body and blade together make faster than the limit.

    Args:
        blade: Anchors and side contacts.
        elastic: The bounds at rest, and what nodes have got; written.
        body: Masses and velocities are written.
        scratch: Zero at the nodes that the blade acts on, and so again afterwards, shape
            (capacity, 3).

    Returns:
        A bound on w^2 [1/s2] over the nodes that the blade acts on.
    """
    anchors, sides, blunt = blade.anchors, blade.sides, blade.blunt
    add_anchor_stiffness(anchors, body, scratch)
    add_side_stiffness(sides, scratch)
    add_blunt_stiffness(blunt, body, scratch)
    worst = 0.0
    for k in range(len(anchors.state)):
        if anchors.state[k] == ANCHORED:
            for i in range(n_holding_nodes(anchors, k)):
                node = holding_node(anchors, body, k, i)
                worst = max(worst, _limited(elastic, body, scratch, node))
    for i in range(sides.n_faces):
        for corner in range(3):
            worst = max(worst, _limited(elastic, body, scratch, sides.node[i, corner]))
    if blunt.n_pressing > 0:
        for k in range(len(blunt.state)):
            if blunt.state[k] >= PRESSING:
                for q in range(4):
                    node = body.tetrahedra[blunt.tetrahedron[k], q]
                    worst = max(worst, _limited(elastic, body, scratch, node))
    clear_blade_forces(blade, body, scratch)
    return worst


@kernel
def _limited(elastic: Elastic, body: Body, stiffness: FloatArray, node: int) -> float:
    """Return the bound on w^2 at a node [1/s2], after it got mass where that is needed."""
    if body.fixed[node]:
        return 0.0
    bound = elastic.frequency_squared[node] + stiffness[node, 0] / body.masses[node]
    allowed = LIMIT_AT_BLADE * elastic.scaling.allowed_between_cuts
    limited: float = limited_frequency(elastic, body, node, bound, allowed)
    return limited
