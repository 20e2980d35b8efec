"""A process with several environments in turn, which steps and resets them as it is told."""

import contextlib
import math
import signal
import traceback
from multiprocessing.connection import Connection
from typing import Any, NamedTuple

import numpy as np
from gymnasium.spaces import Box, Dict
from gymnasium.vector import AutoresetMode

from scalpel_sim.errors import UsageError, one_line
from scalpel_sim.learning.environment import ObservedArrays, TissueEnv
from tissue import BoolArray, FloatArray

_ALIGNMENT = 64
"""Bytes at whose multiples an array begins: a line of the cache."""

_WHOLE, _OBSERVED = "", "observed "
"""Name of an observation that is one array, and beginning of the names of such arrays."""


class Job(NamedTuple):
    """Work of a process."""

    made_of: dict[str, Any]
    """Arguments of its environments."""
    numbers: range
    """Which of the environments are its own."""
    mode: AutoresetMode
    """When an environment that has ended begins again."""
    shared: "SharedArrays"
    """Where actions are read, and what comes of them is written."""


class SharedArrays:
    """Arrays of all environments, in memory that processes share.

    The memory has no name, so nothing of it stays when the processes have ended, however they did.

    Args:
        observed: Space of the observations of one environment: an array, or arrays by name.
        n_numbers: Numbers of its action.
        n: Number of environments.
        context: Makes the memory: a context of `multiprocessing`.
    """

    def __init__(self, observed: Box | Dict, n_numbers: int, n: int, context: Any) -> None:
        boxes: Any = observed.spaces if isinstance(observed, Dict) else {_WHOLE: observed}
        self._rows: dict[str, tuple[tuple[int, ...], str]] = {
            "actions": ((n, n_numbers), "f8"),
            "rewards": ((n,), "f8"),
            "terminated": ((n,), "?"),
            "truncated": ((n,), "?"),
        } | {_OBSERVED + name: ((n, *box.shape), box.dtype.str) for name, box in boxes.items()}
        self._memory = context.RawArray("b", sum(_padded(*row) for row in self._rows.values()))

    def views(self) -> "Views":
        """Return the arrays, as this process sees them."""
        found, begin = dict[str, Any](), 0
        for name, (shape, kind) in self._rows.items():
            array = np.frombuffer(self._memory, kind, math.prod(shape), begin)
            found[name] = array.reshape(shape)
            begin += _padded(shape, kind)
        observed = {
            name.removeprefix(_OBSERVED): found.pop(name)
            for name in self._rows
            if name.startswith(_OBSERVED)
        }
        return Views(observed.get(_WHOLE, observed), **found)


def _padded(shape: tuple[int, ...], kind: str) -> int:
    """Return the bytes of an array, to where the next one may begin."""
    n = math.prod(shape) * np.dtype(kind).itemsize
    return n + -n % _ALIGNMENT


class Views(NamedTuple):
    """Arrays of all environments, the number of the environment first."""

    observed: Any
    """Observations: arrays by name, or one."""
    actions: FloatArray
    """Actions, shape (n, n_numbers)."""
    rewards: FloatArray
    """Rewards, shape (n,)."""
    terminated: BoolArray
    """Whether the task is done, or can no longer be done, shape (n,)."""
    truncated: BoolArray
    """Whether time is over or a simulation failed, shape (n,)."""

    def show(self, number: int, observed: ObservedArrays) -> None:
        """Write the observation of an environment."""
        if isinstance(observed, dict):
            for name, array in observed.items():
                self.observed[name][number] = array
        else:
            self.observed[number] = observed


Infos = list[tuple[int, dict[str, Any]]]
"""All that is known besides, of environments by number, in order."""


class Worker:
    """The environments of a process.

    Args:
        job: What it does.
    """

    def __init__(self, job: Job) -> None:
        self._envs = {number: TissueEnv(**job.made_of) for number in job.numbers}
        self._mode, self._views = job.mode, job.shared.views()

    def step(self) -> Infos:
        """Do a step of each environment, or begin it again where that is due."""
        infos: Infos = []
        views = self._views
        for number, env in self._envs.items():
            ended = views.terminated[number] or views.truncated[number]
            if ended and self._mode is AutoresetMode.NEXT_STEP:
                infos.append((number, self._begun(number, None, None)))
                continue
            observed, reward, terminated, truncated, info = env.step(views.actions[number])
            views.rewards[number] = reward
            views.terminated[number], views.truncated[number] = terminated, truncated
            if (terminated or truncated) and self._mode is AutoresetMode.SAME_STEP:
                infos.append((number, {"final_obs": observed, "final_info": info}))
                observed, info = env.reset()
            views.show(number, observed)
            infos.append((number, info))
        return infos

    def reset(self, seeds: dict[int, int | None], options: dict[str, Any] | None) -> Infos:
        """Begin episodes.

        Args:
            seeds: Seed of each environment that begins one, by number.
            options: Options of each.
        """
        own = [(number, seeds[number]) for number in self._envs if number in seeds]
        return [(number, self._begun(number, seed, options)) for number, seed in own]

    def _begun(
        self, number: int, seed: int | None, options: dict[str, Any] | None
    ) -> dict[str, Any]:
        """Begin an episode, and return what is known besides."""
        views = self._views
        observed, info = self._envs[number].reset(seed=seed, options=options)
        views.show(number, observed)
        views.rewards[number] = 0.0
        views.terminated[number] = views.truncated[number] = False
        return info

    def call(self, name: str, given: tuple[Any, ...], named: dict[str, Any]) -> list[Any]:
        """Return what a method of each environment returns, or what an attribute is.

        Raises:
            UsageError: there is nothing of that name.
        """
        if not all(hasattr(env, name) for env in self._envs.values()):
            raise UsageError(f"an environment has no '{name}'")
        found = [getattr(env, name) for env in self._envs.values()]
        return [each(*given, **named) if callable(each) else each for each in found]


def work(connection: Connection, job: Job) -> None:
    """Serve until the other end of the connection is closed, or its process has ended.

    Each answer is whether it was done, and what came of it, or the error.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the process that has started it
    with contextlib.suppress(EOFError, ConnectionError):
        _serve(connection, job)


def _serve(connection: Connection, job: Job) -> None:
    """Serve until something fails.

    Raises:
        EOFError: the other end was closed.
        ConnectionError: it was closed before it got an answer.
    """
    try:
        worker = Worker(job)
        connection.send((True, None))
        while True:
            what, given = connection.recv()
            try:
                answer = True, getattr(worker, what)(*given)
            except ValueError as error:  # the request was wrong; what is there stays
                answer = False, error
            connection.send(answer)
    except (EOFError, ConnectionError):
        raise
    except Exception as error:
        told = RuntimeError(one_line(error))
        told.add_note(traceback.format_exc())  # where it was, for who reads it elsewhere
        connection.send((False, told))
