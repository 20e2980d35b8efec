"""A bound on the frequencies of tetrahedra as they are deformed now, beside the bound at rest.

It is quick to find for all tetrahedra (`tissue.elasticity.quick_frequency`), and wide, because a
sliver that is stretched to four times its area adds little to what its nodes resist. Where it is
too high to be of use, a tetrahedron is tested (`tissue.elasticity.tested_frequency`). What was
found is kept, and grows as the faces of the tetrahedron do, or its stiffness; it is tested again
when these differ by some percent. In an organ in a cut one or two are tested in a bound.

Too high means that it takes one more step. Where a tetrahedron takes one, others may take it too.
"""

import math
from typing import NamedTuple

from tissue.core.array_types import FloatArray
from tissue.core.jit import kernel
from tissue.core.simd_blocks import width_of
from tissue.elasticity.finite_elements import Solid, n_blocks
from tissue.elasticity.internal_forces import Elastic
from tissue.elasticity.neo_hookean import displacements
from tissue.elasticity.quick_frequency import (
    list_fast_blocks,
    quick_bounds,
    quick_bounds_of_one,
)
from tissue.elasticity.tested_frequency import bound_near_truth, is_as_tested
from tissue.mesh.body import Body
from tissue.mesh.star import Visits

MOST_TESTS = 64
"""Tetrahedra tested for one bound, at most: some 100 us. What is left keeps the quick bound, and
the motion takes more steps until it is tested. Where a stiff body swings after a cut, hundreds of
its tetrahedra are near the limit, and to test them all took longer than the steps."""

EXPECTED_SHARE = 0.8
"""Share of the quick bound of the last fastest tetrahedron that it is expected to have at least.
Where it has less, all are looked at again; nearer to 0, more of them are at first."""


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
        limit: It need not be nearer to the truth than the number of steps asks for. The bound is
            not below what they allow where the tetrahedra are.
        is_known: Whether `displacement_gradients` was run there, and gradients are kept.
    """
    solid = elastic.solid
    solid.test += 1
    if not is_known:
        displacements(solid, body, points, solid.every, 0, body.n_nodes)
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
        limit: The number of steps that is asked for.
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
