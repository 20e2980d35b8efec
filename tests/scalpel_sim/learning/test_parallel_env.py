"""Each hand is an agent of PettingZoo: all see the same, and together they act as one policy."""

import warnings

import gymnasium
import numpy as np
import pytest
from pettingzoo.test import parallel_api_test

from scalpel_sim.errors import UsageError
from scalpel_sim.learning import TissueEnv, parallel_env
from tests.scalpel_sim.learning.little_task import little_task

__all__ = ["little_task"]


def test_the_checker_of_pettingzoo_finds_nothing(little_task):
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        parallel_api_test(parallel_env(little_task), num_cycles=60)
    assert [str(each.message) for each in told] == []


def test_agents_do_together_what_one_policy_does(little_task):
    env, one = parallel_env(little_task, obs="flat"), TissueEnv(little_task, "flat")
    observed, _ = env.reset(seed=4)
    expected, _ = one.reset(seed=4)
    assert env.agents == ["blade", "left"]
    rng = np.random.default_rng(0)
    for _ in range(10):
        actions = {
            name: rng.uniform(-1.0, 1.0, len(env.action_space(name).low)) for name in observed
        }
        observed, rewards, *_ = env.step(actions)
        expected, reward, *_ = one.step(np.concatenate([actions["blade"], actions["left"]]))
        assert set(rewards.values()) == {reward}
        for each in observed.values():
            assert np.array_equal(each, expected)


def test_no_agent_is_left_when_an_episode_has_ended(little_task):
    env = parallel_env(little_task)
    env.reset(seed=0)
    idle = {name: np.zeros(env.action_space(name).shape) for name in env.agents}
    while env.agents:
        _, _, _, truncations, _ = env.step(idle)
    assert truncations == {"blade": True, "left": True}


def test_wrong_arguments_are_told(little_task):
    with pytest.raises(gymnasium.error.NameNotFound, match="Did you mean: `Incise`"):
        parallel_env("scalpel_sim/Incize-v0")
    env = parallel_env(little_task)
    idle = {name: np.zeros(space.shape) for name, space in env.action_spaces.items()}
    with pytest.raises(UsageError, match=r"no episode goes on: begin one by reset\(\)"):
        env.step(idle)
    env.reset(seed=0)
    for wrong, told in (
        ({"blade": idle["blade"]}, "actions have none of 'left', only blade"),
        ([0.0], r"actions have none of 'blade', only \[0.0\]"),
        (idle | {"left": np.zeros(6)}, "an action of 'left' is 7 finite numbers"),
    ):
        with pytest.raises(UsageError, match=told):
            env.step(wrong)
