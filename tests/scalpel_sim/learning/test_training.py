"""The examples that train do so, and what they train with finds nothing wrong with the tasks."""

import os
import re
import runpy
import subprocess
import sys
import warnings
from pathlib import Path

import gymnasium
import pytest

from scalpel_sim.learning.registration import id_of
from scalpel_sim.scene.observe_table import CameraTable, ObserveTable
from scalpel_sim.scene.read import TASK_SCENES, scene_called
from tests.support.egl import needs_renderer

ROOT = Path(__file__).parents[3]
FOLDER = ROOT / "docs" / "examples" / "learning"


def cameras_of(task: str) -> tuple[CameraTable, ...]:
    """Return the cameras whose images a task shows."""
    return (scene_called(task).observe or ObserveTable()).cameras


FORMS = [
    (task, obs) for task in TASK_SCENES for obs in ("flat", "all" if cameras_of(task) else "state")
]
"""Forms in which each task is checked; `all` is state and images."""


@pytest.fixture
def trained(tmp_path):
    """Run an example in a process and a folder of its own; return what it printed."""
    why = "the examples that train need torch: pip install '.[examples]'"
    pytest.importorskip("torch", reason=why)

    def run(name: str, *options: str) -> str:
        done = subprocess.run(
            [sys.executable, str(FOLDER / name), *options, "--evaluate", "1"],
            cwd=tmp_path,
            capture_output=True,
            text=True,
            timeout=300,
            env=os.environ | {"PYTHONPATH": str(ROOT)},
        )
        assert done.returncode == 0, done.stderr
        return done.stdout

    return run


def interval(printed: str) -> tuple[int, ...]:
    """Return successes, episodes, and the ends of the interval [%]."""
    found = re.search(r"(\d+) of (\d+) episodes succeed: (\d+) to (\d+) %", printed)
    return tuple(map(int, found.groups()))


def test_ppo_trains_and_saves_its_policy(trained, tmp_path):
    printed = trained("ppo.py", "--steps", "640", "--round", "128", "--envs", "4")
    assert len(re.findall(r"^ *\d+ .* %", printed, re.MULTILINE)) >= 1
    assert interval(printed) in ((0, 1, 0, 79), (1, 1, 21, 100))
    assert (tmp_path / "ppo.pt").stat().st_size > 10_000


def test_ppo_goes_on_from_a_clone(trained):
    options = ("--demonstrations", "1", "--steps", "256", "--round", "64", "--envs", "2")
    printed = trained("ppo.py", *options)
    assert re.match(r"the clone: [01] of 1$", printed, re.MULTILINE)
    assert interval(printed)[1] == 1


def test_stable_baselines_trains_and_saves_its_policy(trained, tmp_path):
    pytest.importorskip("stable_baselines3", reason="pip install '.[examples]'")
    printed = trained("sb3.py", "--steps", "600", "--round", "600", "--envs", "2")
    assert re.search(r"600 steps, .*: reward -?[\d.]+, success \d+ %", printed)
    assert interval(printed)[1] == 1
    assert (tmp_path / "sb3.zip").stat().st_size > 10_000


def test_a_clone_comes_nearer_to_the_expert(trained, tmp_path):
    printed = trained("clone.py", "--episodes", "2", "--steps", "200")
    errors = [float(each) for each in re.findall(r"error of an action ([\d.]+)", printed)]
    assert len(errors) == 10 and errors[-1] < 0.5 * errors[0]
    assert interval(printed)[1] == 1
    assert (tmp_path / "clone.pt").stat().st_size > 10_000


@needs_renderer
def test_a_clone_learns_from_images_in_the_process_that_draws_them(trained):
    task = ("--task", "scalpel_sim/Retract-v0", "--obs", "images")
    printed = trained("clone.py", *task, "--episodes", "1", "--steps", "10")
    errors = [float(each) for each in re.findall(r"error of an action ([\d.]+)", printed)]
    assert len(errors) == 10 and errors[-1] < errors[0]


@needs_renderer
@pytest.mark.parametrize(("task", "obs"), FORMS)
def test_the_checker_of_stable_baselines_finds_nothing(task, obs):
    checker = pytest.importorskip(
        "stable_baselines3.common.env_checker", reason="pip install '.[examples]'"
    )
    env = gymnasium.make(id_of(task), obs=obs).unwrapped
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        checker.check_env(env)
    env.close()


@needs_renderer
def test_lerobot_is_shown_instruments_forces_and_cameras_by_its_names():
    hub = runpy.run_path(str(FOLDER / "env_hub.py"))
    hub["make_env"].__globals__["TASKS"] = ("scalpel_sim/Incise-v0",)
    env = hub["make_env"](n_envs=1)["scalpel_sim"][0]
    observed, _ = env.reset(seed=[3], options={"lerobot_new_rollout": True})
    after, *_ = env.step(env.action_space.sample())
    assert env.observation_space.contains(after)
    assert set(observed) == {"agent_pos", "pixels", "wrench"}
    assert env.call("_max_episode_steps")[0] > 100 and env.call("task_description")[0]
    env.close()
