"""The paper's hierarchical relaxation: its equilibrium, its order and its limits."""

import itertools

import numpy as np
import pytest

from tests.tissue.integrators.networks import (
    FREE_FALL,
    block,
    frequency_bound,
    hierarchical_frames,
    nearest,
    rings_around,
    shake,
)
from tests.tissue.kernels_of import row
from tissue import Hierarchical
from tissue.integrators.bielser_1998.kernels import new_local_clocks
from tissue.integrators.bielser_1998.rings import UNREACHED, ring_of
from tissue.integrators.bielser_1998.stepper import HierarchicalStepper, ring_steps

TOP = np.array([0.02, 0.02, 0.04])
CONSTANT, PENALTY = {"drag": 5.0}, {"retardation_time": 1e-3}
"""The two kinds of damping of section 5.2, each by itself."""
DRIFT = 0.02
"""Relative error of the momentum of a free body: the two ends of a spring see each other late."""


def sagging(n):
    """Return a block between two walls that sags under gravity, with strong drag."""
    return block(n, gravity=FREE_FALL, drag=60.0, retardation_time=2e-4)


def at_rest(network):
    """Return the equilibrium positions from steps of all nodes together; reset the network [m]."""
    h = 1.5 / frequency_bound(network)
    network.advance(h, int(2.0 / h))
    positions = network.body.positions.copy()
    network.body.positions[:] = network.body.rest
    network.body.velocities[:] = 0.0
    return positions


def relative_error(network, expected):
    """Return the largest error of the positions over the largest displacement."""
    largest = np.abs(expected - network.body.rest).max()
    return np.abs(network.body.positions - expected).max() / largest


def relaxed(n, last_ring, *, frozen, seconds=2.0):
    """Relax a sagging block hierarchically around the middle of its top; return its error."""
    network = sagging(n)
    expected = at_rest(network)
    span = 1.0 / frequency_bound(network)
    focus = nearest(network, TOP)
    hierarchical_frames(
        network, focus, span, int(seconds / span), 1 << last_ring, last_ring, frozen
    )
    return relative_error(network, expected)


def test_the_equilibrium_is_the_global_one_if_the_rings_include_every_node():
    """No node of the block is more than 5 edges away."""
    assert relaxed(3, 5, frozen=True) < 1e-6


def test_the_equilibrium_is_the_global_one_if_far_nodes_move_once_a_frame():
    assert relaxed(4, 2, frozen=False) < 1e-6


@pytest.mark.parametrize("last_ring", [1, 2])
def test_frozen_far_nodes_do_not_reach_equilibrium(last_ring):
    """The paper's printed rule, i(s) = 0 beyond s_max: most of the sag is missing."""
    assert 0.3 < relaxed(4, last_ring, frozen=True) <= 1.0


def test_a_node_frozen_for_ten_seconds_moves_again_without_a_jump():
    """Its time is that of the frame; a step from its last time stamp would be a jump."""
    network = sagging(4)
    span = 1.0 / frequency_bound(network)
    near, far = nearest(network, [0.01, 0.0, 0.0]), nearest(network, [0.03, 0.04, 0.04])
    body = network.body
    size = 0.04 / 4
    body.velocities[:] = 0.1
    local_clocks = new_local_clocks(len(body.rest))
    hierarchical_frames(network, near, span, int(10.0 / span), 2, 1, True, local_clocks)
    before = body.positions.copy()
    hierarchical_frames(network, far, span, 1, 2, 1, True, local_clocks)
    assert 0.0 < np.abs(body.positions - before).max() < 0.01 * size


