"""Mass scaling: what nodes got between cuts, they give back when the blade has left an incision.

Otherwise each stroke would leave nodes heavier that nothing strains or holds any more, until the
body has got all the mass that it may and its steps get shorter.
"""

from tissue.core.array_types import IntArray
from tissue.core.jit import kernel
from tissue.core.vec3 import dot, vec3
from tissue.elasticity.internal_forces import Elastic, bound_both_frequencies
from tissue.elasticity.mass_scaling import scale_masses
from tissue.elasticity.springs import bound_frequencies
from tissue.elasticity.tested_frequency import bound_tetrahedra, forget_tests
from tissue.mesh.body import Body


@kernel
def return_mass(elastic: Elastic, body: Body, every: IntArray) -> None:
    """Take back mass that nodes do not need at rest; what it moved with is counted as lost.

    Nodes keep their velocities, and with them the momentum of their own mass.

    Args:
        elastic: The bounds of nodes, and what they have got; written.
        body: Masses are written.
        every: The numbers from 0 on, at least as many as there are nodes.
    """
    scaling, n = elastic.scaling, body.n_nodes
    before = _energy_of_added_mass(body)
    scaling.added += scale_masses(body, elastic.springs, elastic.solid, every, n, scaling.allowed)
    scaling.lost += before - _energy_of_added_mass(body)
    bound_frequencies(body, elastic.springs, every, n)
    bound_both_frequencies(elastic, every, n)
    bound_tetrahedra(elastic, body, every, n)
    forget_tests(elastic.solid, every, n)


@kernel
def _energy_of_added_mass(body: Body) -> float:
    """Return the kinetic energy of the mass that was added [J]."""
    energy = 0.0
    for node in range(body.n_nodes):
        v = vec3(body.velocities, node)
        energy += 0.5 * body.added_masses[node] * dot(v, v)
    return energy
