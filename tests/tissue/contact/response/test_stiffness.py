"""Mass splitting bounds the stiffness of all contacts together."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.tissue.contact.lists import (
    ADDED,
    HIGHEST,
    NODE_SIZE,
    random_contacts,
    stiffened,
)
from tissue.contact.response.forces import end_contact_substep
from tissue.contact.response.stiffness import (
    fade,
    limit_stiffness,
    new_limits,
    recover,
    split_masses,
)

pytestmark = pytest.mark.kernel


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 10_000), n=st.integers(1, 60))
def test_contacts_together_are_never_stiffer_than_what_their_nodes_may_bear(seed, n):
    body, forces, bearable = stiffened(seed, n)
    weights = np.zeros((n, body.n_nodes))
    for c in range(n):
        np.add.at(weights[c], forces.node[c], forces.weight[c])
    stiffness = weights.T @ (forces.stiffness[:n, None] * weights)
    scaled = stiffness / np.sqrt(bearable[:, None] * bearable[None, :])
    assert np.linalg.eigvalsh(scaled).max() <= 1.0 + 1e-12


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 10_000), n=st.integers(1, 60))
def test_contacts_together_stop_no_motion_faster_than_a_step_allows(seed, n):
    """Also where their nodes may bear far more than contact adds: next to stiffer slivers."""
    body, forces, _ = stiffened(seed, n)
    weights = np.zeros((n, body.n_nodes))
    for c in range(n):
        np.add.at(weights[c], forces.node[c], forces.weight[c])
    damping = forces.stiffness[:n] * forces.damping_time[:n]
    assert (forces.damping_time[:n] <= forces.retardation_time).all()
    rates = weights.T @ (damping[:, None] * weights)
    rates /= np.sqrt(body.masses[:, None] * body.masses[None, :])
    assert np.linalg.eigvalsh(rates).max() <= 0.45 * np.sqrt(HIGHEST + ADDED) * (1.0 + 1e-12)


def test_a_single_contact_of_one_node_bears_all_that_its_mass_allows():
    body, forces = random_contacts(0, 1)
    forces.node[0], forces.weight[0] = 3, [1.0, 0.0, 0.0, 0.0]
    limits = new_limits(NODE_SIZE, ADDED)
    split_masses(forces, limits, body, np.zeros(body.n_nodes), np.zeros(body.n_nodes))
    assert forces.stiffness[0] == pytest.approx(body.masses[3] * ADDED)


@pytest.mark.parametrize("seed", range(5))
def test_a_contact_keeps_its_force_where_the_stiffness_changes_and_a_new_one_has_none(seed):
    body, forces, _ = stiffened(seed)
    scratch = np.zeros_like(body.positions)
    forces.offset[:20] = 0.02e-3
    end_contact_substep(forces, body.positions, body.velocities, scratch)
    before = forces.push[:20].copy()
    assert (before > 0.0).any()
    body.masses[:] *= 2.0
    limits = new_limits(NODE_SIZE, ADDED)
    split_masses(forces, limits, body, np.zeros(body.n_nodes), np.zeros(body.n_nodes))
    end_contact_substep(forces, body.positions, body.velocities, scratch)
    free = forces.largest_depth[:20] * forces.stiffness[:20] > before
    np.testing.assert_allclose(forces.push[:20][free], before[free], rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("factor", [0.3, 3.0])
def test_springs_hold_no_more_energy_than_before_where_the_stiffness_changes(seed, factor):
    body, forces, _ = stiffened(seed)
    scratch = np.zeros_like(body.positions)
    forces.offset[:20] = 0.02e-3
    end_contact_substep(forces, body.positions, body.velocities, scratch)
    before = forces.stored
    body.masses[:] *= factor
    limits = new_limits(NODE_SIZE, ADDED)
    split_masses(forces, limits, body, np.zeros(body.n_nodes), np.zeros(body.n_nodes))
    end_contact_substep(forces, body.positions, body.velocities, scratch)
    assert 0.0 < forces.stored < (1.0 + 1e-9) * before


def test_an_overlap_without_force_comes_out_at_the_speed_of_recovery():
    body, forces, _ = stiffened(1)
    forces.push[:20] = 0.0
    forces.offset[:20] = -1e-3
    forces.height[:20] = 1.0
    recover(forces, new_limits(NODE_SIZE, ADDED), body, np.zeros(body.n_nodes), 1e-3)
    np.testing.assert_allclose(forces.offset[:20], -1e-3 + NODE_SIZE * 1e-3)


def test_an_overlap_comes_out_by_half_a_node_size_at_most_between_two_incisions():
    body, forces, _ = stiffened(1, 1)
    limits, recovered = new_limits(NODE_SIZE, ADDED), np.zeros(body.n_nodes)
    forces.offset[0] = -NODE_SIZE
    for _ in range(2000):
        forces.push[0] = 1.0
        recover(forces, limits, body, recovered, 1e-3)
    assert forces.offset[0] == pytest.approx(-0.5 * NODE_SIZE)
    recovered[:] = 0.0
    forces.push[0] = 1.0
    recover(forces, limits, body, recovered, 1e-3)
    assert forces.offset[0] > -0.5 * NODE_SIZE


@pytest.mark.parametrize("seed", range(5))
def test_what_was_given_up_presses_less_however_its_nodes_move_and_ends(seed):
    body, forces, _ = stiffened(seed)
    limits, scratch = new_limits(NODE_SIZE, ADDED), np.zeros_like(body.positions)
    random = np.random.default_rng(seed)
    forces.offset[:20] = 1e-3
    forces.n_fading = 20
    end_contact_substep(forces, body.positions, body.velocities, scratch)
    before = forces.push[:20] / forces.stiffness[:20]
    most, n = before.copy(), 0
    assert before.max() > 5e-5
    while not fade(forces, limits, body, 1e-3) or forces.push[:20].any():
        body.positions += 1e-5 * random.normal(size=body.positions.shape)
        end_contact_substep(forces, body.positions, body.velocities, scratch)
        depth = forces.push[:20] / forces.stiffness[:20]
        most, n = np.maximum(most - 1e-3 * NODE_SIZE, 0.0), n + 1
        assert (depth <= most + 1e-12).all()
        most = np.minimum(most, depth)
    assert n <= np.ceil(before.max() / (1e-3 * NODE_SIZE)) + 1


@pytest.mark.parametrize(("room", "share"), [(10.0, 1.0), (0.5, 0.5), (0.1, 1.0)])
def test_contact_is_softer_by_a_part_where_that_saves_a_step_and_not_where_it_takes_more(
    room, share
):
    limits = new_limits(NODE_SIZE, ADDED)
    limit_stiffness(limits, 4e7, room * ADDED)
    assert limits.added == pytest.approx(share * ADDED)
