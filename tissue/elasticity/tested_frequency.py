"""Bounds on the frequencies of deformed tetrahedra near the truth: tests, and what they found.

A tetrahedron is tested: the bound at rest (`tissue.elasticity.frequency_bound`) is evaluated at its
nodes with their neighbours as they are deformed.
"""

from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import kernel
from tissue.core.simd_blocks import width_of
from tissue.elasticity.finite_elements import Solid, node_place, tetrahedron_of_slot
from tissue.elasticity.frequency_bound import bounds_of_node, dilatation_term
from tissue.elasticity.internal_forces import Elastic
from tissue.elasticity.limited_frequency import limited_frequency
from tissue.elasticity.stiffening import stiffens
from tissue.mesh.body import Body
from tissue.mesh.star import Visits

FURTHER = 1.05
"""Ratio by which the growth of a face may differ from that at the last test, either way, before
the tetrahedron is tested again. Nearer to 1: what moves is tested in every step; larger: more steps
are taken than needed, up to half of the excess of this over 1."""

NO_FREQUENCY = 1e-12
"""A bound on w^2 [1/s2] far below any, in place of 0: where all nodes of a tetrahedron are
fixed."""


@kernel
def bound_near_truth(
    elastic: Elastic, body: Body, points: FloatArray, visits: Visits, t: int
) -> float:
    """Return the bound at the nodes of a tetrahedron as they are deformed [1/s2], and keep it.

    Args:
        elastic: What was found is written.
        body: Rest positions and masses; mass may be added (`limited_frequency`).
        points: Where the nodes are [m].
        visits: For searches.
        t: The tetrahedron, whose quick bound is up to date.
    """
    solid = elastic.solid
    highest = _bound_at_nodes(elastic, body, points, visits, t)
    place = width_of(solid.shape) + t
    solid.tested_growth[place] = solid.growth[place]
    solid.tested_stiffness[place] = solid.stiffness[place]
    solid.tested_bound[place] = highest
    return highest


@kernel
def is_as_tested(solid: Solid, place: int) -> bool:
    """Return whether a tetrahedron is deformed nearly as it was when it was tested."""
    if solid.tested_bound[place] == 0.0:
        return False
    further = solid.growth[place] / solid.tested_growth[place]
    is_near: bool = 1.0 / FURTHER <= further <= FURTHER
    if stiffens(solid.law):
        further = solid.stiffness[place] / solid.tested_stiffness[place]
        is_near = is_near and 1.0 / FURTHER <= further <= FURTHER
    return is_near


@kernel
def _bound_at_nodes(
    elastic: Elastic, body: Body, points: FloatArray, visits: Visits, t: int
) -> float:
    """Return the bound on w^2 at the nodes of a tetrahedron as they are deformed [1/s2]."""
    solid = elastic.solid
    highest = 0.0
    for k in range(4):
        node = solid.nodes[node_place(solid, t, k)]
        if not body.fixed[node]:
            highest = max(highest, _strained_bound(elastic, body, points, visits, node))
    return highest


@kernel
def _strained_bound(
    elastic: Elastic, body: Body, points: FloatArray, visits: Visits, node: int
) -> float:
    """Return the bound on w^2 at a node as its neighbourhood is deformed [1/s2]."""
    solid = elastic.solid
    if solid.frequency_test[node] == solid.test:
        known: float = solid.strained_frequency_squared[node]
        return known
    if solid.law.lam_of_nodes != 0.0:
        for slot in range(solid.first[node], solid.first[node] + solid.count[node]):
            t = tetrahedron_of_slot(solid, slot)
            for k in range(4):
                other = solid.nodes[node_place(solid, t, k)]
                if solid.dilatation_test[other] != solid.test:
                    term = dilatation_term(solid, body, points, visits, other)
                    solid.strained_dilatation[other] = term
                    solid.dilatation_test[other] = solid.test
    dilatation = solid.strained_dilatation
    bound = bounds_of_node(solid, body, points, dilatation, visits, node, True).whole
    if elastic.has_springs:
        bound += elastic.springs.frequency_squared[node]
    if not stiffens(solid.law):
        bound = limited_frequency(
            elastic, body, node, bound, elastic.scaling.allowed_between_cuts / FURTHER
        )
    solid.strained_frequency_squared[node] = bound
    solid.frequency_test[node] = solid.test
    return bound


@kernel
def bound_tetrahedra(elastic: Elastic, body: Body, nodes: IntArray, n: int) -> None:
    """Write the bounds of the tetrahedra around the first `n` of `nodes`, whose own are known."""
    solid = elastic.solid
    for i in range(n):
        node = nodes[i]
        for slot in range(solid.first[node], solid.first[node] + solid.count[node]):
            t, highest, shear = tetrahedron_of_slot(solid, slot), NO_FREQUENCY, 0.0
            for k in range(4):
                corner = body.tetrahedra[t, k]
                highest = max(highest, elastic.frequency_squared[corner])
                shear = max(shear, solid.shear_frequency_squared[corner])
            solid.inverse_bound[solid.around[slot]] = 1.0 / highest
            solid.shear_share[solid.around[slot]] = shear / highest


@kernel
def forget_tests(solid: Solid, nodes: IntArray, n: int) -> None:
    """Forget the bounds found at the tetrahedra around the first `n` of `nodes`."""
    solid.is_bound_current = 0
    for i in range(n):
        node = nodes[i]
        for slot in range(solid.first[node], solid.first[node] + solid.count[node]):
            place = solid.around[slot]
            solid.tested_growth[place] = solid.tested_stiffness[place] = 1.0
            solid.tested_bound[place] = 0.0
