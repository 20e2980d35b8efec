"""Quick bounds on the frequencies of tetrahedra as they are deformed, a block at a time.

Where a tetrahedron is stretched, its faces grow, and pressure acts on a larger face: the stiffness
against a change of volume grows as the square of the area of the face opposite the node that moves.
The shear part of the law never gets stiffer than at rest, unless the law stiffens, or tetrahedra
take averaged shear back (`tissue.elasticity.averaged_shear`). So a bound on
w^2 is that at rest times the largest growth of the square of a face, at least 1. For random
deformations up to twice the length and half of it, at Poisson's ratios from 0.3 to 0.49, that was
1.6 to 10 times the true w^2.
"""

import math

from tissue.core.array_types import FloatArray
from tissue.core.jit import inlined, kernel
from tissue.core.simd import Lanes
from tissue.core.simd_blocks import gathered_like, load_block, splat, store_block, width_of
from tissue.core.simd_rows import any_above, larger, largest, where_larger
from tissue.core.vec3 import Vec3, add, dot
from tissue.elasticity.averaged_shear import mean_of_nodes
from tissue.elasticity.finite_elements import Solid, averages_shear, is_graded, n_blocks
from tissue.elasticity.graded import law_of_block, own_share_of
from tissue.elasticity.gradients import gradient_of_displacement, gradient_of_shape, known_gradient
from tissue.elasticity.internal_forces import Elastic
from tissue.elasticity.stress import (
    MatrixRows,
    cofactors_of,
    deformed_cofactors,
    product_with,
    shear_stiffness,
)
from tissue.laws.kernels import (
    stiffening_factor,
    stiffens,
    stretch_invariant,
)

UNNOTICED = 1.05
"""Growth of the square of a face, or of the stiffness, up to which a tetrahedron counts as at rest:
most of a body in gravity. The steps are short enough for more (`SAFETY` of the stability limits).
With 1, tetrahedra near the limit at rest would be tested wherever they are stretched at all, and
get mass."""


@inlined
def has_stiffness(solid: Solid) -> bool:
    """Return whether the shear of tetrahedra can be stiffer than at rest."""
    return stiffens(solid.law) or averages_shear(solid)


@kernel
def list_fast_blocks(solid: Solid, n_tetrahedra: int, allowed: float, is_known: bool) -> int:
    """List the blocks with a tetrahedron that may be above `allowed` [1/s2]; return how many.

    None is where the bound at rest times the growth of the faces is not, and that of the shear
    part times the stiffness: no division, no test of the nodes. Stiffness is written for all, since
    a node depends on all around it.
    """
    law, n = solid.law, 0
    if math.isinf(allowed):
        allowed = 0.0  # any bound is wanted
    for block in range(n_blocks(solid, n_tetrahedra)):
        x, y, z = _gradient(solid, block, is_known)
        place = width_of(solid.shape) * (1 + block)
        room = load_block(solid.inverse_bound, place)
        room = splat(allowed, room) * room
        one, least = splat(1.0, room), splat(UNNOTICED, room)
        # Where the bound at rest is above the limit, any growth counts.
        least = where_larger(one, room, room, least)
        if has_stiffness(solid):
            stiffness = _write_stiffness(solid, block, x, y, z, is_known)
            more = stiffness if stiffens(law) else stiffness - one
            room = room - load_block(solid.shear_share, place) * more
            least = where_larger(stiffness, least, room, least)
        cofactors = deformed_cofactors(x, y, z)
        room = larger(room, least)
        if _grows_further(solid, block, cofactors, room):
            solid.fast_blocks[n] = block
            n += 1
    return n


@kernel
def quick_bounds_of_one(elastic: Elastic, block: int, is_known: bool) -> None:
    """Write quick bounds on w^2 of a block before `list_fast_blocks`."""
    if has_stiffness(elastic.solid):
        x, y, z = _gradient(elastic.solid, block, is_known)
        _write_stiffness(elastic.solid, block, x, y, z, is_known)
    quick_bounds(elastic, block, is_known)


@kernel
def quick_bounds(elastic: Elastic, block: int, is_known: bool) -> float:
    """Write quick bounds on w^2 of the tetrahedra of a block [1/s2]; return the highest.

    What was found at a test grows as the faces do, or the stiffness.
    """
    solid = elastic.solid
    place = width_of(solid.shape) * (1 + block)
    x, y, z = _gradient(solid, block, is_known)
    growth = _growth(solid, block, deformed_cofactors(x, y, z))
    at_rest = _highest_with_contact(elastic, solid, block, growth)
    bound = growth * at_rest
    further = growth / load_block(solid.tested_growth, place)
    largest_growth = growth
    if has_stiffness(solid):
        stiffness = load_block(solid.stiffness, place)
        bound = bound + larger(stiffness - growth, splat(0.0, growth)) * _highest_at_rest(
            solid.shear_frequency_squared, solid, block, growth
        )
        further = larger(further, stiffness / load_block(solid.tested_stiffness, place))
        largest_growth = larger(growth, stiffness)
    bound = where_larger(largest_growth, splat(UNNOTICED, growth), bound, at_rest)
    found = load_block(solid.tested_bound, place)
    grown = larger(further, splat(1.0, growth)) * found
    grown = where_larger(found, splat(0.0, growth), grown, bound)
    bound = where_larger(bound, grown, grown, bound)
    store_block(solid.growth, place, growth)
    store_block(solid.strained_bound, place, bound)
    return largest(bound)


@inlined
def _gradient(solid: Solid, block: int, is_known: bool) -> tuple[Vec3, Vec3, Vec3]:
    """Return the rows of H of the tetrahedra of a block; see `strained_frequency`."""
    if is_known:
        return known_gradient(solid, block)
    return gradient_of_displacement(solid, block)


