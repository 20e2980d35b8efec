"""Many environments in processes give the bytes of one after the other, and leave nothing."""

import multiprocessing
import os
import signal
import subprocess
import sys
import time
from contextlib import closing
from pathlib import Path

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AsyncVectorEnv, AutoresetMode, SyncVectorEnv
from msgspec.structs import replace

from scalpel_sim.errors import RunError, UsageError
from scalpel_sim.learning import Episode, TissueEnv, TissueVectorEnv
from scalpel_sim.learning.registration import OWN_SCENE
from scalpel_sim.learning.worker import Job, SharedArrays, Worker
from tests.scalpel_sim.learning.little_task import SCENE, little_task
from tests.support.battery import battery
from tests.support.processes import environment
from tissue import StateError

__all__ = ["little_task"]

N = 4
"""Environments."""

SCRIPT = f"""
import os, sys, time
import gymnasium, scalpel_sim.learning
envs = gymnasium.make_vec("{OWN_SCENE}", num_envs=3, scene=sys.argv[1], workers=2)
envs.reset(seed=0)
print(*envs.unwrapped.process_ids, flush=True)
while True:
    envs.step(envs.action_space.sample())
"""


@pytest.fixture(scope="module")
def short_task(little_task):
    """The little task, whose time is over after 8 control steps."""
    return replace(little_task, task=replace(little_task.task, seconds=0.16))


@pytest.fixture(scope="module")
def envs(short_task):
    made = gymnasium.make_vec(OWN_SCENE, num_envs=N, scene=short_task, workers=2)
    yield made
    made.close()


def plain(value):
    """Return arrays, and what holds them, as what can be compared."""
    if isinstance(value, dict):
        return {name: plain(each) for name, each in value.items()}
    if isinstance(value, tuple | list):
        return [plain(each) for each in value]
    if isinstance(value, np.ndarray):
        content = [*map(plain, value)] if value.dtype == object else value.tobytes()
        return value.dtype.str, value.shape, content
    return value


def done(envs, n_steps=20):
    """Return all that comes of a number of random steps."""
    rng, found = np.random.default_rng(1), [envs.reset(seed=3)]
    shape, is_disabled = envs.action_space.shape, envs.metadata["autoreset_mode"].name == "DISABLED"
    for _ in range(n_steps):
        found.append(envs.step(rng.uniform(-1.0, 1.0, shape).astype(np.float32)))
        ended = found[-1][2] | found[-1][3]
        if is_disabled and ended.any():
            found.append(envs.reset(options={"reset_mask": ended}))
    return plain(found)


def in_turn(scene, mode=AutoresetMode.NEXT_STEP):
    return done(SyncVectorEnv([lambda: TissueEnv(scene)] * N, autoreset_mode=mode))


def alone(scene, number):
    """Return the rewards of an environment without others, in the episode of its seed."""
    env, rng = TissueEnv(scene), np.random.default_rng(1)
    env.reset(seed=3 + number)
    return [
        env.step(rng.uniform(-1.0, 1.0, (N, 13)).astype(np.float32)[number])[1] for _ in "12345"
    ]


def test_processes_give_the_same_bytes_as_one_environment_after_the_other(envs, short_task):
    found = done(envs)
    assert found == in_turn(short_task)
    rewards = [np.frombuffer(step[1][2])[1] for step in found[1:6]]
    assert rewards == alone(short_task, 1)


@pytest.mark.parametrize("mode", ["SAME_STEP", "DISABLED"])
def test_environments_begin_again_in_the_other_ways_too(short_task, mode):
    with closing(TissueVectorEnv(short_task, N, 1, mode)) as envs:
        assert envs.metadata["autoreset_mode"] is AutoresetMode[mode]
        assert done(envs) == in_turn(short_task, AutoresetMode[mode])
        if mode == "DISABLED":
            with pytest.raises(UsageError, match="environment 0 has ended: begin it by reset"):
                for _ in range(9):
                    envs.step(np.zeros(envs.action_space.shape))


@pytest.fixture(scope="module")
def state_that_fails(short_task):
    """A state whose next step fails: velocities are no numbers."""
    episode = Episode(short_task)
    episode.simulation.link.tissue._stages.model.body.velocities[:] = np.nan
    return episode.save_state().to_bytes()


def done_from_states(envs, state_that_fails):
    """Return all that comes of steps after a state, and of a simulation that fails and after it."""
    rng, shape, found = np.random.default_rng(2), envs.action_space.shape, [envs.reset(seed=11)]
    is_failing = np.arange(N) == 2

    def go_on(n_steps):
        for _ in range(n_steps):
            found.append(envs.step(rng.uniform(-1.0, 1.0, shape).astype(np.float32)))

    go_on(2)
    state = envs.call("save_state")[1]
    found.append(envs.reset(options={"state": state}))
    go_on(2)
    found.append(envs.reset(options={"state": state_that_fails, "reset_mask": is_failing}))
    go_on(1)
    assert (found[-1][3] == is_failing).all()
    if envs.metadata["autoreset_mode"] is AutoresetMode.DISABLED:
        found.append(envs.reset(options={"reset_mask": is_failing}))
    go_on(3)
    return plain(found)


@battery(n_per_change=3, n_long=15)
def test_any_number_of_processes_gives_the_same_bytes(case, short_task, state_that_fails):
    mode, workers = list(AutoresetMode)[case % 3], (0, 3, 2, 4, 1)[case % 5]
    makers = [lambda: TissueEnv(short_task)] * N
    if workers == 0:
        envs = AsyncVectorEnv(makers, autoreset_mode=mode, context="spawn")
    else:
        envs = TissueVectorEnv(short_task, N, workers, mode)
        assert envs.workers == workers
    with closing(envs), closing(SyncVectorEnv(makers, autoreset_mode=mode)) as in_turn:
        assert done(envs) == done(in_turn)
        assert done_from_states(envs, state_that_fails) == done_from_states(
            in_turn, state_that_fails
        )


