"""A child process that runs cases one by one, so that its death or a hang has the case's number."""

import contextlib
import ctypes
import faulthandler
import gc
import importlib
import itertools
import multiprocessing
import os
import resource
import sys
import time
import traceback
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, NamedTuple

HANG = 2.0
"""Processor time that a file or a frame may take at most [s]."""

PATIENCE = 60.0
"""Wall time after which a case that has not come back is ended [s]: on a busy machine a case waits
for a processor many times as long as it computes."""

PATIENCE_AT_FIRST = 900.0
"""The same for the first case of a process [s], which may compile the kernels."""

N_FIRST = 500
"""Cases after which memory is looked at for the first time, and again and again: by then caches are
full."""

GROWTH_ALLOWED = 8 << 20
"""Growth of the memory of a child over all its later cases [byte], after what the allocator keeps
for later was given back. A leak of 1 kB in each of 100,000 cases would be 100 MB."""

GROWTH_WITH_KERNELS = 40 << 20
"""The same where kernels are loaded when they are first needed [byte], which has taken 22 MB at
once. A leak of 50 bytes in each of a million frames would be more."""

ROOM = 512 << 20
"""Address space that a child may take beyond what it has at the start [byte]; more is an error."""


class Outcome(NamedTuple):
    """What came of a case."""

    failure: str
    """The traceback, or an empty text."""
    seconds: float
    """Processor time [s]."""
    memory: int
    """Memory that the child had in use when it was last looked at [byte]."""
    answer: Any
    """What the function returned."""


class Child:
    """A process in which a function of a module is called with the number of a case.

    Args:
        module: Name of the module; it is imported in the child.
        function: Name of the function.
        arguments: Arguments after the number of the case.
        longest: Processor time that a case may take at most [s].
        patience: Wall time after which a case that has not come back is ended [s].
        growth: Growth of memory that is allowed [byte].
        room: Address space that it may take beyond what it has at the start [byte]; None for any.
    """

    def __init__(
        self,
        module: str,
        function: str,
        *arguments: object,
        longest: float = HANG,
        patience: float = PATIENCE,
        growth: float = GROWTH_ALLOWED,
        room: int | None = ROOM,
    ) -> None:
        self._call = (room, module, function, arguments)
        self._longest, self._growth, self._patience = longest, growth, patience
        self._process: multiprocessing.process.BaseProcess | None = None

    def run(self, case: int) -> Any:
        """Run a case and return its answer.

        Raises:
            AssertionError: it failed, took too long, took memory, or ended the process.
        """
        outcome = self._outcome(case)
        if outcome.failure:
            self.close()  # what it left undone would fail the next case too
        assert not outcome.failure, outcome.failure
        assert outcome.seconds < self._longest, f"case {case} took {outcome.seconds:.1f} s"
        self._memory = self._memory or outcome.memory
        growth = outcome.memory - self._memory
        assert growth < self._growth, f"the memory of this process has grown by {growth} bytes"
        return outcome.answer

    def close(self) -> None:
        """End the process."""
        if self._process is not None:
            self._pipe.close()
            self._process.kill()
            self._process.join()
            self._process = None

    def _outcome(self, case: int) -> Outcome:
        if self._process is None:
            self._start()
        try:
            self._pipe.send(case)
            if not self._pipe.poll(self._patience_now):
                self.close()
                raise AssertionError(f"case {case} did not come back within {self._patience:g} s")
            self._patience_now = self._patience
            return self._pipe.recv()
        except (EOFError, ConnectionError) as error:
            process = self._process
            process.join()
            self.close()
            raise AssertionError(f"case {case} ended its process: {process.exitcode}") from error

    def _start(self) -> None:
        context = multiprocessing.get_context("spawn")
        self._pipe, theirs = context.Pipe()
        self._process = context.Process(target=_serve, args=(theirs, *self._call), daemon=True)
        self._process.start()
        theirs.close()
        self._memory = 0
        self._patience_now = max(self._patience, PATIENCE_AT_FIRST)


def _serve(
    pipe: Connection,
    room: int | None,
    module: str,
    function: str,
    arguments: tuple[object, ...],
) -> None:
    """Run the cases that come through a pipe until it is closed."""
    faulthandler.enable()
    call = getattr(importlib.import_module(module), function)
    if room is not None:
        _limit_memory(room)
    memory = 0
    with contextlib.suppress(EOFError):
        for n in itertools.count():
            case = pipe.recv()
            failure, answer, begun = "", None, time.process_time()
            try:
                answer = call(case, *arguments)
            except BaseException:
                failure = traceback.format_exc()
            seconds = time.process_time() - begun
            if n % N_FIRST == N_FIRST - 1:
                memory = memory_of_this_process()
            pipe.send(Outcome(failure, seconds, memory, answer))


def _limit_memory(room: int) -> None:
    if sys.platform == "linux":
        pages = int(Path("/proc/self/statm").read_text().split()[0])
        most = pages * os.sysconf("SC_PAGE_SIZE") + room
        resource.setrlimit(resource.RLIMIT_AS, (most, most))


def memory_of_this_process() -> int:
    """Return the memory in use [byte]; 0 where the system does not say."""
    if sys.platform != "linux":
        return 0
    gc.collect()
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None)
    if trim is not None:
        trim(0)
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")