@inlined
def _highest_with_contact(elastic: Elastic, solid: Solid, block: int, a: Lanes) -> Lanes:
    """Return the highest bound on w^2 at rest, with contact, at the nodes of a block [1/s2]."""
    own, added = elastic.frequency_squared, elastic.of_contact
    w0, w1, w2, w3 = _of_corners(own, solid, block, a)
    c0, c1, c2, c3 = _of_corners(added, solid, block, a)
    return larger(larger(w0 + c0, w1 + c1), larger(w2 + c2, w3 + c3))


@inlined
def _highest_at_rest(values: FloatArray, solid: Solid, block: int, a: Lanes) -> Lanes:
    """Return the highest bound on w^2 at rest at the nodes of the tetrahedra of a block [1/s2]."""
    w0, w1, w2, w3 = _of_corners(values, solid, block, a)
    return larger(larger(w0, w1), larger(w2, w3))


@inlined
def _of_corners(
    values: FloatArray, solid: Solid, block: int, a: Lanes
) -> tuple[Lanes, Lanes, Lanes, Lanes]:
    """Return what the corners of the tetrahedra of a block have of `values`."""
    nodes, width = solid.nodes, width_of(solid.shape)
    first = 4 * width * block
    return (
        gathered_like(a, values, nodes, first),
        gathered_like(a, values, nodes, first + width),
        gathered_like(a, values, nodes, first + 2 * width),
        gathered_like(a, values, nodes, first + 3 * width),
    )


@inlined
def _growth(solid: Solid, block: int, cofactors: tuple[Vec3, Vec3, Vec3]) -> Lanes:
    """Return the largest growth of the square of a face of each tetrahedron, at least 1.

    The area vector of the face opposite node k is 3 V cof F grad N_k.
    """
    g1, g2, g3, g0 = _gradients_of_shape(solid, block)
    growth = larger(
        larger(_square(cofactors, g1) / dot(g1, g1), _square(cofactors, g2) / dot(g2, g2)),
        larger(_square(cofactors, g3) / dot(g3, g3), _square(cofactors, g0) / dot(g0, g0)),
    )
    return larger(growth, splat(1.0, growth))


@inlined
def _grows_further(
    solid: Solid, block: int, cofactors: tuple[Vec3, Vec3, Vec3], room: Lanes
) -> bool:
    """Return whether the square of a face of a block has grown by more than the factor `room`."""
    g1, g2, g3, g0 = _gradients_of_shape(solid, block)
    excess = larger(
        larger(
            _square(cofactors, g1) - room * dot(g1, g1),
            _square(cofactors, g2) - room * dot(g2, g2),
        ),
        larger(
            _square(cofactors, g3) - room * dot(g3, g3),
            _square(cofactors, g0) - room * dot(g0, g0),
        ),
    )
    return any_above(excess, splat(0.0, excess))


@inlined
def _gradients_of_shape(solid: Solid, block: int) -> tuple[Vec3, Vec3, Vec3, Vec3]:
    """Return the gradients of the shape functions of nodes 1, 2, 3 and 0, the last one negative."""
    g1 = gradient_of_shape(solid, block, 0)
    g2 = gradient_of_shape(solid, block, 3)
    g3 = gradient_of_shape(solid, block, 6)
    return g1, g2, g3, add(g1, add(g2, g3))


@inlined
def _write_stiffness(solid: Solid, block: int, x: Vec3, y: Vec3, z: Vec3, is_known: bool) -> Lanes:
    """Write a bound on the stiffness of the shear part over that at rest, and what it is of.

    It is returned.

    Of averaged shear it is that at the nodes, and what tetrahedra take back.

    Args:
        solid: Written.
        block: The block.
        x: First row of H.
        y: Second row.
        z: Third row.
        is_known: Whether `displacement_gradients` has found g.
    """
    place = width_of(solid.shape) * (1 + block)
    if stiffens(solid.law):
        stiffness = _stiffness_of_law(solid, block, (x, y, z), is_known)
    else:
        stiffness = splat(1.0, x.x)
    if averages_shear(solid):
        of_nodes = splat(solid.law.shear_of_nodes, x.x)
        taken = mean_of_nodes(solid.stiffness_taken, solid, block, x.x)
        if stiffens(solid.law):
            of_averages = mean_of_nodes(solid.node_stiffness, solid, block, x.x)
            if is_graded(solid):  # nodes that average nothing count as 0
                own = own_share_of(solid, block, x.x)
                stiffness = own * stiffness + of_nodes * of_averages
            else:
                taken = taken + (of_averages - stiffness)
        stiffness = stiffness + of_nodes * taken
    store_block(solid.stiffness, place, stiffness)
    return stiffness


@inlined
def _stiffness_of_law(solid: Solid, block: int, gradient: MatrixRows, is_known: bool) -> Lanes:
    """Return the stiffness under a law that stiffens; see `_write_stiffness`."""
    cofactors = cofactors_of(*gradient)
    q = stretch_invariant(*gradient, *cofactors)
    of, place = law_of_block(solid, block, q), width_of(solid.shape) * (1 + block)
    if not is_known:
        store_block(solid.stiffening, place, stiffening_factor(of, q))
    g = load_block(solid.stiffening, place)
    stiffness, slope = shear_stiffness(of, q, g, gradient, cofactors)
    store_block(solid.stiffening_slope, place, slope)
    return stiffness


@inlined
def _square(cofactors: MatrixRows, g: Vec3) -> Lanes:
    """Return |C g|^2 from the rows of C."""
    n = product_with(cofactors, g)
    return dot(n, n)