def naive_frame(network, focus, span, updates, last_ring):
    """Advance by a frame with far nodes frozen, node by node: a literal version of the paper.

    The position of each neighbour q at time t is taken as x_q + (t - tau_q) v_q.
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
            assert h == pytest.approx(span / (updates / 2**ring))  # equation 8
            a1 = acceleration(i, t0, xi, vi)
            middle = xi + h / 2 * vi + h * h / 8 * a1
            a2 = acceleration(i, t0 + h / 2, middle, vi + h / 2 * a1)
            a3 = acceleration(i, t0 + h / 2, middle, vi + h / 2 * a2)
            a4 = acceleration(i, t1, xi + h * vi + h * h / 2 * a3, vi + h * a3)
            x[i] = xi + h * vi + h * h / 6 * (a1 + a2 + a3)
            v[i] = vi + h / 6 * (a1 + 2 * a2 + 2 * a3 + a4)
            stamp[i] = t1


@pytest.mark.kernel
@pytest.mark.parametrize("last_ring", [1, 2])
@pytest.mark.parametrize("damping", [CONSTANT, PENALTY, CONSTANT | PENALTY])
def test_a_frame_is_that_of_the_literal_version_of_the_paper(damping, last_ring):
    results = []
    for advance in (naive_frame, None):
        network = block(2, gravity=FREE_FALL, **damping)
        shake(network, 1e-3)
        focus = nearest(network, TOP)
        for _ in range(3):
            if advance:
                advance(network, focus, 2e-3, 4, last_ring)
        if not advance:
            hierarchical_frames(network, focus, 2e-3, 3, 4, last_ring, True)
        results.append((network.body.positions.copy(), network.body.velocities.copy()))
    np.testing.assert_allclose(results[1][0], results[0][0], rtol=0.0, atol=1e-15)
    np.testing.assert_allclose(results[1][1], results[0][1], rtol=0.0, atol=1e-11)


def error(retardation_time, n):
    """Return the error after 40 ms in `n` frames of one ring, every node moved once in each."""
    ends = []
    for advance in ("global", "hierarchical"):
        network = block(3, retardation_time=retardation_time)
        shake(network, 2e-4)
        if advance == "global":
            network.advance(0.04 / 2000, 2000)
        else:
            hierarchical_frames(network, nearest(network, TOP), 0.04 / n, n, 1, 0, False)
        ends.append(network.body.positions.copy())
    return np.abs(ends[1] - ends[0]).max()


@pytest.mark.parametrize(("retardation_time", "least"), [(0.0, 1.8), (2e-4, 0.9)])
def test_the_order_is_two_without_and_one_with_damping_along_springs(retardation_time, least):
    """The linear extrapolation of a neighbour has an error of second order in time."""
    coarse, fine = (error(retardation_time, n) for n in (200, 800))
    assert np.log2(coarse / fine) / 2 > least


def test_a_free_body_conserves_momentum_only_approximately():
    """The forces at the two ends of a spring are evaluated at different times."""
    network = block(3, held=False)
    shake(network, 2e-4)
    masses, v = network.body.masses[:, None], network.body.velocities
    span = 0.25 / frequency_bound(network)
    hierarchical_frames(network, nearest(network, TOP), span, int(0.1 / span), 1, 0, False)
    scale = np.sqrt((masses * v**2).sum() * masses.sum())
    drift = np.linalg.norm((masses * v).sum(axis=0)) / scale
    assert 1e-12 < drift < 0.05


@pytest.mark.parametrize(("damping", "expected"), [(PENALTY, 0.981), (CONSTANT, 0.772)])
def test_the_damping_constant_slows_a_free_fall_and_penalty_damping_does_not(damping, expected):
    """After 0.1 s: g t, or g (1 - exp(-c t)) / c."""
    network = block(2, held=False, gravity=FREE_FALL, **damping)
    span = 0.5 / frequency_bound(network)
    n = int(0.1 / span)
    hierarchical_frames(network, nearest(network, TOP), 0.1 / n, n, 4, 2, False)
    masses, v = network.body.masses, network.body.velocities
    assert -(masses @ v)[2] / masses.sum() == pytest.approx(expected, rel=DRIFT)


@pytest.mark.parametrize("damping", [CONSTANT, PENALTY])
def test_either_damping_by_itself_takes_a_shaken_body_to_rest(damping):
    network = block(3, **damping)
    shake(network, 1e-3)
    span = 0.5 / frequency_bound(network)
    shaken = np.abs(network.body.positions - network.body.rest).max()
    hierarchical_frames(network, nearest(network, TOP), span, int(3.0 / span), 4, 2, False)
    assert np.abs(network.body.positions - network.body.rest).max() < 1e-2 * shaken


def steps(options, needed):
    n, every = ring_steps(options, needed)
    assert all(n % e == 0 for e in every)
    assert all(later % earlier == 0 for earlier, later in itertools.pairwise(every))
    return [n // e for e in every.tolist()]


def test_each_ring_takes_half_the_steps_of_the_one_inside_as_in_the_paper():
    options = Hierarchical(updates=16, rings=4)
    assert steps(options, [0.5] * 6) == [16, 8, 4, 2, 1, 1]


def test_a_ring_that_would_be_unstable_takes_twice_or_four_times_as_many_steps():
    options = Hierarchical(updates=16, rings=4)
    assert steps(options, [9.0, 0.5, 0.5, 0.5, 3.5, 1.5]) == [16, 8, 4, 4, 4, 2]


def test_rings_inside_a_stiff_one_take_no_fewer_steps():
    options = Hierarchical(updates=8, rings=3)
    assert steps(options, [0.5, 0.5, 14.0, 0.5, 0.5]) == [16, 16, 16, 1, 1]


@pytest.mark.parametrize("updates", [12, 24, 96])
def test_updates_need_not_be_a_power_of_two(updates):
    options = Hierarchical(updates=updates, rings=2)
    needed = [0.5, 0.5, 1.1 * updates, 3.5]
    found = steps(options, needed)
    assert all(taken >= least for taken, least in zip(found, needed, strict=True))


def test_after_a_body_was_settled_all_its_nodes_have_moved_even_frozen_ones():
    body = block(2).body
    stepper = HierarchicalStepper(Hierarchical(updates=16, rings=3, far="frozen"), len(body.rest))
    stepper.body_moved(body)
    assert stepper.moved.n_nodes == body.n_nodes
