"""Nodes at rest fall asleep, and accelerated nodes wake."""

import numpy as np
import pytest

from tests.tissue.integrators.networks import block, found_nodes, nearest, rings_around
from tissue.integrators.local.sleeping import (
    ASLEEP,
    AWAKE,
    CALM,
    SLEEP_ACCELERATION,
    SLEEP_SPEED,
    WAKE_ACCELERATION,
    WATCHED,
    all_asleep,
    doze,
    wake,
    wake_all,
    wake_pulled,
)

pytestmark = pytest.mark.kernel

NETWORK = block(3)
BODY, SPRINGS = NETWORK.body, NETWORK.springs
N_NODES = len(BODY.rest)
INNER = nearest(NETWORK, np.array([0.02, 0.02, 0.02]))


def states(activity):
    return activity.state.tolist()


def listed(activity):
    return activity.listed[: activity.n_listed].tolist()


def one_awake():
    """Return the activity of a body with one node in the middle awake."""
    activity = all_asleep(N_NODES)
    wake(activity, BODY, SPRINGS, INNER)
    return activity


def pass_time(activity, seconds, speed=0.0, acceleration=0.0):
    """Advance the activity with the same speed and acceleration of every node along x."""
    BODY.velocities[:] = [speed, 0.0, 0.0]
    pull = np.tile([acceleration, 0.0, 0.0], (N_NODES, 1))
    doze(activity, BODY, SPRINGS, pull, seconds)


def test_a_node_that_wakes_has_its_neighbours_watched():
    activity = one_awake()
    neighbours = found_nodes(rings_around(NETWORK, INNER, 1))[1:]
    assert listed(activity) == [INNER, *neighbours]
    assert states(activity)[INNER] == AWAKE
    assert {states(activity)[i] for i in neighbours} == {WATCHED}
    assert states(activity).count(ASLEEP) == N_NODES - 1 - len(neighbours)


def test_fixed_nodes_never_wake():
    activity = all_asleep(N_NODES)
    wake_all(activity, BODY, SPRINGS)
    free = int((~BODY.fixed).sum())
    assert activity.n_awake == free
    assert [i for i, state in enumerate(states(activity)) if state == AWAKE] == np.flatnonzero(
        ~BODY.fixed
    ).tolist()


def test_a_calm_node_falls_asleep_after_the_waiting_time_and_not_before():
    activity = one_awake()
    pass_time(activity, 0.6 * CALM)
    assert states(activity)[INNER] == AWAKE
    pass_time(activity, 0.6 * CALM)
    assert listed(activity) == []
    assert set(states(activity)) == {ASLEEP}


@pytest.mark.parametrize(
    "motion", [{"speed": 1.1 * SLEEP_SPEED}, {"acceleration": 1.1 * SLEEP_ACCELERATION}]
)
def test_a_node_that_moves_or_is_accelerated_stays_awake(motion):
    activity = one_awake()
    for _ in range(3):
        pass_time(activity, CALM, **motion)
    assert states(activity)[INNER] == AWAKE


def test_a_moment_of_motion_restarts_the_waiting_time():
    activity = one_awake()
    pass_time(activity, 0.9 * CALM)
    pass_time(activity, 0.9 * CALM, speed=2.0 * SLEEP_SPEED)
    pass_time(activity, 0.9 * CALM)
    assert states(activity)[INNER] == AWAKE


def test_the_momentum_given_up_is_counted():
    activity = one_awake()
    pass_time(activity, 2.0 * CALM, speed=0.5 * SLEEP_SPEED)
    expected = BODY.masses[INNER] * 0.5 * SLEEP_SPEED
    np.testing.assert_allclose(activity.given_up, [expected, 0.0, 0.0], rtol=1e-14)
    assert not BODY.velocities[INNER].any()


@pytest.mark.parametrize("share", [0.9, 1.1])
def test_a_watched_node_wakes_above_the_wake_acceleration(share):
    activity = one_awake()
    neighbour = listed(activity)[1:]
    free = next(i for i in neighbour if not BODY.fixed[i])
    pull = np.zeros((N_NODES, 3))
    pull[free, 1] = share * WAKE_ACCELERATION
    wake_pulled(activity, BODY, SPRINGS, pull)
    assert states(activity)[free] == (AWAKE if share > 1.0 else WATCHED)


def test_a_watched_node_is_dropped_when_no_neighbour_is_awake():
    activity = one_awake()
    other = next(i for i in listed(activity)[1:] if not BODY.fixed[i])
    wake(activity, BODY, SPRINGS, other)
    activity.calm[INNER] = CALM  # falls asleep at the next update; the other does not
    pass_time(activity, 0.1 * CALM)
    around = found_nodes(rings_around(NETWORK, other, 1))
    assert sorted(listed(activity)) == sorted(around)
    assert states(activity)[INNER] == WATCHED
