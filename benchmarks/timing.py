"""The timer: cases take turns in rounds, so that disturbances of the machine affect all equally."""

from collections.abc import Callable, Sequence
from typing import Annotated, NamedTuple

import numpy as np
from cyclopts import Parameter

from scalpel_sim.simulation import no_garbage_collection
from scalpel_sim.validate.speed.measurements import CPU, WALL, Clock
from scalpel_sim.validate.speed.watch import SILENT, Watch
from tissue import FloatArray

Rounds = Annotated[int, Parameter(parse=False)]
"""Number of rounds: `--runs`, which all benchmarks have."""
TurnWatch = Annotated[Watch, Parameter(parse=False)]
"""Receives the progress."""
Largest = Annotated[int | None, Parameter(help="Omit larger bodies [tetrahedra].")]
"""`--largest`, of benchmarks in bodies of several sizes."""

_TURN = 0.1
"""Time for which a case runs in each round [s]: long compared with a time slice of the operating
system, short compared with the changes of load on a shared machine."""
LEAST_SAMPLES = 3
"""Fewest samples of a case in a round, where one sample takes longer than its turn."""
SHORTEST_SAMPLE = 2e-4
"""Least duration of a sample [s]: as many calls as this needs are timed together. Reading the
clock takes 0.5 µs of it; in shorter samples that would show."""


class Case(NamedTuple):
    """Something to time."""

    name: str
    run: Callable[[int], None]
    """Executes the case the given number of times."""
    size: int | None = None
    """Size of its body [tetrahedra]."""


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
        cases: Cases to time.
        n_rounds: Rounds; every case has one turn in each.
        clock: Clock of the samples.
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
                size = "" if cases[i].size is None else f", {cases[i].size:,}"
                watch.tick(cases[i].name + size)
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


def time_calls(do: Callable[[], object], n_times: int, clock: Clock = WALL) -> FloatArray:
    """Return the time of each of some calls [s], shape (n_times,)."""
    taken = np.empty(n_times)
    for i in range(n_times):
        start = clock.now()
        do()
        taken[i] = clock.now() - start
    return taken
