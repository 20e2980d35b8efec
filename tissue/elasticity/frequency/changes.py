"""The bounds on frequencies after a change, and the mass that nodes get and give back.

A cut changes the tetrahedra of nodes: those that it makes too fast get mass. What nodes get between
cuts (`tissue.elasticity.frequency.strained.limited_frequency`) they give back when the blade has
left an incision, and when they touch nothing any more. Otherwise each stroke would leave nodes
heavier that nothing strains or holds, until the body has all the mass that it may get and its steps
become shorter.
"""

import math

from tissue.core.array_types import IntArray
from tissue.core.jit import kernel
from tissue.core.vec3 import dot, vec3
from tissue.elasticity.frequency.at_rest import bound_solid_frequencies
from tissue.elasticity.frequency.strained import bound_tetrahedra, forget_tests
from tissue.elasticity.frequency.weights import tighten
from tissue.elasticity.internal_forces import Elastic, bound_both_frequencies
from tissue.elasticity.mass_scaling import (
    LIMIT_STEP,
    MassScaling,
    add_momentum,
    scale_masses,
)
from tissue.elasticity.springs import bound_frequencies
from tissue.mesh.body import Body
from tissue.mesh.changes import largest_frequency
from tissue.mesh.star import Visits


@kernel
def forget_added_mass(scaling: MassScaling, body: Body, nodes: IntArray, n: int) -> None:
    """Take the mass that the first `n` of `nodes` got out of the sum: their rows are made again."""
    added = 0.0
    for i in range(n):
        added += body.added_masses[nodes[i]]
    scaling.added -= added


@kernel
def update_frequencies(
    elastic: Elastic, body: Body, visits: Visits, nodes: IntArray, n: int
) -> None:
    """Bound the frequencies around nodes, and give mass to those that are too fast.

    Args:
        elastic: The rows of the nodes are up to date; bounds are written.
        body: Masses are written.
        visits: For searches.
        nodes: Nodes, of which the first `n` are those whose tetrahedra changed.
        n: How many these are.
    """
    solid, springs, scaling, changed = elastic.solid, elastic.springs, elastic.scaling, nodes
    if elastic.has_tetrahedra == 1:
        n = bound_solid_frequencies(solid, body, visits, nodes, n)
        n = tighten(solid, body, visits, n, elastic.highest_of_tetrahedra)
        changed = solid.listed
        if scaling.allowed < math.inf:
            limit = scaling.allowed, elastic.of_contact
            scaling.added += scale_masses(body, solid, changed, n, *limit)
            if scaling.added > scaling.most:
                _raise_limit(elastic, body)
                changed, n = solid.every, body.n_nodes
            scaling.largest = max(scaling.largest, scaling.added)
        forget_tests(solid, changed, n)
        highest = largest_frequency(body, solid.frequency_squared, changed, n)
        elastic.highest_of_tetrahedra = max(elastic.highest_of_tetrahedra, highest)
    if elastic.has_springs == 1:
        bound_frequencies(body, springs, changed, n)
        highest = largest_frequency(body, springs.frequency_squared, changed, n)
        elastic.highest_of_dampers = max(elastic.highest_of_dampers, highest)
    bound_both_frequencies(elastic, changed, n)
    if elastic.has_tetrahedra == 1:
        bound_tetrahedra(elastic, body, changed, n)
    highest = largest_frequency(body, elastic.frequency_squared, changed, n)
    elastic.highest = max(elastic.highest, highest)


@kernel
def _raise_limit(elastic: Elastic, body: Body) -> None:
    """Raise the limit of frequencies until the added mass is small."""
    solid, scaling = elastic.solid, elastic.scaling
    every, n = solid.every, body.n_nodes
    while scaling.added > scaling.most:
        scaling.allowed *= LIMIT_STEP**2
        limit = scaling.allowed, elastic.of_contact
        scaling.added += scale_masses(body, solid, every, n, *limit)


@kernel
def return_all_mass(elastic: Elastic, body: Body, every: IntArray) -> None:
    """Take back the mass that nodes do not need at rest, and count anew what they get from now on.

    Args:
        elastic: The bounds of nodes, and what they have got; written.
        body: Masses are written.
        every: The numbers from 0 on, at least as many as there are nodes.
    """
    return_mass(elastic, body, every, body.n_nodes)
    elastic.scaling.increments, elastic.scaling.between_cuts = 0, 0.0


@kernel
def return_mass(elastic: Elastic, body: Body, nodes: IntArray, n: int) -> None:
    """Take back mass that nodes do not need at rest; what it moved with is counted as lost.

    Nodes keep their velocities, and with them the momentum of their own mass. That of the mass that
    they give back is the impulse of mass scaling.

    Args:
        elastic: The bounds of nodes, and what they have got; written.
        body: Masses are written.
        nodes: The nodes.
        n: How many of them.
    """
    scaling, solid = elastic.scaling, elastic.solid
    before = _energy_of_added_mass(body, nodes, n)
    add_momentum(body, nodes, n, -1.0, scaling.impulse)
    limit = scaling.allowed, elastic.of_contact
    scaling.added += scale_masses(body, solid, nodes, n, *limit)
    scaling.lost += before - _energy_of_added_mass(body, nodes, n)
    add_momentum(body, nodes, n, 1.0, scaling.impulse)
    bound_both_frequencies(elastic, nodes, n)
    bound_tetrahedra(elastic, body, nodes, n)
    forget_tests(solid, nodes, n)


@kernel
def _energy_of_added_mass(body: Body, nodes: IntArray, n: int) -> float:
    """Return the kinetic energy of the mass that was added to nodes [J]."""
    energy = 0.0
    for i in range(n):
        v = vec3(body.velocities, nodes[i])
        energy += 0.5 * body.added_masses[nodes[i]] * dot(v, v)
    return energy
