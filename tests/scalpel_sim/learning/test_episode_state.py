"""An episode begins at any state, and what follows is to the bit what followed then."""

from dataclasses import dataclass

import numpy as np
import pytest
from msgspec.structs import replace

from scalpel_sim.errors import UsageError
from scalpel_sim.learning import Episode, EpisodeState, Expert, TissueEnv
from scalpel_sim.scene.observe_table import SensorTable
from scalpel_sim.scene.vary_table import VaryTable
from tests.scalpel_sim.learning.little_task import little_task
from tissue import StateError

__all__ = ["little_task"]


@pytest.fixture(scope="module")
def noisy_task(little_task):
    """The little task, whose sensor has noise and a delay, and whose gel and line vary."""
    sensor = SensorTable(force=0.01, torque=1e-4, delay=0.05)
    rows = (("material.toughness", (0.7, 1.2)), ("task.line.across", (-2e-3, 2e-3)))
    vary = tuple(VaryTable(what=what, range=ends) for what, ends in rows)
    observe = replace(little_task.observe, sensor=sensor)
    return replace(little_task, observe=observe, vary=vary)


@dataclass
class Halves:
    """An episode that was saved in the middle of a cut, and what came after that."""

    episode: Episode
    actions: list
    state: EpisodeState
    after: list


def went_on(episode, actions):
    """Do actions; return all bytes that came of it."""
    found = []
    for action in actions:
        outcome = episode.act(action)
        observed = [each.tobytes() for each in episode.observation.values()]
        found.append((*outcome, episode.is_success, *observed))
    return found


@pytest.fixture(scope="module")
def halves(noisy_task):
    episode = Episode(noisy_task)
    episode.reset(np.random.default_rng(4))
    expert, rng, actions = Expert(episode), np.random.default_rng(5), []
    while not 0.3 < episode.score.terms()["covered"] < 0.9:
        episode.act(expert.action())
    state = episode.save_state()
    for _ in range(25):
        action = expert.action() + rng.uniform(-0.2, 0.2, len(episode.action_names))
        action[-1] = -1.0  # the jaws close meanwhile
        actions.append(action)
        episode.act(action)
    episode.load_state(state)
    return Halves(episode, actions, state, went_on(episode, actions))


def test_an_episode_goes_on_from_a_state_as_it_went_on_then(halves):
    for _ in range(2):
        halves.episode.reset(np.random.default_rng(6))
        halves.episode.act(halves.actions[0])
        halves.episode.load_state(halves.state)
        assert went_on(halves.episode, halves.actions) == halves.after


def test_another_process_would_go_on_from_its_bytes_in_the_same_way(halves, noisy_task):
    data = halves.state.to_bytes()
    other = Episode(noisy_task)
    other.load_state(EpisodeState.from_bytes(data))
    assert went_on(other, halves.actions) == halves.after
    first = other.reset(other.rng)
    expected = halves.episode.reset(halves.episode.rng)
    assert [a.tobytes() for a in first.values()] == [a.tobytes() for a in expected.values()]


def test_an_environment_begins_at_a_state_and_ends_a_fault_by_it(halves, noisy_task):
    env, data = TissueEnv(noisy_task), halves.state.to_bytes()

    def rewards():
        return [env.step(action)[1] for action in halves.actions]

    env.reset(options={"state": data})
    expected = [each[0] for each in halves.after]
    assert rewards() == expected
    env.reset(options={"state": data})
    env.episode.simulation.link.tissue._stages.model.body.velocities[:] = np.nan
    _, _, _, truncated, info = env.step(halves.actions[0])
    assert truncated and info["fault"]
    with pytest.raises(StateError, match=r"has failed in this episode: call reset\(\)"):
        env.save_state()
    env.reset(options={"state": data})
    assert rewards() == expected
    drawn = [env.reset(seed=8, options={"state": data}), env.step(halves.actions[0])]
    again = [env.reset(seed=8, options={"state": data}), env.step(halves.actions[0])]
    assert np.array_equal(drawn[1][0]["wrench"], again[1][0]["wrench"])
    env.reset(seed=9, options={"state": data})
    assert not np.array_equal(env.step(halves.actions[0])[0]["wrench"], again[1][0]["wrench"])


def test_a_state_has_its_own_variation(halves, noisy_task):
    env, data = TissueEnv(noisy_task), halves.state.to_bytes()
    _, info = env.reset(options={"state": data})
    assert info["variation"] == halves.state.content["variation"]
    with pytest.raises(UsageError, match="a state has its own"):
        env.reset(options={"state": data, "variation": info["variation"]})


def test_a_state_of_another_task_and_what_is_no_state_are_refused(halves, noisy_task, little_task):
    env, data = TissueEnv(noisy_task), halves.state.to_bytes()
    before = env.episode.save_state().content
    other = replace(noisy_task, task=replace(noisy_task.task, seconds=2.0))
    whole = Episode(noisy_task, "full")
    for bad, told in (
        (Episode(other).save_state().to_bytes(), r"of another task: what differs is \[task\]"),
        (whole.save_state().to_bytes(), "of another task: what differs is arm"),
        (env.episode.simulation.save_state().to_bytes(), "of a simulation and of no episode"),
        (data[:1000], "are no state"),
        (data.decode("latin1"), "a state is bytes of .*, not str"),
    ):
        with pytest.raises(StateError, match=told):
            env.reset(options={"state": bad})
    assert env.episode.save_state().content == before
