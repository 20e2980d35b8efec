"""Threads that take part in the loops of a body's steps (`tissue.integrators.node_loops`).

The bits are those of one thread, and the thread that steps the body never waits for another to
begin (`tissue.core.thread_team`). The others search for loops, and sleep where none comes for
longer than a time step.
"""

import threading
import weakref
from queue import SimpleQueue

from tissue.core.jit import is_compiling
from tissue.forces.step_context import StepContext
from tissue.integrators.node_loops import take_part

LONGEST_SPIN = 20_000
"""Searches of a thread for a loop before it sleeps: about 1 ms at some 50 ns. To wake it takes
50 to 90 us of a time step, so that it should not sleep between two steps of 1 ms. It does not leave
its core to others in between: where they are busy it came too late to nearly all loops then."""

MOST_SKIPPED = 63
"""Calls at most for which a thread is left asleep after it came too late to run anything, as it
does where the cores are busy: one call after the first time, then 3, 7 and so on. To wake it for
nothing made steps longer by up to a third."""

_LONGEST_END = 1.0
"""Longest wait for a thread to end [s], which takes `LONGEST_SPIN` where it runs."""


class Threads:
    """A number of threads that step a body.

    Args:
        n: How many, the caller's own included; at least 2.
    """

    def __init__(self, n: int) -> None:
        self._workers = [_Worker() for _ in range(n - 1)] if is_compiling() else []
        # Also where Python exits: a thread that ran on would use arrays that are gone.
        weakref.finalize(self, _end_all, self._workers)

    def join(self, context: StepContext) -> None:
        """Share the loops of this context with all threads from now on."""
        context.team.is_shared = 1
        for worker in self._workers:
            worker.wake(context)


class _Worker:
    """A thread that takes part while another steps a body. It begins when it is woken first."""

    def __init__(self) -> None:
        self._contexts: SimpleQueue[StepContext | None] = SimpleQueue()
        self._thread: threading.Thread | None = None
        self._is_asleep = True
        self._skipped = self._to_skip = 0

    def wake(self, context: StepContext) -> None:
        """Wake the thread for loops of this context, unless it still searches for others."""
        if not self._is_asleep:
            return
        if self._to_skip > 0:
            self._to_skip -= 1
            return
        if self._thread is None:
            take_part(context, 0)  # compiles it here, not at the time of what is compiled next
            self._thread = threading.Thread(target=self._work, name="tissue", daemon=True)
            self._thread.start()
        self._is_asleep = False
        self._contexts.put(context)

    def end(self) -> None:
        """End the thread, once it is out of loops."""
        thread = self._thread
        if thread is not None:
            self._contexts.put(None)
            if thread is not threading.current_thread():
                thread.join(_LONGEST_END)

    def _work(self) -> None:
        while True:
            context = self._contexts.get()
            if context is None:
                return
            has_run = take_part(context, LONGEST_SPIN) > 0
            self._skipped = 0 if has_run else min(2 * self._skipped + 1, MOST_SKIPPED)
            self._to_skip = self._skipped
            del context  # its arrays may be replaced while this thread sleeps
            self._is_asleep = True


def _end_all(workers: list[_Worker]) -> None:
    for worker in workers:
        worker.end()
