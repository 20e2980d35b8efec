"""`TissueVectorEnv`: many environments at once, in several processes."""

import contextlib
import copy
import multiprocessing
import os
import signal
import sys
import types
from collections.abc import Iterator, Sequence
from itertools import pairwise
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from gymnasium.spaces import Box, Dict
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from scalpel_sim.errors import RunError, UsageError
from scalpel_sim.learning.environment import HUMAN, TissueEnv, options_by_name
from scalpel_sim.learning.episode import finite_numbers, task_scene
from scalpel_sim.learning.worker import Infos, Job, SharedArrays, work
from scalpel_sim.scene.scene import Scene
from tissue import BoolArray, FloatArray

RESET_MASK = "reset_mask"
"""Option of `reset`: which environments begin an episode, shape (num_envs,)."""

_PATIENCE = 5.0
"""Time that a process may take to end [s]: it may be in a control step."""


class _Process(NamedTuple):
    """A process, and the end of its connection here."""

    process: Any
    """The process."""
    connection: Connection
    """Where it is told what to do, and answers."""
    numbers: range
    """Which environments are its own."""


class TissueVectorEnv(VectorEnv[Any, Any, Any]):
    """Many environments of one task, in processes of which each has several in turn.

    The same seeds give the same bytes as `SyncVectorEnv` gives, with any number of processes.
    They end when this one is closed, and when the process that made it ends, however that ends.

    Args:
        scene: A scene with a task: see `TissueEnv`, as the rest.
        num_envs: Number of environments.
        workers: Number of processes; None: one for each core that this process may use.
        autoreset_mode: When an environment that has ended begins again: in the next step, in the
            same one, or by `reset` alone. See `gymnasium.vector.AutoresetMode`.
        settings: More arguments of `TissueEnv`, such as `obs`, `arm` and `render_mode`.

    Raises:
        UsageError: an argument has no such value, or the scene cannot be read or has no task.
        RunError: a process failed; the message says why.
    """

    def __init__(
        self,
        scene: str | Path | Scene,
        num_envs: int = 1,
        workers: int | None = None,
        autoreset_mode: str | AutoresetMode = AutoresetMode.NEXT_STEP,
        **settings: Any,
    ) -> None:
        _expect_number("num_envs", num_envs)
        _expect_number("workers", workers if workers is not None else 1)
        if settings.get("render_mode") == HUMAN:
            raise UsageError(
                f"render_mode is '{HUMAN}', which opens a page: watch one environment, by "
                "gymnasium.make"
            )
        self.num_envs = num_envs
        self.autoreset_mode = _mode(autoreset_mode)
        made_of = {"scene": task_scene(scene), **settings}
        one = TissueEnv(**made_of)  # wrong arguments are told here, and kernels compiled once
        self.render_mode = one.render_mode
        self.metadata = one.metadata | {"autoreset_mode": self.autoreset_mode}
        self.single_observation_space = one.observation_space
        self.single_action_space = one.action_space
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        one.close()
        del one
        context = multiprocessing.get_context("spawn")
        (n_numbers,) = self.single_action_space.shape or ()
        assert isinstance(self.single_observation_space, Box | Dict)
        shared = SharedArrays(self.single_observation_space, n_numbers, num_envs, context)
        self._views = shared.views()
        self._processes: list[_Process] = []
        n = min(workers if workers is not None else _n_cores(), num_envs)
        bounds = [num_envs * i // n for i in range(n + 1)]
        try:
            for begin, end in pairwise(bounds):
                job = Job(made_of, range(begin, end), self.autoreset_mode, shared)
                self._processes.append(_started(context, job))
            self._answers(self._processes)
        except BaseException:
            self.close()
            raise

    @property
    def workers(self) -> int:
        """Number of processes."""
        return len(self._processes)

    @property
    def process_ids(self) -> tuple[int, ...]:
        """Numbers of the processes, by which the system knows them."""
        return tuple(each.process.pid for each in self._processes)

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[Any, dict[str, Any]]:
        """Begin an episode of each environment.

        Args:
            seed: Of the first, and each next one has the next; or one of each; None: as before.
            options: Those of `TissueEnv.reset`; and `reset_mask`, shape (num_envs,): those that
                begin one, if not all.

        Raises:
            UsageError: there is no such option, or no seed for each environment.
            StateError: an option is a state of another task.
            RunError: a process failed.
        """
        n = self.num_envs
        seeds = _seeds(seed, n)
        options = options_by_name(options)
        mask = _mask(options.pop(RESET_MASK, np.ones(n, np.bool_)), n)
        own = {i: seeds[i] for i in range(n) if mask[i]}
        infos = self._merged(self._told("reset", own, options))
        return self._observed(), infos

    def step(
        self, actions: FloatArray
    ) -> tuple[Any, FloatArray, BoolArray, BoolArray, dict[str, Any]]:
        """Do an action of each environment over a control step.

        Args:
            actions: Numbers within plus or minus 1, shape (num_envs, n).

        Raises:
            UsageError: they have another shape, are not finite, or an environment that has ended is
                to begin by `reset`.
            RunError: a process failed.
        """
        views = self._views
        actions = finite_numbers(actions, views.actions.shape, "actions are")
        if self.autoreset_mode is AutoresetMode.DISABLED:
            ended = np.flatnonzero(views.terminated | views.truncated)
            if len(ended):
                raise UsageError(
                    f"environment {ended[0]} has ended: begin it by reset(options="
                    f'{{"{RESET_MASK}": ...}})'
                )
        views.actions[:] = actions
        infos = self._merged(self._told("step"))
        flags = views.terminated.copy(), views.truncated.copy()
        return self._observed(), views.rewards.copy(), *flags, infos

    def call(self, name: str, *args: Any, **kwargs: Any) -> tuple[Any, ...]:
        """Return what a method of each environment returns, or what an attribute is.

        Args:
            name: Its name: see `TissueEnv`.
            args: Arguments of the method.
            kwargs: More of them.

        Raises:
            UsageError: environments have nothing of that name.
            RunError: a process failed.
        """
        return tuple(each for found in self._told("call", name, args, kwargs) for each in found)

    def render(self) -> tuple[Any, ...] | None:
        """Return a picture of each environment, as `render_mode` says; None without one."""
        return None if self.render_mode is None else self.call("render")

    def close_extras(self, **kwargs: Any) -> None:
        """End the processes."""
        processes, self._processes = self._processes, []
        for each in processes:
            each.connection.close()
        for each in processes:
            each.process.join(_PATIENCE)
            if each.process.is_alive():
                each.process.kill()
                each.process.join()
            each.process.close()

    def _observed(self) -> Any:
        """Return a copy of the observations."""
        return copy.deepcopy(self._views.observed)

    def _merged(self, answers: list[Infos]) -> dict[str, Any]:
        """Return what is known besides as `VectorEnv` has it."""
        found: dict[str, Any] = {}
        for infos in answers:
            for number, info in infos:
                found = self._add_info(found, info, number)
        return found

    def _told(self, what: str, *given: Any) -> list[Any]:
        """Ask all processes for the same, and return their answers, in order.

        Raises:
            ValueError: it is wrong of one of them; all stay as they are.
            RunError: a process failed. All are ended.
        """
        if not self._processes:
            raise UsageError("the environments are closed: make new ones")
        try:
            for each in self._processes:
                with contextlib.suppress(ConnectionError):  # it has ended: its answer says how
                    each.connection.send((what, given))
            return self._answers(self._processes)
        except ValueError:
            raise
        except BaseException:  # Ctrl-C too: answers that are left would be those of the next step
            self.close()
            raise

    def _answers(self, processes: Sequence[_Process]) -> list[Any]:
        """Return the answers of processes."""
        answers = [_answer(each) for each in processes]
        for each, (is_done, what) in zip(processes, answers, strict=True):
            if not is_done:
                if isinstance(what, ValueError):
                    raise what
                raise _failed(each, str(what)) from what
        return [what for _, what in answers]


def _answer(of: _Process) -> tuple[bool, Any]:
    """Return whether a process has done what it was told, and what came of it, or the error."""
    try:
        answer: tuple[bool, Any] = of.connection.recv()
        return answer
    except (EOFError, ConnectionError):
        of.process.join(_PATIENCE)
        code = of.process.exitcode
        how = f"by signal {-code}" if code is not None and code < 0 else f"with exit code {code}"
        return False, RuntimeError(f"it has ended {how}")


def _failed(of: _Process, reason: str) -> RunError:
    """Return the error of a process that failed."""
    first, last = of.numbers[0], of.numbers[-1]
    which = f"environment {first}" if first == last else f"environments {first} to {last}"
    return RunError(f"the process of {which} failed: {reason}")


def _started(context: Any, job: Job) -> _Process:
    """Start a process."""
    here, there = context.Pipe()
    with _as_workers_start():
        process = context.Process(target=work, args=(there, job), daemon=True)
        process.start()
    there.close()
    return _Process(process, here, job.numbers)


@contextlib.contextmanager
def _as_workers_start() -> Iterator[None]:
    """Start a process without the script of this one, and deaf to Ctrl-C.

    A process that is spawned would run that script again, up to `if __name__ == "__main__"`.
    """
    main, blocks = sys.modules["__main__"], hasattr(signal, "pthread_sigmask")
    sys.modules["__main__"] = types.ModuleType("__main__")
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT}) if blocks else set()
    try:
        yield
    finally:
        sys.modules["__main__"] = main
        if blocks:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _n_cores() -> int:
    """Return the number of cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def _expect_number(name: str, given: Any) -> None:
    """Refuse what is no number of environments or processes.

    Raises:
        UsageError: it is none.
    """
    if not isinstance(given, int | np.integer) or isinstance(given, bool) or given < 1:
        raise UsageError(f"{name} is {given!r}; it must be a whole number from 1")


def _mode(given: str | AutoresetMode) -> AutoresetMode:
    """Return a mode.

    Raises:
        UsageError: there is no such one.
    """
    modes = {each.value: each for each in AutoresetMode} | {
        each.name: each for each in AutoresetMode
    }
    if isinstance(given, AutoresetMode):
        return given
    if not isinstance(given, str) or given not in modes:
        known = ", ".join(each.name for each in AutoresetMode)
        raise UsageError(f"autoreset_mode is {given!r}; it must be one of {known}")
    return modes[given]


def _seeds(given: int | Sequence[int | None] | None, n: int) -> list[int | None]:
    """Return the seed of each environment.

    Raises:
        UsageError: it is no seed, or there is not one of each.
    """
    if given is None:
        return [None] * n
    if isinstance(given, int | np.integer):
        seeds: list[Any] = [int(given) + i for i in range(n)]
    elif isinstance(given, str) or not hasattr(given, "__len__"):
        seeds = [given]
    else:
        seeds = list(given)
        if len(seeds) != n:
            raise UsageError(f"there are {n} environments and {len(seeds)} seeds: give one of each")
    for each in seeds:
        if each is not None and (not isinstance(each, int | np.integer) or each < 0):
            raise UsageError(f"a seed is {each!r}; it must be a whole number from 0, or None")
    return [None if each is None else int(each) for each in seeds]


def _mask(given: Any, n: int) -> BoolArray:
    """Return which environments begin an episode.

    Raises:
        UsageError: it is no mask of them.
    """
    mask = np.asarray(given)
    if mask.shape != (n,) or mask.dtype != np.bool_ or not mask.any():
        raise UsageError(
            f"{RESET_MASK} is {given!r}; it must be True of one or more of {n} environments, "
            f"and False of the others"
        )
    return mask
