"""An expert's demonstration is what an environment shows to a policy that does the same."""

import numpy as np
import pytest

from scalpel_sim.datasets.expert_demonstration import ExpertDemonstration, ExpertTask
from scalpel_sim.datasets.taking import DatasetRequest
from scalpel_sim.errors import Interrupted, UsageError
from scalpel_sim.learning import Episode
from scalpel_sim.scene.scene import changed
from tests.scalpel_sim.datasets.recorded_demonstrations import slab_task

__all__ = ["slab_task"]

SEED = 3

NO_IMAGES = DatasetRequest(cameras=())


@pytest.fixture(scope="module")
def task(slab_task):
    return ExpertTask(slab_task, NO_IMAGES)


@pytest.fixture(scope="module")
def done(task):
    demonstration = ExpertDemonstration(task, SEED)
    return demonstration, list(demonstration.transitions())


def test_actions_of_an_expert_do_the_same_in_an_episode_of_the_same_seed(done, slab_task):
    _, steps = done
    episode = Episode(slab_task)
    episode.reset(np.random.default_rng(SEED))
    for step in steps:
        for name, seen in step.before.observations.items():
            assert seen == pytest.approx(episode.observation[name], abs=1e-5)
        outcome = episode.act(step.action)
    assert outcome.terminated and episode.is_success
    assert sum(step.reward for step in steps) > 14.0  # 10 for the plan, 5 for success


def test_an_expert_ends_with_success_and_says_by_which_seed_and_numbers(done, slab_task):
    demonstration, steps = done
    told = demonstration.provenance()
    assert [step.is_done for step in steps] == [False] * (len(steps) - 1) + [True]
    assert steps[-1].is_success
    assert (told["seed"], told["steps"], told["success"]) == (SEED, len(steps), True)
    assert 'kind = "traced"' in demonstration.scene_text
    episode = Episode(slab_task)
    episode.reset(np.random.default_rng(SEED))
    assert 0.8 < episode.drawn["material.toughness"] < 1.2
    assert told["variation"] == episode.drawn


def test_a_demonstration_is_the_same_again(task, done):
    again = list(ExpertDemonstration(task, SEED).transitions())
    for one, other in zip(done[1], again, strict=True):
        assert np.array_equal(one.action, other.action)
        for name, seen in one.after.observations.items():
            assert np.array_equal(seen, other.after.observations[name])


def test_another_rate_has_other_control_steps(slab_task, done):
    task = ExpertTask(slab_task, NO_IMAGES._replace(fps=25))
    steps = list(ExpertDemonstration(task, SEED).transitions())
    assert steps[1].before.hands[0] - steps[0].before.hands[0] == pytest.approx(0.04)
    assert steps[-1].is_success
    with pytest.raises(UsageError, match="whole number of milliseconds"):
        ExpertTask(slab_task, NO_IMAGES._replace(fps=30))


def test_a_demonstration_of_an_expert_can_be_interrupted(slab_task):
    task = ExpertTask(slab_task, NO_IMAGES, stop_reason=lambda: "interrupted by SIGINT")
    with pytest.raises(Interrupted, match="SIGINT"):
        next(ExpertDemonstration(task, SEED).transitions())


def test_a_scene_without_a_task_has_no_expert(slab_task):
    task = ExpertTask(changed(slab_task, task=None, observe=None), NO_IMAGES)
    with pytest.raises(UsageError, match=r"has no \[task\]"):
        ExpertDemonstration(task, SEED).layout()
