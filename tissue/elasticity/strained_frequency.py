"""A bound on the frequencies of tetrahedra as they are deformed now, beside the bound at rest.

Where a tetrahedron is stretched, its faces grow, and pressure acts on a larger face: the stiffness
against a change of volume grows as the square of the area of the face opposite the node that moves.
The shear part of the law never gets stiffer than at rest. So a bound on w^2 is that at rest times
the largest growth of the square of a face, at least 1. For random deformations up to twice the
length and half of it, at Poisson's ratios from 0.3 to 0.49, that was 1.6 to 10 times the true w^2.

It is quick to find for all tetrahedra, and so wide because a sliver that is stretched to four times
its area adds little to what its nodes resist. Where it is too high to be of use, the bound at rest
is evaluated at the nodes of the tetrahedron with its neighbours as they are deformed: in an organ
after a cut that concerns 20 of 5,900 tetrahedra. What was found is kept, and is not evaluated again
before the tetrahedron has grown further, or a lower bound is asked for.

Too high means that it takes one more step. Where a tetrahedron takes one, others may take it too.
"""

import math
from typing import NamedTuple

from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import inlined, kernel
from tissue.core.simd import Lanes
from tissue.core.simd_blocks import alike, gathered_alike, load_block, store_block, width_of
from tissue.core.simd_gather import larger, largest, where_larger
from tissue.core.vec3 import Vec3, add, cross, dot
from tissue.elasticity.finite_elements import Solid, n_blocks, node_place, tetrahedron_of_slot
from tissue.elasticity.frequency_bound import bounds_of_node, dilatation_term
from tissue.elasticity.internal_forces import Elastic
from tissue.elasticity.limited_frequency import limited_frequency
from tissue.elasticity.neo_hookean import (
    displacements,
    gradient_of_displacement,
    gradient_of_shape,
    known_gradient,
)
from tissue.elasticity.stiffening import (
    stiffening_factor,
    stiffening_slope,
    stiffens,
    stretch_invariant,
)
from tissue.mesh.body import Body
from tissue.mesh.star import Visits

FURTHER = 1.05
"""Ratio of the growth of a face to that at the last test above which it is tested again; and how
far below the limit a bound must be for that. Nearer to 1: what moves is tested in every step;
larger: more of it is found too fast."""


class StepLimit(NamedTuple):
    """Up to which frequencies a number of steps is stable."""

    allowed: float
    """Bound on w^2 of the tetrahedra [1/s2] up to which it is."""
    added: float
    """What blade and contact add to that bound [1/s2]."""
    n_steps: int
    """The number of steps; 0 where a bound above `allowed` is to be near the truth in any case."""


@kernel
def strained_frequency(
    elastic: Elastic,
    body: Body,
    points: FloatArray,
    visits: Visits,
    limit: StepLimit,
    is_known: bool,
) -> float:
    """Return a bound on w^2 of the tetrahedra as they are deformed [1/s2].

    Args:
        elastic: The bounds at rest; what was tested is written.
        body: Rest positions and masses.
        points: Where the nodes are [m].
        visits: For searches.
        limit: It need not be nearer to the truth than the number of steps asks for.
        is_known: Whether `displacement_gradients` was run there, and gradients are kept.
    """
    solid = elastic.solid
    width, highest, allowed, fastest = width_of(solid.shape), 0.0, limit.allowed, -1
    solid.test += 1
    law, blocks = solid.law, n_blocks(solid, body.n_tetrahedra)
    if not is_known:
        displacements(solid, body, points, solid.every, 0, body.n_nodes)
    if stiffens(law):
        # Before any bound is evaluated at a node: that takes all tetrahedra around it.
        for block in range(blocks):
            _write_stiffness(solid, block, *_gradient(solid, block, is_known))
    if 0 <= solid.fastest < body.n_tetrahedra:
        highest = _bound_at_nodes(elastic, body, points, visits, solid.fastest)
        fastest, allowed = solid.fastest, _allowed_for(limit, highest)
    for block in range(blocks):
        growth = _growth(solid, block, *_gradient(solid, block, is_known))
        at_rest = _highest_at_rest(elastic.frequency_squared, solid, block, growth)
        bound, further = growth * at_rest, _further(solid.tested_growth, block, growth)
        if stiffens(law):
            stiffness = load_block(solid.stiffness, width * (1 + block))
            bound = bound + larger(stiffness - growth, alike(0.0, growth)) * _highest_at_rest(
                solid.shear_frequency_squared, solid, block, growth
            )
            further = larger(further, _further(solid.tested_stiffness, block, stiffness))
        found = load_block(solid.tested_bound, width * (1 + block))
        bound = where_larger(further, alike(0.0, growth), bound, alike(FURTHER, growth) * found)
        if largest(bound) <= allowed:
            highest = max(highest, largest(bound))
            continue
        store_block(solid.growth, 0, bound)
        store_block(solid.growth, width * (1 + block), growth)
        for lane in range(width):
            if solid.growth[lane] <= allowed:
                highest = max(highest, float(solid.growth[lane]))
            else:
                t = width * block + lane
                found = _tested_bound(elastic, body, points, visits, t)
                if found > highest:
                    highest, fastest, allowed = found, t, _allowed_for(limit, found)
    solid.fastest = fastest if highest > limit.allowed else -1
    return highest


