"""The paper's hierarchical relaxation: its equilibrium, its order, and what it gives up."""

import numpy as np
import pytest

from tests.tissue.integrators.networks import (
    FREE_FALL,
    block,
    frames,
    highest_frequency,
    nearest,
    rings_around,
    shake,
)
from tests.tissue.kernels_of import row
from tissue.integrators.hierarchical.kernels import new_trails
from tissue.integrators.node_rings import UNREACHED, ring_of

TOP = np.array([0.02, 0.02, 0.04])


def sagging(n):
    """Return a block between two walls that sags under its weight, in thick oil."""
    return block(n, gravity=FREE_FALL, drag=60.0, retardation_time=2e-4)


def at_rest(network):
    """Return where the nodes are when all were moved together until they stopped [m]."""
    h = 1.5 / highest_frequency(network)
    network.advance(h, int(2.0 / h))
    positions = network.body.positions.copy()
    network.body.positions[:] = network.body.rest
    network.body.velocities[:] = 0.0
    return positions


def wrong_by(network, expected):
    """Return the largest error in units of the largest displacement."""
    largest = np.abs(expected - network.body.rest).max()
    return np.abs(network.body.positions - expected).max() / largest


def relaxed(n, last_ring, *, frozen, seconds=2.0):
    """Relax a sagging block hierarchically around the middle of its top; return how wrong it is."""
    network = sagging(n)
    expected = at_rest(network)
    span = 1.0 / highest_frequency(network)
    focus = nearest(network, TOP)
    frames(network, focus, span, int(seconds / span), 1 << last_ring, last_ring, frozen)
    return wrong_by(network, expected)


def test_the_equilibrium_is_that_of_all_nodes_together_where_rings_reach_every_node():
    """No node of the block is more than 5 edges away."""
    assert relaxed(3, 5, frozen=True) < 1e-6


def test_the_equilibrium_is_the_same_where_far_nodes_are_moved_once_a_frame():
    assert relaxed(4, 2, frozen=False) < 1e-6


@pytest.mark.parametrize("last_ring", [1, 2])
def test_where_far_nodes_are_frozen_they_do_not_come_to_equilibrium(last_ring):
    """The paper's printed rule, i(s) = 0 beyond s_max: most of the sag is missing."""
    assert 0.3 < relaxed(4, last_ring, frozen=True) <= 1.0


def test_a_node_frozen_for_ten_seconds_comes_back_without_a_leap():
    """Its clock is that of the frame: the time stamp of when it was moved last would leap."""
    network = sagging(4)
    span = 1.0 / highest_frequency(network)
    near, far = nearest(network, [0.01, 0.0, 0.0]), nearest(network, [0.03, 0.04, 0.04])
    body = network.body
    size = 0.04 / 4
    body.velocities[:] = 0.1
    trails = new_trails(len(body.rest))
    frames(network, near, span, int(10.0 / span), 2, 1, True, trails)
    before = body.positions.copy()
    frames(network, far, span, 1, 2, 1, True, trails)
    assert 0.0 < np.abs(body.positions - before).max() < 0.01 * size


def naive_frame(network, focus, span, updates, last_ring):
    """Do a frame with far nodes frozen, one node after the other: the paper's scheme word by word.

    Each neighbour q is seen at time t as x_q + (t - tau_q) v_q.
    """
    body, springs, around = network.body, network.springs, network.surroundings
    rings = rings_around(network, focus, last_ring + 1)
    order = rings.order[: rings.n_found].tolist()
    x, v, stamp = body.positions, body.velocities, np.zeros(len(body.rest))
    v[[ring_of(rings, i) in (UNREACHED, last_ring + 1) for i in range(len(x))]] = 0.0
    gravity = np.array(around.gravity)

    def acceleration(i, t, xi, vi):
        force = np.zeros(3)
        for q, (k, rest_pull) in row(springs, i).items():
            d = x[q] + (t - stamp[q]) * v[q] - xi
            length = np.linalg.norm(d)
            force += (k - rest_pull / length) * d
            force += around.retardation_time * k * ((v[q] - vi) @ d) * d / length**2
        return force / body.masses[i] + gravity - around.drag * vi

    for j in range(1, updates + 1):
        t1 = span * j / updates
        for i in order:
            ring = ring_of(rings, i)
            if ring > last_ring or j % 2**ring or body.fixed[i]:
                continue
            t0, xi, vi = stamp[i], x[i].copy(), v[i].copy()
            h = t1 - t0
            a1 = acceleration(i, t0, xi, vi)
            middle = xi + h / 2 * vi + h * h / 8 * a1
            a2 = acceleration(i, t0 + h / 2, middle, vi + h / 2 * a1)
            a3 = acceleration(i, t0 + h / 2, middle, vi + h / 2 * a2)
            a4 = acceleration(i, t1, xi + h * vi + h * h / 2 * a3, vi + h * a3)
            x[i] = xi + h * vi + h * h / 6 * (a1 + a2 + a3)
            v[i] = vi + h / 6 * (a1 + 2 * a2 + 2 * a3 + a4)
            stamp[i] = t1


@pytest.mark.kernel
@pytest.mark.parametrize("retardation_time", [0.0, 1e-3])
def test_a_frame_is_that_of_the_paper_written_plainly(retardation_time):
    results = []
    for advance in (naive_frame, None):
        network = block(2, gravity=FREE_FALL, drag=5.0, retardation_time=retardation_time)
        shake(network, 1e-3)
        focus = nearest(network, TOP)
        for _ in range(3):
            if advance:
                advance(network, focus, 2e-3, 4, 1)
        if not advance:
            frames(network, focus, 2e-3, 3, 4, 1, True)
        results.append((network.body.positions.copy(), network.body.velocities.copy()))
    np.testing.assert_allclose(results[1][0], results[0][0], rtol=0.0, atol=1e-15)
    np.testing.assert_allclose(results[1][1], results[0][1], rtol=0.0, atol=1e-11)


def error(retardation_time, n):
    """Return the error after 40 ms in `n` frames of one ring, every node moved once in each."""
    ends = []
    for advance in ("together", "one by one"):
        network = block(3, retardation_time=retardation_time)
        shake(network, 2e-4)
        if advance == "together":
            network.advance(0.04 / 2000, 2000)
        else:
            frames(network, nearest(network, TOP), 0.04 / n, n, 1, 0, False)
        ends.append(network.body.positions.copy())
    return np.abs(ends[1] - ends[0]).max()


@pytest.mark.parametrize(("retardation_time", "least"), [(0.0, 1.8), (2e-4, 0.9)])
def test_the_order_is_two_and_one_with_damping_along_springs(retardation_time, least):
    """A neighbour seen on a straight line is wrong by the square of the time."""
    coarse, fine = (error(retardation_time, n) for n in (200, 800))
    assert np.log2(coarse / fine) / 2 > least


def test_a_free_body_keeps_its_momentum_only_nearly():
    """The two ends of a spring see each other at different times: that is the scheme's price."""
    network = block(3, held=False)
    shake(network, 2e-4)
    masses, v = network.body.masses[:, None], network.body.velocities
    span = 0.25 / highest_frequency(network)
    frames(network, nearest(network, TOP), span, int(0.1 / span), 1, 0, False)
    scale = np.sqrt((masses * v**2).sum() * masses.sum())
    drift = np.linalg.norm((masses * v).sum(axis=0)) / scale
    assert 1e-12 < drift < 0.05
