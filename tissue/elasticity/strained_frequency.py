"""A bound on the frequencies of tetrahedra as they are deformed now, beside the bound at rest.

Where a tetrahedron is stretched, its faces grow, and pressure acts on a larger face: the stiffness
against a change of volume grows as the square of the area of the face opposite the node that moves.
The shear part of the law never gets stiffer than at rest. So the bound on w^2 is that at rest times
the largest growth of the square of a face, at least 1. For random deformations up to twice the
length and half of it, at Poisson's ratios from 0.3 to 0.49, that was 1.6 to 10 times the true w^2.
"""

from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import inlined, kernel
from tissue.core.simd import WIDTH, Lanes, lanes, store_lanes
from tissue.core.simd_gather import gathered, larger, largest
from tissue.core.vec3 import add, cross, dot
from tissue.elasticity.finite_elements import VOLUME, Solid
from tissue.elasticity.internal_forces import Elastic, bound_both_frequencies
from tissue.elasticity.neo_hookean import edges, shape_of


@kernel
def strained_frequency(
    elastic: Elastic, positions: FloatArray, blocks: IntArray, begin: int, end: int
) -> float:
    """Return the largest bound on w^2 of tetrahedra as they are deformed [1/s2].

    Args:
        elastic: The bounds at rest.
        positions: Positions of the nodes [m].
        blocks: Blocks of tetrahedra.
        begin: First block, as an index in `blocks`.
        end: End of the blocks.
    """
    nodes = elastic.solid.nodes
    worst = lanes(0.0)
    for i in range(begin, end):
        first = 4 * WIDTH * blocks[i]
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
        worst = larger(worst, _growth(elastic.solid, positions, blocks[i]) * at_rest)
    return largest(worst)


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
