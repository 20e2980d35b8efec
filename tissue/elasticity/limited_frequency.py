"""Mass scaling between cuts: what strain or the blade makes faster than the limit gets mass, too.

Ahead of a blade tissue is stretched, and nodes of some milligrams hang on its stiff edge. A few
such nodes would set the time step of the whole body, as slivers would
(`tissue.elasticity.mass_scaling`). When the blade has left an incision they give that mass back
(`tissue.elasticity.returned_mass`).
"""

from tissue.core.jit import kernel
from tissue.core.vec3 import dot, vec3
from tissue.elasticity.internal_forces import Elastic
from tissue.mesh.body import Body


@kernel
def limited_frequency(
    elastic: Elastic, body: Body, node: int, bound: float, allowed: float
) -> float:
    """Give a node mass where a bound on its w^2 is above the limit; return the bound then [1/s2].

    The node keeps its momentum, and loses kinetic energy, which is counted. Where the body has got
    all the mass that it may, the bound stays as it is.

    Args:
        elastic: The bounds at rest, and what nodes have got; written.
        body: Masses and velocities are written.
        node: The node.
        bound: Bound on w^2 with its mass now [1/s2].
        allowed: The limit [1/s2].
    """
    scaling, solid, mass = elastic.scaling, elastic.solid, body.masses[node]
    if not bound > allowed:
        return bound
    more = mass * (bound / allowed - 1.0)
    if scaling.added + more > scaling.most:
        return bound
    v, share = vec3(body.velocities, node), mass / (mass + more)
    scaling.added += more
    scaling.largest = max(scaling.largest, scaling.added)
    scaling.lost += 0.5 * mass * dot(v, v) * (1.0 - share)
    body.masses[node] += more
    body.added_masses[node] += more
    for q in range(3):
        body.velocities[node, q] *= share
    elastic.frequency_squared[node] *= share
    solid.frequency_squared[node] *= share
    solid.shear_frequency_squared[node] *= share
    elastic.springs.stiffness_per_mass[node] *= share
    limited: float = bound * share
    return limited
