"""Timing: cases take turns in rounds, so that what disturbs the machine disturbs them all alike."""

import time
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from scalpel_sim.bench.watch import SILENT, Watch
from scalpel_sim.simulation import no_garbage_collection
from tissue import FloatArray

_TURN = 0.1
"""How long a case runs in each round [s]: long against a time slice of the system, short against
what changes on a shared machine."""
LEAST_SAMPLES = 3
"""Of a case in each round, where one takes longer than its turn."""
SHORTEST_SAMPLE = 2e-4
"""Time that a sample takes at least [s]: as many calls as it needs are timed together. Reading the
clock takes 0.5 µs of it; with shorter samples that would be seen."""


class Clock(NamedTuple):
    """What time is told by."""

    name: str
    now: Callable[[], float]
    """Time [s] since some moment."""


CPU = Clock("CPU", time.thread_time)
"""What the processor spent on this thread: other work on the machine does not count, except that it
takes its share of caches and memory. For kernels, which do nothing but compute."""
WALL = Clock("wall", time.perf_counter)
"""What a person waits for. For frames, whose deadline is on the wall."""


class Case(NamedTuple):
    """Something to time."""

    name: str
    run: Callable[[int], None]
    """Does it so many times."""


def interleaved(
    cases: Sequence[Case],
    n_rounds: int,
    *,
    clock: Clock = CPU,
    turn: float = _TURN,
    watch: Watch = SILENT,
) -> list[list[FloatArray]]:
    """Return the seconds that each sample took a call: for each case, an array for each round.

    Every turn begins with a call that is not timed, so that the case finds the caches as it would
    leave them. Odd rounds go backwards, so that none always comes after the same other.
    """
    taken: list[list[FloatArray]] = [[] for _ in cases]
    n_calls = [calls_of_a_sample(case.run, clock) for case in cases]
    order = list(range(len(cases)))
    watch.begin(n_rounds * len(cases))
    with no_garbage_collection():
        for _ in range(n_rounds):
            for i in order:
                taken[i].append(sampled(cases[i].run, n_calls[i], clock, turn))
                watch.tick(cases[i].name)
            order.reverse()
    return taken


def calls_of_a_sample(run: Callable[[int], None], clock: Clock) -> int:
    """Return how many calls make a sample; the first calls load and compile, and are not timed."""
    run(1)
    n_calls = 1
    while True:
        start = clock.now()
        run(n_calls)
        taken = clock.now() - start
        if taken >= SHORTEST_SAMPLE:
            return n_calls
        n_calls *= 2


def sampled(run: Callable[[int], None], n_calls: int, clock: Clock, turn: float) -> FloatArray:
    """Return the seconds a call in each sample of one turn."""
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
