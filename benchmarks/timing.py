"""Timing: cases take turns in rounds, so that a disturbance of the machine affects all alike."""

import time
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from scalpel_sim.simulation import no_garbage_collection
from scalpel_sim.validate.speed.watch import SILENT, Watch
from tissue import FloatArray

_TURN = 0.1
"""How long a case runs in each round [s]: long beside a time slice of the operating system, short
beside the changes of load on a shared machine."""
LEAST_SAMPLES = 3
"""Fewest samples of a case in a round, where one sample takes longer than its turn."""
SHORTEST_SAMPLE = 2e-4
"""Least duration of a sample [s]: as many calls as this needs are timed together. Reading the
clock takes 0.5 µs of it; in shorter samples that would show."""


class Clock(NamedTuple):
    """A clock that a case is timed with."""

    name: str
    now: Callable[[], float]
    """Returns the time since some fixed moment [s]."""


CPU = Clock("CPU", time.thread_time)
"""CPU time of this thread: other work on the machine does not count, except that it takes its share
of caches and memory. For kernels, which do nothing but compute."""
WALL = Clock("wall", time.perf_counter)
"""Wall time, what a person waits for. For frames, whose deadline is in wall time."""


class Case(NamedTuple):
    """Something to time."""

    name: str
    run: Callable[[int], None]
    """Executes the case the given number of times."""


def time_in_turns(
    cases: Sequence[Case],
    n_rounds: int,
    *,
    clock: Clock = CPU,
    turn: float = _TURN,
    watch: Watch = SILENT,
) -> list[list[FloatArray]]:
    """Time the cases in turns; return the seconds per call of each sample.

    Every turn begins with a call that is not timed, so that the case finds the caches as its own
    last call left them. Every other round runs in reverse order, so that no case always follows
    the same one.

    Args:
        cases: What to time.
        n_rounds: Rounds; every case has one turn in each.
        clock: What to time with.
        turn: Least duration of a turn [s].
        watch: Receives the progress.

    Returns:
        For each case one array of samples for each round.
    """
    taken: list[list[FloatArray]] = [[] for _ in cases]
    n_calls = [calls_per_sample(case.run, clock) for case in cases]
    order = list(range(len(cases)))
    watch.begin(n_rounds * len(cases))
    with no_garbage_collection():
        for _ in range(n_rounds):
            for i in order:
                taken[i].append(time_turn(cases[i].run, n_calls[i], clock, turn))
                watch.tick(cases[i].name)
            order.reverse()
    return taken


def calls_per_sample(run: Callable[[int], None], clock: Clock) -> int:
    """Return how many calls make up a sample; the first call, which compiles, is not timed."""
    run(1)
    n_calls = 1
    while True:
        start = clock.now()
        run(n_calls)
        taken = clock.now() - start
        if taken >= SHORTEST_SAMPLE:
            return n_calls
        n_calls *= 2


def time_turn(run: Callable[[int], None], n_calls: int, clock: Clock, turn: float) -> FloatArray:
    """Run one turn of a case; return the seconds per call of each sample."""
    run(1)
    samples: list[float] = []
    begin = clock.now()
    while True:
        start = clock.now()
        run(n_calls)
        end = clock.now()
        samples.append((end - start) / n_calls)
        if end - begin >= turn and len(samples) >= LEAST_SAMPLES:
            return np.array(samples)


def median_milliseconds(do: Callable[[], object], n_times: int) -> float:
    """Return how long a call takes, the median of several [ms]: for one whose state stays."""
    times = []
    for _ in range(n_times):
        start = time.perf_counter()
        do()
        times.append(time.perf_counter() - start)
    return 1e3 * float(np.median(times))
