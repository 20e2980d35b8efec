"""The expert of a task succeeds; random actions, none, and three adversaries gain nothing."""

import numpy as np
import pytest

from scalpel_sim.learning import Episode
from scalpel_sim.learning.rollout import POLICIES, run_episode
from tests.scalpel_sim.learning.little_task import little_task

__all__ = ["little_task"]

EDGE, ACROSS, TURN = 1, 0, 4
"""Numbers of an action: along the edge, across the blade, and about the edge."""


@pytest.fixture(scope="module")
def episode(little_task):
    return Episode(little_task)


@pytest.fixture(scope="module")
def reward_of_expert(episode):
    end = run_episode(episode, POLICIES["expert"], 0)
    assert end.is_success and end.fault is None
    return end.reward


def pressing(episode, rng):
    """Turn the blade across the plan, so that its face is to the line, and press it down."""

    def act():
        action = np.zeros(len(episode.action_names))
        turns = episode.n_steps < np.ceil(0.5 * np.pi / (1.5 * 0.02))
        action[TURN if turns else EDGE] = 1.0
        return action

    return act


def shaking(episode, rng):
    """Go down to the skin, and shake the blade across the plan."""

    def act():
        action = np.zeros(len(episode.action_names))
        if episode.observation["depth"][0] < 0.001:
            action[EDGE] = 1.0
        else:
            action[ACROSS] = 1.0 if episode.n_steps % 2 else -1.0
        return action

    return act


def tearing(episode, rng):
    """Push the blade into the tissue, and drag it sideways as far as it goes."""

    def act():
        action = np.zeros(len(episode.action_names))
        action[EDGE if episode.observation["depth"][0] < 0.004 else ACROSS] = 1.0
        return action

    return act


@pytest.mark.parametrize(
    "policy", [POLICIES["random"], POLICIES["idle"], pressing, shaking, tearing]
)
def test_nothing_is_gained_without_cutting_along_the_plan(episode, reward_of_expert, policy):
    for seed in range(2):
        end = run_episode(episode, policy, seed)
        assert not end.is_success and end.fault is None
        assert end.reward <= 0.1 * reward_of_expert


def test_a_rollout_is_that_of_its_seed(episode):
    first, again, other = (run_episode(episode, POLICIES["random"], seed) for seed in (1, 1, 2))
    assert first == again != other