def test_all_may_begin_at_a_state(envs, short_task):
    envs.reset(seed=1)
    actions = np.full(envs.action_space.shape, 0.3)
    envs.step(actions)
    states = envs.call("save_state")
    expected = envs.step(actions)[0]["blade"]
    envs.reset(seed=7)
    envs.reset(options={"state": states[2]})
    assert np.array_equal(envs.step(actions)[0]["blade"], np.tile(expected[2], (N, 1)))
    with pytest.raises(StateError, match="are no state of a tissue"):
        envs.reset(options={"state": b"none"})
    assert plain(envs.reset(seed=3)) == done(envs, 0)[0]


def test_a_simulation_that_fails_ends_the_episode_of_its_environment_alone(short_task):
    space = TissueEnv(short_task).observation_space
    shared = SharedArrays(space, 13, 2, multiprocessing)
    worker = Worker(Job({"scene": short_task}, range(2), AutoresetMode.NEXT_STEP, shared))
    views, seeds = shared.views(), {0: 3, 1: 4}
    worker.reset(seeds, None)
    expected = plain(views.observed)
    env = worker.call("unwrapped", (), {})[1]
    env.episode.simulation.link.tissue._stages.model.body.velocities[:] = np.nan
    infos = dict(worker.step())
    assert views.truncated.tolist() == [False, True] and not views.terminated.any()
    assert infos[1]["fault"] and "fault" not in infos[0]
    worker.step()  # the second begins again
    assert views.truncated.tolist() == [False, False]
    worker.reset(seeds, None)
    assert plain(views.observed) == expected


def test_wrong_arguments_are_told(envs, short_task):
    for given, told in (
        ({"num_envs": 0}, "num_envs is 0; it must be a whole number from 1"),
        ({"workers": 1.5}, "workers is 1.5; it must be a whole number from 1"),
        ({"autoreset_mode": "never"}, "autoreset_mode is 'never'; it must be one of NEXT_STEP, "),
        ({"autoreset_mode": ["never"]}, r"autoreset_mode is \['never'\]; it must be one of"),
        ({"obs": "pixels"}, "obs is 'pixels'; it must be one of state"),
        ({"render_mode": "human"}, "watch one environment"),
    ):
        with pytest.raises(UsageError, match=told):
            TissueVectorEnv(short_task, **given)
    envs.reset(seed=0)
    for actions in (np.zeros((N, 2)), np.full(envs.action_space.shape, np.nan)):
        with pytest.raises(UsageError, match="actions are 4 x 13 finite numbers"):
            envs.step(actions)
    for seed, told in (
        ([1, 2], "there are 4 environments and 2 seeds"),
        ("a", "a seed is 'a'; it must be a whole number from 0"),
        (-1, "a seed is -1"),
    ):
        with pytest.raises(UsageError, match=told):
            envs.reset(seed=seed)
    with pytest.raises(UsageError, match="an environment has no 'save_stat'"):
        envs.call("save_stat")
    with pytest.raises(UsageError, match="reset has no option 'speed'"):
        envs.reset(options={"speed": 1})
    with pytest.raises(UsageError, match=r"reset_mask is .* it must be True of one or more of 4"):
        envs.reset(options={"reset_mask": np.zeros(N, bool)})


def test_a_process_that_dies_is_told_in_one_line_and_the_others_end(short_task):
    envs = TissueVectorEnv(short_task, N, 2)
    first, second = envs.process_ids
    envs.reset(seed=0)
    os.kill(second, signal.SIGKILL)
    told = r"^the process of environments 2 to 3 failed: it has ended by signal 9$"
    with pytest.raises(RunError, match=told):
        envs.step(np.zeros(envs.action_space.shape))
    assert not runs(first)
    with pytest.raises(UsageError, match="the environments are closed"):
        envs.reset()


def test_an_exception_in_a_process_is_told_with_its_place_and_all_processes_end(short_task):
    envs = TissueVectorEnv(short_task, 2, 2)
    ids = envs.process_ids
    told = "^the process of environment 0 failed: .*Seed must be a python integer"
    with pytest.raises(RunError, match=told) as error:
        envs.call("reset", seed="a")
    assert "environment.py" in error.value.__cause__.__notes__[0]
    assert not any(map(runs, ids))
    envs.close()
    envs.close()


def runs(process_id):
    """Return whether a process runs."""
    try:
        return Path(f"/proc/{process_id}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False


@pytest.mark.end_to_end
@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="asks /proc which processes run")
@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGKILL])
def test_a_script_needs_no_guard_and_leaves_no_process_and_no_memory(tmp_path, how):
    scene, script = tmp_path / "little.toml", tmp_path / "train.py"
    scene.write_text(SCENE)
    script.write_text(SCRIPT)
    shared = Path("/dev/shm")
    before = set(shared.iterdir())
    with subprocess.Popen(
        [sys.executable, str(script), str(scene)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=environment(),
        start_new_session=True,
    ) as program:
        workers = [int(each) for each in program.stdout.readline().split()]
        time.sleep(0.5)
        if how == signal.SIGINT:  # as a terminal does: to all of them
            os.killpg(program.pid, how)
        else:
            program.kill()
        _, complaint = program.communicate(timeout=60)
    assert program.returncode == -how
    assert complaint.count("Traceback") == (how == signal.SIGINT), complaint
    deadline = time.monotonic() + 60.0
    while any(map(runs, workers)) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert len(workers) == 2 and not any(map(runs, workers))
    assert set(shared.iterdir()) <= before
