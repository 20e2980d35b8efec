"""The choice of fine nodes, and the division of a step."""

import numpy as np
import pytest

from tests.tissue.integrators.networks import block, found_nodes
from tests.tissue.kernels_of import elastic_of, line_blade
from tissue.blade.anchors import ANCHORED, new_anchors
from tissue.integrators.local.chebyshev import STABILISATION, substep_limits
from tissue.integrators.local.kernels import new_zone
from tissue.integrators.local.sleeping import all_asleep, wake_all
from tissue.integrators.local.step_selection import (
    STEP_SAFETY,
    coarse_limit,
    find_bounds,
    find_near,
    find_zone,
    n_substeps,
    new_step_tables,
    plan_steps,
)
from tissue.integrators.node_rings import ring_of

pytestmark = pytest.mark.kernel

NETWORK = block(3)
BODY, SPRINGS = NETWORK.body, NETWORK.springs
N_NODES = len(BODY.rest)
ROOM = (N_NODES, len(BODY.tetrahedra))
LIMITS = substep_limits()
TABLES = new_step_tables(STABILISATION)


def plan_for(frequencies, span, n_near=0):
    """Return the plan for a body whose nodes have these bounds on w [1/s]."""
    activity = awake()
    squared = np.array(frequencies) ** 2
    still = np.zeros(N_NODES, dtype=bool)
    return plan_steps(activity, still, squared, n_near, span, 0.0, TABLES)


def test_a_step_that_is_stable_is_not_divided():
    assert plan_for(np.full(N_NODES, 1000.0), 1e-3)[:2] == (1, 1)


def test_the_step_of_a_body_of_equal_nodes_is_divided_without_fine_nodes():
    """At 3,000 /s a step of 0.8 * 2 / 3,000 s is stable."""
    n, p, limit = plan_for(np.full(N_NODES, 3000.0), 1e-3)
    assert (n, p) == (2, 1)
    assert limit >= 3000.0**2


def test_a_few_stiff_nodes_take_substeps_and_the_others_do_not():
    frequencies = np.full(N_NODES, 1000.0)
    stiff = ~BODY.fixed
    stiff[:30] = False
    stiff[34:] = False
    frequencies[stiff] = 5000.0
    n, p, limit = plan_for(frequencies, 1e-3)
    assert n == 1
    assert 4 <= p <= 5
    assert 1000.0**2 < limit < 5000.0**2


def test_anchors_raise_the_bound_of_the_nodes_they_pull_on():
    """The bounds of other nodes do not change."""
    elastic, blade, activity, zone = elastic_of(SPRINGS), anchored_blade(), awake(), new_zone(*ROOM)
    elastic.frequency_squared[:] = 1e6
    scratch = np.zeros((N_NODES, 3))
    find_bounds(BODY, elastic, blade, activity, zone, scratch)
    added = zone.bound - 1e6
    expected = np.zeros(N_NODES)
    stiffness, weights = blade.anchors.stiffness[0], blade.anchors.weights[0]
    expected[BODY.tetrahedra[5]] = stiffness * weights / BODY.masses[BODY.tetrahedra[5]]
    free = ~BODY.fixed
    np.testing.assert_allclose(added[free], expected[free], rtol=1e-9)
    assert not scratch.any()


@pytest.mark.parametrize("phase", [0.5, 1.5, 3.0, 10.0, 50.0])
def test_the_substeps_are_as_many_as_stability_needs_and_no_more(phase):
    p = n_substeps((phase / 1e-3) ** 2, 1e-3, LIMITS)
    assert phase <= STEP_SAFETY * LIMITS[p]
    assert p == 1 or phase > STEP_SAFETY * LIMITS[p - 1]


@pytest.mark.parametrize("retardation_time", [0.0, 1e-4, 1e-2])
def test_the_coarse_limit_is_that_of_leap_frog_with_lagging_dampers(retardation_time):
    """x'' = -w^2 (x + b x'), x' half a step ago: at the limit, without safety, a root is -1."""
    h = 1e-3
    squared = coarse_limit(h, retardation_time) / STEP_SAFETY**2
    kick = np.array([[1.0, 0.0], [-h * squared, 1.0 - h * squared * retardation_time]])
    drift = np.array([[1.0, h], [0.0, 1.0]])
    roots = np.linalg.eigvals(drift @ kick)
    assert np.abs(roots).max() == pytest.approx(1.0, abs=1e-9)
    assert roots.real.min() == pytest.approx(-1.0, abs=1e-6)


def anchored_blade():
    """Return a blade with one sample anchored in the middle of a tetrahedron."""
    anchors = new_anchors(2, 0.01, 10e3)
    anchors.state[0] = ANCHORED
    anchors.tetrahedron[0] = 5
    anchors.weights[0] = 0.25
    return line_blade(anchors)


def awake():
    """Return the activity of a body with all nodes awake."""
    activity = all_asleep(N_NODES)
    wake_all(activity, BODY, SPRINGS)
    return activity


def test_the_fine_nodes_are_those_at_the_blade_and_the_stiff_ones():
    elastic, activity, zone = elastic_of(SPRINGS), awake(), new_zone(*ROOM)
    anchored = [int(i) for i in BODY.tetrahedra[5] if not BODY.fixed[i]]
    stiff = int(np.flatnonzero(~BODY.fixed)[-1])
    zone.bound[stiff] = 2.0
    n_near = find_near(BODY, SPRINGS, anchored_blade(), zone, 0)
    assert sorted(zone.fine[:n_near].tolist()) == sorted(anchored)
    find_zone(elastic, activity, zone, n_near, 1.0)
    fine = [i for i in found_nodes(zone.rings) if ring_of(zone.rings, i) == 0]
    assert sorted(fine) == sorted([*anchored, stiff])
    assert find_near(BODY, SPRINGS, line_blade(new_anchors(2, 0.01, 10e3)), zone, 0) == 0