@inlined
def _gradient(solid: Solid, block: int, is_known: bool) -> tuple[Vec3, Vec3, Vec3]:
    """Return the rows of H of the tetrahedra of a block; see `strained_frequency`."""
    if is_known:
        return known_gradient(solid, block)
    return gradient_of_displacement(solid, block)


@kernel
def _allowed_for(limit: StepLimit, found: float) -> float:
    """Return up to which w^2 [1/s2] no more steps are taken than for the one that was found."""
    if found <= limit.allowed or limit.n_steps == 0:
        return limit.allowed
    for_one = (limit.allowed + limit.added) / limit.n_steps**2
    n = math.ceil(math.sqrt((found + limit.added) / for_one))
    return max(for_one * n * n - limit.added, found)


@inlined
def _further(tested: FloatArray, block: int, value: Lanes) -> Lanes:
    """Return by how much a value is larger than that which was tested, times `FURTHER`."""
    return value - alike(FURTHER, value) * load_block(tested, width_of(tested) * (1 + block))


@inlined
def _highest_at_rest(values: FloatArray, solid: Solid, block: int, a: Lanes) -> Lanes:
    """Return the highest bound on w^2 at rest at the nodes of the tetrahedra of a block [1/s2]."""
    nodes, width = solid.nodes, width_of(solid.shape)
    first = 4 * width * block
    return larger(
        larger(
            gathered_alike(a, values, nodes, first),
            gathered_alike(a, values, nodes, first + width),
        ),
        larger(
            gathered_alike(a, values, nodes, first + 2 * width),
            gathered_alike(a, values, nodes, first + 3 * width),
        ),
    )


@kernel
def _tested_bound(
    elastic: Elastic, body: Body, points: FloatArray, visits: Visits, t: int
) -> float:
    """Return the bound at the nodes of a tetrahedron as they are deformed [1/s2], and keep it."""
    solid = elastic.solid
    highest = _bound_at_nodes(elastic, body, points, visits, t)
    place = width_of(solid.shape) + t
    solid.tested_growth[place] = solid.growth[place]
    solid.tested_stiffness[place] = solid.stiffness[place]
    solid.tested_bound[place] = highest
    return highest


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
def forget_tests(solid: Solid, nodes: IntArray, n: int) -> None:
    """Forget the bounds found at the tetrahedra around the first `n` of `nodes`."""
    for i in range(n):
        node = nodes[i]
        for slot in range(solid.first[node], solid.first[node] + solid.count[node]):
            place = solid.around[slot]
            solid.tested_growth[place] = solid.tested_stiffness[place] = 1.0
            solid.tested_bound[place] = 0.0


@inlined
def _growth(solid: Solid, block: int, x: Vec3, y: Vec3, z: Vec3) -> Lanes:
    """Return the largest growth of the square of a face of each tetrahedron, at least 1.

    The area vector of the face opposite node k is 3 V cof F grad N_k; x, y, z are the rows of H.
    """
    g1 = gradient_of_shape(solid, block, 0)
    g2 = gradient_of_shape(solid, block, 3)
    g3 = gradient_of_shape(solid, block, 6)
    one = alike(1.0, x.x)
    f1, f2, f3 = Vec3(x.x + one, x.y, x.z), Vec3(y.x, y.y + one, y.z), Vec3(z.x, z.y, z.z + one)
    c1, c2, c3 = cross(f2, f3), cross(f3, f1), cross(f1, f2)
    growth = larger(
        larger(_square(c1, c2, c3, g1), _square(c1, c2, c3, g2)),
        larger(_square(c1, c2, c3, g3), _square(c1, c2, c3, add(g1, add(g2, g3)))),
    )
    return larger(growth, one)


@inlined
def _write_stiffness(solid: Solid, block: int, x: Vec3, y: Vec3, z: Vec3) -> None:
    """Write a bound on the stiffness of the shear part over that at rest, and what it is of.

    A node that moves by u changes F by u times grad N. The second derivative of J by that is 0, and
    that of the energy is mu (g |dF|^2 + 2 g' ((F - cof F) : dF)^2).
    """
    trace = x.x + y.y + z.z
    cx, cy, cz = cross(y, z), cross(z, x), cross(x, y)
    two = alike(2.0, trace)
    # The rows of H - K, K = (tr H) 1 - H^T + cof H:
    ax = Vec3(two * x.x - trace - cx.x, x.y + y.x - cx.y, x.z + z.x - cx.z)
    ay = Vec3(y.x + x.y - cy.x, two * y.y - trace - cy.y, y.z + z.y - cy.z)
    az = Vec3(z.x + x.z - cz.x, z.y + y.z - cz.y, two * z.z - trace - cz.z)
    squared = dot(ax, ax) + dot(ay, ay) + dot(az, az)
    q = stretch_invariant(x, y, z, cx, cy, cz)
    g = stiffening_factor(solid.law, q)
    slope = stiffening_slope(solid.law, q, g)
    place = width_of(solid.shape) * (1 + block)
    store_block(solid.stiffening, place, g)
    store_block(solid.stiffening_slope, place, slope)
    store_block(solid.stiffness, place, g + (slope + slope) * squared)


@inlined
def _square(c1: Vec3, c2: Vec3, c3: Vec3, g: Vec3) -> Lanes:
    """Return |C g|^2 / |g|^2 from the rows of C."""
    a, b, c = dot(c1, g), dot(c2, g), dot(c3, g)
    return (a * a + b * b + c * c) / dot(g, g)
