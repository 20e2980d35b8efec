"""A bound on the frequencies of tetrahedra as they are deformed now, besides the bound at rest.

It is quick to find for all tetrahedra (`tissue.elasticity.frequency.quick`), and wide, because a
sliver that is stretched to four times its area adds little to what its nodes resist. Where it is
too high to be of use, a tetrahedron is tested: the bound at rest
(`tissue.elasticity.frequency.at_rest`) is evaluated at its nodes with their neighbours as they are
deformed. What was found is kept, and grows as the faces of the tetrahedron do, or its stiffness; it
is tested again when these differ by some percent. In an organ in a cut one or two are tested in a
bound.

Too high means that it takes one more step. Where a tetrahedron takes one, others may take it too.

Ahead of a blade tissue is stretched, and nodes of some milligrams hang on its stiff edge. A few
such nodes would set the time step of the whole body, as slivers would
(`tissue.elasticity.mass_scaling`): what strain or the blade makes faster than the limit gets mass.
"""

import math
from typing import NamedTuple

from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import kernel
from tissue.core.simd_blocks import width_of
from tissue.core.vec3 import dot, vec3
from tissue.elasticity.finite_elements import Solid, averages_shear, n_blocks, node_place
from tissue.elasticity.frequency.at_rest import bounds_of_node, dilatation_term
from tissue.elasticity.frequency.quick import (
    has_stiffness,
    list_fast_blocks,
    quick_bounds,
    quick_bounds_of_one,
)
from tissue.elasticity.gradients import displacements
from tissue.elasticity.internal_forces import Elastic
from tissue.elasticity.neo_hookean import deform_solid
from tissue.elasticity.stars import tetrahedron_of_slot
from tissue.mesh.body import Body
from tissue.mesh.star import Visits

MOST_TESTS = 64
"""Tetrahedra tested for one bound, at most: some 100 us. What is left keeps the quick bound, and
the motion takes more steps until it is tested. Where a stiff body swings after a cut, hundreds of
its tetrahedra are near the limit, and to test them all took longer than the steps."""

EXPECTED_SHARE = 0.8
"""Share of the quick bound of the last fastest tetrahedron that it is expected to have at least.
Where it has less, all are looked at again; nearer to 0, more of them are at first."""


FURTHER = 1.05
"""Ratio by which the growth of a face may differ from that at the last test, either way, before
the tetrahedron is tested again. Nearer to 1: what moves is tested in every step; larger: more steps
are taken than needed, up to half of the excess of this over 1."""

NO_FREQUENCY = 1e-12
"""A bound on w^2 [1/s2] far below any, in place of 0: where all nodes of a tetrahedron are
fixed."""


