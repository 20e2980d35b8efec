"""An episode does what actions say, pays what the task says, and begins again to the bit."""

import numpy as np
import pytest
from msgspec import structs

from scalpel_sim import SCENES
from scalpel_sim.errors import UsageError
from scalpel_sim.learning import Episode, Expert
from scalpel_sim.scene.act_table import ActTable
from tests.scalpel_sim.learning.little_task import little_task

__all__ = ["little_task"]

SEED = 5


@pytest.fixture(scope="module")
def episode(little_task):
    return Episode(little_task)


def begin(episode):
    return episode.reset(np.random.default_rng(SEED))


def follow_script(episode, most=400):
    """Do the script of the scene by actions; return the rewards and the last outcome."""
    begin(episode)
    expert, rewards = Expert(episode), []
    for _ in range(most):
        outcome = episode.act(expert.action())
        rewards.append(outcome.reward)
        if outcome.terminated or outcome.truncated:
            break
    return rewards, outcome


def test_the_numbers_of_an_action_have_names(episode):
    axes = [f"{what}_{axis}" for what in ("move", "turn") for axis in "xyz"]
    blade, left = ([f"{hand}_{each}" for each in axes] for hand in ("blade", "left"))
    assert list(episode.action_names) == [*blade, *left, "left_jaws"]


def test_an_action_of_one_moves_the_blade_by_speed_times_step_along_its_own_axes(episode):
    begin(episode)
    before, axes = episode.hand.blade.pose.middle.copy(), episode.hand.blade.axes.copy()
    action = np.zeros(len(episode.action_names))
    action[1] = -1.0  # back along the edge
    episode.act(action)
    act = episode.act_table
    moved = episode.hand.blade.pose.middle - before
    assert np.allclose(moved, -act.speed * act.step * axes[1], atol=1e-12)


def test_jaws_open_and_close(episode):
    begin(episode)
    grasper = episode.simulation.graspers[0].grasper
    action = np.zeros(len(episode.action_names))
    openings = []
    for way in (-1.0, 0.0, 1.0):
        action[-1] = way
        for _ in range(40):
            episode.act(action)
        openings.append(grasper.opening)
    assert openings[0] == openings[1] < 0.001 < 0.009 < openings[2]


def test_the_script_by_actions_succeeds_and_the_rewards_add_up_to_the_weighted_terms(episode):
    rewards, outcome = follow_script(episode)
    assert episode.is_success and outcome.terminated and not outcome.truncated
    terms, weights = episode.score.terms(), episode.task.reward
    total = weights.covered * terms["covered"] + weights.off_plan * terms["off_plan"]
    assert sum(rewards) == pytest.approx(total + weights.success)


def test_the_same_actions_give_the_same_bytes_after_a_reset(episode):
    def observed():
        rng, found = np.random.default_rng(1), [begin(episode)]
        for _ in range(30):
            action = rng.uniform(-1.0, 1.0, len(episode.action_names))
            episode.act(action)
            found.append(episode.observation)
        return [each.tobytes() for row in found for each in row.values()]

    assert observed() == observed()


def test_arms_and_instruments_without_arms_do_the_same(little_task, episode):
    _, floating = follow_script(episode)
    cut = episode.score.terms()["covered"]
    full = Episode(little_task, "full")
    _, outcome = follow_script(full)
    assert full.is_success and outcome.terminated == floating.terminated
    assert full.score.terms()["covered"] == pytest.approx(cut, abs=0.05)


def test_doing_nothing_ends_when_the_time_is_over_without_success(episode):
    begin(episode)
    for _ in range(150):
        outcome = episode.act(np.zeros(len(episode.action_names)))
        assert outcome.reward == 0.0
        if outcome.truncated:
            break
    assert episode.n_steps * episode.act_table.step == pytest.approx(episode.task.seconds)
    assert not episode.is_success and not outcome.terminated


def test_what_is_observed_is_within_its_bounds_and_where_things_are(episode):
    begin(episode)
    rng = np.random.default_rng(2)
    for _ in range(20):
        episode.act(rng.uniform(-1.0, 1.0, len(episode.action_names)))
        for name, shown in episode.shapes.items():
            array = episode.observation[name]
            assert array.dtype == np.float32 and array.shape == shown.low.shape
            assert np.isfinite(array).all()
            assert (array >= shown.low.astype("f4")).all()
            assert (array <= shown.high.astype("f4")).all()
    simulation = episode.simulation
    tip = simulation.frame.segment_to_tissue(simulation.blade.segment).tip
    assert np.allclose(episode.observation["blade"][:3], tip, atol=1e-7)
    pads = simulation.frame.points_to_tissue(simulation.graspers[0].grasper.pads.centre)
    assert np.allclose(episode.observation["left"][:3], pads, atol=1e-7)


def test_the_plan_that_is_shown_gets_cut_and_the_tip_is_as_deep_as_it_is(episode):
    observed = begin(episode)
    assert (observed["target"][:, 3] == 0.0).all()
    ends = observed["target"][[0, -1], :2]
    assert np.allclose(ends, episode.task.line, atol=1e-3)
    assert observed["depth"][0] < 0.0  # above the skin
    follow_script(episode)
    shown = episode.observation
    assert shown["target"][:, 3].mean() == pytest.approx(episode.score.terms()["covered"], abs=0.05)
    assert shown["depth"][0] == pytest.approx(episode.task.depth, abs=1.5e-3)


def test_a_simulation_that_fails_ends_the_episode_and_the_next_one_goes_on(episode):
    expected = [each.tobytes() for each in begin(episode).values()]
    episode.simulation.link.tissue._stages.model.body.velocities[:] = np.nan
    outcome = episode.act(np.zeros(len(episode.action_names)))
    assert outcome.truncated and not outcome.terminated and outcome.fault
    with pytest.raises(ValueError, match=r"call reset\(\)"):
        episode.act(np.zeros(len(episode.action_names)))
    assert [each.tobytes() for each in begin(episode).values()] == expected
    assert episode.act(np.zeros(len(episode.action_names))).fault is None


def test_a_wrong_action_and_a_scene_without_a_task_are_refused(episode):
    begin(episode)
    for wrong in (np.zeros(3), np.full(13, np.nan), None, "up", ["up"] * 13, [[1], [1, 2]]):
        with pytest.raises(ValueError, match=r"13 finite numbers"):
            episode.act(wrong)
    assert episode.act([0] * 13).fault is None
    with pytest.raises(UsageError, match=r"'slab' has no \[task\]"):
        Episode(SCENES["slab"])


def test_limits_are_those_of_the_table_however_large(little_task, caplog):
    fast = Episode(structs.replace(little_task, act=ActTable(speed=0.3, turn=8.0, step=0.05)))
    begin(fast)
    pose = fast.hand.blade.pose
    before, rotation = pose.middle.copy(), pose.rotation.copy()
    action = np.zeros(len(fast.action_names))
    action[1], action[5], action[-1] = -1.0, 1.0, -1.0
    fast.act(action)
    assert np.linalg.norm(pose.middle - before) == pytest.approx(0.3 * 0.05)
    assert 2.0 * np.arccos(abs(rotation @ pose.rotation)) == pytest.approx(8.0 * 0.05)
    fast.act(action)  # the jaws close on nothing, which only a person is told
    assert not caplog.records
