"""Step selection: which nodes take substeps, and how many, by stiffness and by the blade."""

import math

import numpy as np

from tissue.blade.blade_state import BladeState
from tissue.blade.forces import add_blade_frequency
from tissue.core.array_types import BoolArray, FloatArray
from tissue.core.jit import kernel
from tissue.core.structs import Arrays
from tissue.elasticity.internal_forces import Elastic
from tissue.elasticity.springs import Springs
from tissue.integrators.focus import find_held
from tissue.integrators.local.chebyshev import substep_limits
from tissue.integrators.local.element_subsets import Patch, find_patch, reach_of
from tissue.integrators.local.kernels import Zone
from tissue.integrators.local.sleeping import AWAKE, Activity
from tissue.integrators.node_rings import Rings, add_focus, begin_search, search
from tissue.mesh.body import Body

STEP_SAFETY = 0.8
"""Share of the stable step that is used: `SAFETY` of the Runge-Kutta method, for its reason."""

MOST_STEPS = 64
"""Divisions of a time step that are considered."""

COST_OF_FINE = 3.0
"""What a substep of a fine node costs, with the neighbours that take part, in steps of others."""


class StepTables(Arrays):
    """Tables by the number of divisions, for `plan_steps`."""

    substep_limits: FloatArray
    """Largest stable frequency times step by number of substeps; see `chebyshev.substep_limits`."""
    limits: FloatArray
    """Scratch, shape (MOST_STEPS + 1,)."""
    n_above: FloatArray
    """Scratch, shape (MOST_STEPS + 1,)."""


def new_step_tables(stabilisation: float) -> StepTables:
    """Return the tables for a scheme with that nu."""
    limits, n_above = np.zeros((2, MOST_STEPS + 1))
    return StepTables(substep_limits=substep_limits(stabilisation), limits=limits, n_above=n_above)


@kernel
def plan_steps(
    activity: Activity,
    fixed: BoolArray,
    frequency_squared: FloatArray,
    n_near: int,
    span: float,
    retardation_time: float,
    tables: StepTables,
) -> tuple[int, int, float]:
    """Return the number of macro steps, the number of substeps of each, and the fine limit.

    Of all pairs that are stable, the one that costs least. The limit is the bound on w^2 [1/s2]
    above which a node is fine.

    Args:
        activity: The listed nodes.
        fixed: Which nodes do not move.
        frequency_squared: Bound on w^2 of each node, with what the blade adds [1/s2].
        n_near: Number of nodes around the blade that are fine anyway.
        span: Time to be divided [s].
        retardation_time: Damping along springs [s].
        tables: Limits of the substeps, and scratch.
    """
    substep_limits, limits, n_above = tables.substep_limits, tables.limits, tables.n_above
    highest = 0.0
    for k in range(activity.n_listed):
        if not fixed[activity.listed[k]]:
            highest = max(highest, frequency_squared[activity.listed[k]])
    most = 1
    while True:
        limits[most] = coarse_limit(span / most, retardation_time)
        n_above[most] = 0.0
        if limits[most] >= highest or most == MOST_STEPS:
            break
        most += 1
    for k in range(activity.n_listed):
        node = activity.listed[k]
        w2 = 0.0 if fixed[node] else frequency_squared[node]
        n = 1
        while n <= most and w2 > limits[n]:
            n_above[n] += 1.0
            n += 1
    best, best_substeps, best_cost = most, len(substep_limits) - 1, np.inf
    for n in range(1, most + 1):
        p = n_substeps(highest, span / n, substep_limits)
        if p == len(substep_limits):
            continue
        cost = n * (activity.n_listed + p * COST_OF_FINE * (n_near + n_above[n]))
        if cost < best_cost:
            best, best_substeps, best_cost = n, p, cost
    return best, best_substeps, limits[best]


@kernel
def coarse_limit(h: float, retardation_time: float) -> float:
    """Return the largest w^2 [1/s2] for which a step of `h` [s] is stable, dampers lagging by half.

    The exact limit of x'' = -w^2 (x + b x') is (w h)^2 / 4 + w^2 b h / 2 = 1.
    """
    return STEP_SAFETY * STEP_SAFETY / (0.25 * h * h + 0.5 * retardation_time * h)


@kernel
def n_substeps(frequency_squared: float, h: float, substep_limits: FloatArray) -> int:
    """Return the substeps for which a step of `h` [s] is stable up to that w^2 [1/s2].

    See `chebyshev`. One more than allowed where the allowed number does not suffice.
    """
    p = 1
    phase = math.sqrt(frequency_squared) * h
    while p < len(substep_limits) and phase > STEP_SAFETY * substep_limits[p]:
        p += 1
    return p


@kernel
def find_bounds(
    body: Body,
    elastic: Elastic,
    blade: BladeState,
    activity: Activity,
    zone: Zone,
    scratch: FloatArray,
) -> None:
    """Write the bound on w^2 of each listed node to `zone.bound` [1/s2], with what the blade adds.

    Args:
        body: For masses.
        elastic: Bounds of the body alone.
        blade: The blade; all free nodes that it acts on are listed.
        activity: The listed nodes.
        zone: Its bounds are written.
        scratch: Scratch of shape (capacity, 3), zero at the nodes that the blade acts on.
    """
    for k in range(activity.n_listed):
        zone.bound[activity.listed[k]] = elastic.frequency_squared[activity.listed[k]]
    add_blade_frequency(blade, body, zone.bound, scratch)


@kernel
def find_near(body: Body, springs: Springs, blade: BladeState, zone: Zone, n_rings: int) -> int:
    """Write the free nodes that the blade acts on, and around, to `zone.fine`; return how many.

    Args:
        body: For the fixed nodes.
        springs: The rows of neighbours.
        blade: What acts on the nodes.
        zone: Written.
        n_rings: Number of rings of neighbours around those nodes.
    """
    rings = zone.rings
    if not find_held(rings, body, blade):
        return 0
    search(rings, springs, n_rings)
    n = 0
    for k in range(rings.n_found):
        if not body.fixed[rings.order[k]]:
            zone.fine[n] = rings.order[k]
            n += 1
    return n


@kernel
def find_zone(elastic: Elastic, activity: Activity, zone: Zone, n_near: int, limit: float) -> None:
    """Make the nodes near the blade, and the stiff ones, the fine nodes.

    Args:
        elastic: Forces inside the body.
        activity: The listed nodes; those near the blade are awake.
        zone: Its rings and tetrahedra are written.
        n_near: Number of nodes that `find_near` wrote.
        limit: Bound on w^2 above which an awake node is fine [1/s2].
    """
    rings = zone.rings
    begin_search(rings)
    for k in range(n_near):
        add_focus(rings, zone.fine[k])
    for k in range(activity.n_listed):
        node = activity.listed[k]
        if activity.state[node] == AWAKE and zone.bound[node] > limit:
            add_focus(rings, node)
    reach = reach_of(elastic)
    search(rings, elastic.springs, reach)
    find_patch(zone.patch, elastic, rings, 0, reach - 1)


@kernel
def find_listed_patch(patch: Patch, elastic: Elastic, activity: Activity, around: Rings) -> None:
    """List what to evaluate for the forces on all listed nodes; `around` is scratch.

    One ring beyond them takes part: the pressure of nodes asleep there acts on them.
    """
    if not elastic.has_tetrahedra:
        return
    begin_search(around)
    for k in range(activity.n_listed):
        add_focus(around, activity.listed[k])
    search(around, elastic.springs, 1)
    find_patch(patch, elastic, around, 1, 0)