class StepLimit(NamedTuple):
    """Up to which frequencies a number of steps is stable."""

    allowed: float
    """Bound on w^2 of the tetrahedra [1/s2] up to which it is."""
    added: float
    """Share of blade and contact in that bound [1/s2]."""
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
        limit: It need not be nearer to the truth than the number of steps requires. The bound is
            not below what they allow where the tetrahedra are.
        is_known: Whether `displacement_gradients` was run there, and gradients are kept; where
            shear is averaged `average_around_nodes` as well.
    """
    solid = elastic.solid
    solid.test += 1
    if not is_known:
        if averages_shear(solid):
            deform_solid(solid, body, points)
        else:
            displacements(solid, body, points, 0, body.n_nodes)
    width, left, last = width_of(solid.shape), MOST_TESTS, solid.fastest
    allowed, highest, solid.fastest = limit.allowed, 0.0, -1
    # Most often the fastest one still is: what needs no more steps than it is not looked at.
    expected, is_expected = allowed, False
    if limit.n_steps > 0 and 0 <= last < body.n_tetrahedra:
        quick_bounds_of_one(elastic, last // width, is_known)
        quick = float(solid.strained_bound[width + last])
        if is_as_tested(solid, width + last):
            highest = quick
            expected = allowed = _noted(solid, limit, last, quick, allowed)
        elif EXPECTED_SHARE * quick > allowed:
            expected, is_expected = EXPECTED_SHARE * quick, True
    n_listed = list_fast_blocks(solid, body.n_tetrahedra, expected, is_known)
    if is_expected:
        highest = bound_near_truth(elastic, body, points, visits, last)
        allowed = _noted(solid, limit, last, highest, allowed)
        left -= 1
        if allowed < expected:
            n_listed = list_fast_blocks(solid, body.n_tetrahedra, allowed, is_known)
    if n_listed < n_blocks(solid, body.n_tetrahedra):
        highest = max(highest, allowed)
    for i in range(n_listed):
        block = solid.fast_blocks[i]
        bound = quick_bounds(elastic, block, is_known)
        if bound <= allowed:
            highest = max(highest, bound)
            continue
        for t in range(width * block, width * (block + 1)):
            found = float(solid.strained_bound[width + t])
            if found > allowed and not _is_near_enough(solid, limit, width + t, left):
                found = bound_near_truth(elastic, body, points, visits, t)
                left -= 1
            highest = max(highest, found)
            allowed = _noted(solid, limit, t, found, allowed)
    return highest


@kernel
def _noted(solid: Solid, limit: StepLimit, t: int, found: float, allowed: float) -> float:
    """Note a tetrahedron if it sets the number of steps; return what these allow [1/s2].

    Args:
        solid: Written.
        limit: The number of steps that is required.
        t: The tetrahedron.
        found: Bound on its w^2 [1/s2].
        allowed: What the number of steps so far allows [1/s2].
    """
    if found <= allowed:
        return allowed
    solid.fastest = t
    if limit.n_steps == 0:
        return allowed
    for_one = (limit.allowed + limit.added) / limit.n_steps**2
    n = math.ceil(math.sqrt((found + limit.added) / for_one))
    return max(for_one * n * n - limit.added, found)


@kernel
def _is_near_enough(solid: Solid, limit: StepLimit, place: int, left: int) -> bool:
    """Return whether the quick bound of a tetrahedron is used as it is.

    It is where a test would find little, or as many were tested as may be.
    """
    if limit.n_steps == 0:
        return False
    return left == 0 or is_as_tested(solid, place)


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
    if has_stiffness(solid):
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
    """Return the bound on w^2 at a node in contact, as its neighbourhood is deformed [1/s2]."""
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
    of_contact, allowed = elastic.of_contact[node], elastic.scaling.allowed_where_strained
    if of_contact > 0.0:
        allowed = max(allowed, elastic.allowed_touching)
    bound = limited_frequency(elastic, body, node, bound + of_contact, allowed / FURTHER)
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
                own = elastic.frequency_squared[corner] + elastic.of_contact[corner]
                highest = max(highest, own)
                shear = max(shear, solid.shear_frequency_squared[corner])
            place = width_of(solid.shape) + t
            solid.inverse_bound[place] = 1.0 / highest
            solid.shear_share[place] = shear / highest


@kernel
def forget_tests(solid: Solid, nodes: IntArray, n: int) -> None:
    """Forget the bounds found at the tetrahedra around the first `n` of `nodes`."""
    solid.is_bound_current = 0
    for i in range(n):
        node = nodes[i]
        for slot in range(solid.first[node], solid.first[node] + solid.count[node]):
            place = width_of(solid.shape) + tetrahedron_of_slot(solid, slot)
            solid.tested_growth[place] = solid.tested_stiffness[place] = 1.0
            solid.tested_bound[place] = 0.0


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
        scaling.is_used_up = 1
        return bound
    v, share = vec3(body.velocities, node), mass / (mass + more)
    scaling.added += more
    scaling.between_cuts += more
    scaling.largest = max(scaling.largest, scaling.added)
    scaling.lost += 0.5 * mass * dot(v, v) * (1.0 - share)
    body.masses[node] += more
    body.added_masses[node] += more
    for q in range(3):
        body.velocities[node, q] *= share
    elastic.frequency_squared[node] *= share
    elastic.of_contact[node] *= share
    solid.frequency_squared[node] *= share
    solid.shear_frequency_squared[node] *= share
    limited: float = bound * share
    return limited


@kernel
def limit_touching(elastic: Elastic, body: Body) -> None:
    """Give mass to nodes that contact makes faster than the limit, and write what they have then.

    In each increment: the mass that a node got for another reason it may have given back.
    """
    highest = 0.0
    for i in range(elastic.n_touching):
        node = elastic.touching[i]
        bound = elastic.frequency_squared[node] + elastic.of_contact[node]
        highest = max(
            highest, limited_frequency(elastic, body, node, bound, elastic.allowed_touching)
        )
    elastic.highest_touching = highest
