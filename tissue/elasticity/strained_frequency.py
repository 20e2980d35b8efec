"""A bound on the frequencies of tetrahedra as they are deformed now, beside the bound at rest.

Where a tetrahedron is stretched, its faces grow, and pressure acts on a larger face: the stiffness
against a change of volume grows as the square of the area of the face opposite the node that moves.
The shear part of the law never gets stiffer than at rest. So a bound on w^2 is that at rest times
the largest growth of the square of a face, at least 1. For random deformations up to twice the
length and half of it, at Poisson's ratios from 0.3 to 0.49, that was 1.6 to 10 times the true w^2.

It is quick to find for all tetrahedra, and so wide because a sliver that is stretched to four times
its area adds little to what its nodes resist. Where it is too high to be of use, the bound at rest
is evaluated at the nodes of the tetrahedron with its neighbours as they are deformed: in an organ
after a cut that concerns 20 of 5,900 tetrahedra. What was found slow enough is not evaluated again
before it has grown further.
"""

from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import inlined, kernel
from tissue.core.simd import WIDTH, Lanes, lanes, load_lanes, store_lanes
from tissue.core.simd_gather import gathered, larger, largest, where_larger
from tissue.core.vec3 import add, cross, dot
from tissue.elasticity.finite_elements import (
    VOLUME,
    Solid,
    n_blocks,
    node_place,
    tetrahedron_of_slot,
)
from tissue.elasticity.frequency_bound import bound_of_node, dilatation_term
from tissue.elasticity.internal_forces import Elastic, bound_both_frequencies
from tissue.elasticity.neo_hookean import edges, shape_of
from tissue.mesh.body import Body
from tissue.mesh.star import Visits

FURTHER = 1.05
"""Ratio of the growth of a face to that at the last test above which it is tested again; and how
far below the limit a bound must be for that. Nearer to 1: what moves is tested in every step;
larger: more of it is found too fast."""


@kernel
def strained_frequency(elastic: Elastic, body: Body, visits: Visits, allowed: float) -> float:
    """Return a bound on w^2 of the tetrahedra as they are deformed [1/s2].

    Args:
        elastic: The bounds at rest; what was tested is written.
        body: Positions of the nodes.
        visits: For searches.
        allowed: Bound on w^2 [1/s2] below which it need not be near the truth.
    """
    solid, nodes = elastic.solid, elastic.solid.nodes
    worst, too_high = lanes(0.0), 0.0
    solid.test += 1
    for block in range(n_blocks(body.n_tetrahedra)):
        first = 4 * WIDTH * block
        at_rest = larger(
            larger(
                gathered(elastic.frequency_squared, nodes, first),
                gathered(elastic.frequency_squared, nodes, first + WIDTH),
            ),
            larger(
                gathered(elastic.frequency_squared, nodes, first + 2 * WIDTH),
                gathered(elastic.frequency_squared, nodes, first + 3 * WIDTH),
            ),
        )
        growth = _growth(solid, body.positions, block)
        tested = lanes(FURTHER) * load_lanes(solid.tested_growth, WIDTH * (1 + block))
        bound = where_larger(growth, tested, growth * at_rest, lanes(0.0))
        if largest(bound) <= allowed:
            worst = larger(worst, bound)
            continue
        store_lanes(solid.growth, 0, bound)
        store_lanes(solid.growth, WIDTH * (1 + block), growth)
        for lane in range(WIDTH):
            t = WIDTH * block + lane
            if solid.growth[lane] > allowed and t < body.n_tetrahedra:
                too_high = max(too_high, _tested_bound(elastic, body, visits, t, allowed))
            else:
                too_high = max(too_high, min(solid.growth[lane], allowed))
    return max(largest(worst), too_high)


