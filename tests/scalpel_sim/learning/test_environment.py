"""Environments of Gymnasium pass its checker without a warning, and are registered."""

import subprocess
import sys
import time
import urllib.request
import warnings

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import scalpel_sim.learning
from scalpel_sim.errors import UsageError
from scalpel_sim.learning import Expert, TissueEnv
from scalpel_sim.learning.registration import OWN_SCENE, id_of
from scalpel_sim.scene.read import TASK_SCENES
from tests.scalpel_sim.learning.little_task import little_task

__all__ = ["little_task"]

pytestmark = pytest.mark.filterwarnings("error:.*WARN:UserWarning")

FIVE_LINES = """
import gymnasium, scalpel_sim.learning
env = gymnasium.make("scalpel_sim/Incise-v0")
observation, info = env.reset(seed=0)
observation, reward, terminated, truncated, info = env.step(env.action_space.sample())
print(sorted(observation), reward, terminated, truncated, sorted(info["score"])[:2])
"""


@pytest.mark.parametrize("obs", ["state", "flat"])
def test_the_checker_of_gymnasium_finds_nothing(little_task, obs):
    env = gymnasium.make(OWN_SCENE, scene=little_task, obs=obs)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(env.unwrapped)


def test_the_checker_finds_nothing_where_images_are_shown(little_task):
    env = gymnasium.make(OWN_SCENE, scene=little_task, obs="all", render_mode="rgb_array")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(env.unwrapped)
    observed, _ = env.reset(seed=0)
    assert observed["overview_rgb"].shape == (36, 48, 3)
    assert observed["overview_segmentation"].shape == (36, 48, 1)
    assert len(np.unique(observed["overview_rgb"])) > 20
    assert env.render().shape == (360, 480, 3)
    env.close()
    again, *_ = env.unwrapped.step(np.zeros(13))  # as a first step without a reset, it draws
    assert np.array_equal(again["overview_rgb"], observed["overview_rgb"])
    env.close()


def test_for_a_human_the_live_page_shows_the_episode_no_faster_than_it_is(little_task):
    env = gymnasium.make(OWN_SCENE, scene=little_task, render_mode="human")
    begin = time.monotonic()
    env.reset(seed=0)
    for _ in range(20):
        env.step(env.action_space.sample())
    assert time.monotonic() - begin >= 19 * 0.02
    assert env.render() is None
    url = env.unwrapped.page_url
    with urllib.request.urlopen(url, timeout=30) as page:
        assert b"little" in page.read()
    env.close()
    with pytest.raises(OSError):
        urllib.request.urlopen(url, timeout=5)


def test_each_task_has_an_id_with_its_version():
    assert id_of("incise_taut-v0") == "scalpel_sim/InciseTaut-v0"
    for task in TASK_SCENES:
        assert gymnasium.spec(id_of(task)).kwargs == {"scene": task}


def test_five_lines_run_a_step_of_an_episode():
    done = subprocess.run(
        [sys.executable, "-c", FIVE_LINES], capture_output=True, text=True, timeout=300
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("['blade', 'depth', 'target', 'wrench'] ")


def test_an_expert_succeeds_and_info_says_how(little_task):
    env = TissueEnv(little_task, "flat")
    env.reset(seed=3)
    expert = Expert(env.episode)
    ended = False
    while not ended:
        _, _, ended, truncated, info = env.step(expert.action())
        assert not truncated
    assert info["is_success"] and info["score"]["covered"] >= 0.9


def test_wrong_arguments_are_told(little_task):
    for given, told in (
        ({"obs": "pixels"}, "obs is 'pixels'; it must be one of state, flat"),
        ({"render_mode": "ascii"}, "render_mode is 'ascii'"),
        ({"arm": "half"}, "arm is 'half'; it must be kinematic or full"),
        ({"camera": "endo"}, "no camera is called 'endo'. Did you mean 'endoscope'"),
        ({"width": 64.5}, "an image of 64.5 x 360 pixels: each side must have 1 to 8192, a whole"),
    ):
        with pytest.raises(UsageError, match=told):
            TissueEnv(little_task, **given)
    for scene, told in (
        ("incise", "no scene is called 'incise'"),
        (3, "scene is 3; it must be the name of a scene, a TOML file, or a Scene"),
        ("slab", r"'slab' has no \[task\]"),
    ):
        with pytest.raises(UsageError, match=told):
            TissueEnv(scene)
    env = TissueEnv(little_task)
    for options, told in (
        ({"speed": 1}, "reset has no option 'speed'"),
        (["state"], r"options of reset are \['state'\]; they are a dict"),
        ({"variation": [1.0]}, r"the variation is \[1.0\]; it is the numbers of \[\[vary"),
    ):
        with pytest.raises(UsageError, match=told):
            env.reset(options=options)
    with pytest.raises(UsageError, match=r"not in TissueEnv: .* env.unwrapped.episode"):
        Expert(env)


def test_without_gymnasium_one_line_says_what_installs_it():
    program = (
        "import sys; sys.modules['gymnasium'] = None\n"
        "from scalpel_sim.learning.episode import Episode\n"
        "import scalpel_sim.learning\n"
        "try: scalpel_sim.learning.TissueEnv\n"
        "except ImportError as error: print(error)\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "needs Gymnasium: pip install 'scalpel-sim[learn]'" in done.stdout


def test_importing_the_package_registers_without_a_compiler():
    program = "import sys, scalpel_sim.learning; print('numba' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert done.stdout == "False\n", done.stderr
    assert scalpel_sim.learning.Expert is Expert
