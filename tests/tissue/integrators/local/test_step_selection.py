"""Which nodes are fine, and how a step is divided."""

import numpy as np
import pytest

from tests.tissue.integrators.networks import block, found
from tests.tissue.kernels_of import elastic_of, tool_with
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


def divided(frequencies, span, n_near=0):
    """Return the plan for a body whose nodes have these bounds on w [1/s]."""
    activity = awake()
    squared = np.array(frequencies) ** 2
    still = np.zeros(N_NODES, dtype=bool)
    return plan_steps(activity, still, squared, n_near, span, 0.0, TABLES)


def test_a_body_that_bears_the_step_takes_one():
    assert divided(np.full(N_NODES, 1000.0), 1e-3)[:2] == (1, 1)


def test_a_body_of_equal_nodes_is_divided_and_has_no_fine_ones():
    """3,000 /s bear 0.8 * 2 / 3,000 s."""
    n, p, limit = divided(np.full(N_NODES, 3000.0), 1e-3)
    assert (n, p) == (2, 1)
    assert limit >= 3000.0**2


def test_a_few_stiff_nodes_take_substeps_and_the_others_do_not():
    frequencies = np.full(N_NODES, 1000.0)
    stiff = ~BODY.fixed
    stiff[:30] = False
    stiff[34:] = False
    frequencies[stiff] = 5000.0
    n, p, limit = divided(frequencies, 1e-3)
    assert n == 1
    assert 4 <= p <= 5
    assert 1000.0**2 < limit < 5000.0**2


def test_what_anchors_add_counts():
    """To the bound of each node that they pull on, and to no other."""
    elastic, tool, activity, zone = elastic_of(SPRINGS), held_tool(), awake(), new_zone(*ROOM)
    elastic.frequency_squared[:] = 1e6
    scratch = np.zeros((N_NODES, 3))
    find_bounds(BODY, elastic, tool, activity, zone, scratch)
    added = zone.bound - 1e6
    expected = np.zeros(N_NODES)
    stiffness, weights = tool.anchors.stiffness[0], tool.anchors.weights[0]
    expected[BODY.tetrahedra[5]] = stiffness * weights / BODY.masses[BODY.tetrahedra[5]]
    free = ~BODY.fixed
    np.testing.assert_allclose(added[free], expected[free], rtol=1e-9)
    assert not scratch.any()


@pytest.mark.parametrize("phase", [0.5, 1.5, 3.0, 10.0, 50.0])
def test_as_many_substeps_as_stability_needs_and_no_more(phase):
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


def held_tool():
    """Return a blade one of whose samples holds the middle of a tetrahedron."""
    anchors = new_anchors(2, 0.01, 10e3)
    anchors.state[0] = ANCHORED
    anchors.tetrahedron[0] = 5
    anchors.weights[0] = 0.25
    return tool_with(anchors)


def awake():
    """Return the activity of a body all of whose nodes are awake."""
    activity = all_asleep(N_NODES)
    wake_all(activity, BODY, SPRINGS)
    return activity


def test_fine_are_the_nodes_at_the_blade_and_those_that_are_stiff():
    elastic, activity, zone = elastic_of(SPRINGS), awake(), new_zone(*ROOM)
    held = [int(i) for i in BODY.tetrahedra[5] if not BODY.fixed[i]]
    stiff = int(np.flatnonzero(~BODY.fixed)[-1])
    zone.bound[stiff] = 2.0
    n_near = find_near(BODY, SPRINGS, held_tool(), zone, 0)
    assert sorted(zone.fine[:n_near].tolist()) == sorted(held)
    find_zone(elastic, activity, zone, n_near, 1.0)
    fine = [i for i in found(zone.rings) if ring_of(zone.rings, i) == 0]
    assert sorted(fine) == sorted([*held, stiff])
    assert find_near(BODY, SPRINGS, tool_with(new_anchors(2, 0.01, 10e3)), zone, 0) == 0