@kernel
def _tested_bound(elastic: Elastic, body: Body, visits: Visits, t: int, allowed: float) -> float:
    """Return the bound on w^2 at the nodes of a tetrahedron as they are deformed [1/s2]."""
    solid = elastic.solid
    highest = 0.0
    for k in range(4):
        node = solid.nodes[node_place(t, k)]
        if not body.fixed[node]:
            highest = max(highest, _strained_bound(elastic, body, visits, node))
    if FURTHER * highest <= allowed:
        solid.tested_growth[WIDTH + t] = solid.growth[WIDTH + t]
    return highest


@kernel
def _strained_bound(elastic: Elastic, body: Body, visits: Visits, node: int) -> float:
    """Return the bound on w^2 at a node as its neighbourhood is deformed [1/s2]."""
    solid = elastic.solid
    if solid.frequency_test[node] == solid.test:
        known: float = solid.strained_frequency_squared[node]
        return known
    if solid.law.lam_of_nodes != 0.0:
        for slot in range(solid.first[node], solid.first[node] + solid.count[node]):
            t = tetrahedron_of_slot(solid, slot)
            for k in range(4):
                other = solid.nodes[node_place(t, k)]
                if solid.dilatation_test[other] != solid.test:
                    term = dilatation_term(solid, body, body.positions, visits, other)
                    solid.strained_dilatation[other] = term
                    solid.dilatation_test[other] = solid.test
    bound = bound_of_node(solid, body, body.positions, solid.strained_dilatation, visits, node)
    if elastic.has_springs:
        bound += elastic.springs.frequency_squared[node]
    solid.strained_frequency_squared[node] = bound
    solid.frequency_test[node] = solid.test
    return bound


@kernel
def forget_tests(solid: Solid, nodes: IntArray, n: int) -> None:
    """Forget which of the tetrahedra around the first `n` of `nodes` were slow enough."""
    for i in range(n):
        node = nodes[i]
        for slot in range(solid.first[node], solid.first[node] + solid.count[node]):
            solid.tested_growth[WIDTH + tetrahedron_of_slot(solid, slot)] = 1.0


@kernel
def strain_frequencies(
    elastic: Elastic,
    positions: FloatArray,
    blocks: IntArray,
    n_blocks: int,
    nodes: IntArray,
    n: int,
) -> None:
    """Write the bound on w^2 at nodes as they are deformed to `elastic.frequency_squared`.

    Args:
        elastic: Written.
        positions: Positions of the nodes [m].
        blocks: Blocks that hold the tetrahedra around the nodes.
        n_blocks: How many of them.
        nodes: The nodes.
        n: How many of them.
    """
    solid = elastic.solid
    for i in range(n_blocks):
        growth = _growth(solid, positions, blocks[i])
        store_lanes(solid.growth, WIDTH * (1 + blocks[i]), growth)
    bound_both_frequencies(elastic, nodes, n)
    for i in range(n):
        node = nodes[i]
        growth = lanes(1.0)
        first = solid.first[node]
        for slot in range(first, first + solid.count[node], WIDTH):
            growth = larger(growth, gathered(solid.growth, solid.around, slot))
        more = largest(growth) - 1.0
        elastic.frequency_squared[node] += more * solid.frequency_squared[node]


@inlined
def _growth(solid: Solid, positions: FloatArray, block: int) -> Lanes:
    """Return the largest growth of the square of a face of eight tetrahedra, at least 1."""
    d1, d2, d3 = edges(solid, positions, block)
    n1, n2, n3 = cross(d2, d3), cross(d3, d1), cross(d1, d2)
    n0 = add(n1, add(n2, n3))
    k1, k2, k3 = shape_of(solid, block, 0), shape_of(solid, block, 1), shape_of(solid, block, 2)
    mixed = shape_of(solid, block, 3) + shape_of(solid, block, 4) + shape_of(solid, block, 5)
    k0 = k1 + k2 + k3 + mixed + mixed
    growth = larger(
        larger(dot(n0, n0) / k0, dot(n1, n1) / k1), larger(dot(n2, n2) / k2, dot(n3, n3) / k3)
    )
    return larger(growth / (lanes(36.0) * shape_of(solid, block, VOLUME)), lanes(1.0))
