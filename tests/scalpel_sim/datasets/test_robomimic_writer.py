import json

import h5py
import numpy as np
import pytest

from scalpel_sim.datasets.robomimic_writer import FILE, RobomimicWriter
from tests.scalpel_sim.datasets.drawn_demonstrations import LAYOUT, DrawnDemonstration


@pytest.fixture
def episodes():
    # The second one is longer than what is written at once.
    return [DrawnDemonstration(seed, n) for seed, n in enumerate((5, 150, 3))]


@pytest.fixture
def file(tmp_path, episodes):
    writer = RobomimicWriter(tmp_path, LAYOUT)
    for episode in episodes:
        writer.add(episode)
    writer.finish()
    with h5py.File(tmp_path / FILE) as file:
        yield file


def test_each_step_has_what_was_observed_before_and_after_it(file, episodes):
    for i, episode in enumerate(episodes):
        demo, n = file[f"data/demo_{i}"], len(episode.actions)
        assert demo.attrs["num_samples"] == n
        for name in ("blade", "wrench", "points:4"):
            of = np.array([seen.observations[name].ravel() for seen in episode.seen])
            assert np.array_equal(demo["obs"][name.partition(":")[0]], of[:-1])
            assert np.array_equal(demo["next_obs"][name.partition(":")[0]], of[1:])
        images = np.array([seen.images["endoscope"] for seen in episode.seen])
        assert np.array_equal(demo["obs/endoscope_image"], images[:-1])
        assert np.array_equal(demo["next_obs/endoscope_image"], images[1:])


def test_each_step_has_its_action_reward_and_the_poses_of_the_hands(file, episodes):
    for i, episode in enumerate(episodes):
        demo = file[f"data/demo_{i}"]
        assert np.array_equal(demo["actions"], episode.actions)
        assert np.array_equal(demo["rewards"], episode.rewards)
        assert np.array_equal(demo["states"], [seen.hands for seen in episode.seen[:-1]])
        assert np.flatnonzero(demo["dones"]).tolist() == [len(episode.actions) - 1]


def test_the_file_says_of_which_scene_it_is(file):
    told = json.loads(file["data"].attrs["env_args"])
    assert told["env_kwargs"]["scene"] == DrawnDemonstration.scene_text
    assert file["data"].attrs["total"] == 158


def test_one_of_ten_episodes_validates_and_none_of_them_trains(tmp_path):
    writer = RobomimicWriter(tmp_path, LAYOUT)
    for seed in range(21):
        writer.add(DrawnDemonstration(seed, 2))
    writer.finish()
    with h5py.File(tmp_path / FILE) as file:
        train, valid = (set(file[f"mask/{part}"].asstr()[:]) for part in ("train", "valid"))
    assert valid == {"demo_9", "demo_19"}
    assert train == {f"demo_{i}" for i in range(21)} - valid


def test_of_few_episodes_the_last_one_validates(file):
    assert file["mask/valid"].asstr()[:].tolist() == ["demo_2"]
    assert file["mask/train"].asstr()[:].tolist() == ["demo_0", "demo_1"]


def test_an_episode_that_fails_is_left_out(tmp_path):
    writer = RobomimicWriter(tmp_path, LAYOUT)
    writer.add(DrawnDemonstration(0, 3))
    with pytest.raises(RuntimeError, match="the tissue tore"):
        writer.add(DrawnDemonstration(1, 90, RuntimeError("the tissue tore")))
    writer.finish()
    with h5py.File(tmp_path / FILE) as file:
        assert list(file["data"]) == ["demo_0"]
        assert file["data"].attrs["total"] == 3
