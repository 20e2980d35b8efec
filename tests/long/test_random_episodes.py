"""Random episodes of each task: nothing is raised, shown numbers are sane, nothing grows."""

import math
from contextlib import closing
from functools import cache

from scalpel_sim.learning import TissueEnv
from scalpel_sim.scene.read import TASK_SCENES
from tests.long.child import Child
from tests.long.random_episodes import Round, play
from tests.support.battery import battery

N_TASKS = len(TASK_SCENES)

LONG_ROUNDS, SHORT_ROUNDS = (12, 8), (3, 5)
"""Episodes of a round, and rounds, in a long run and for each change."""

N_WARM = 2
"""Rounds after which arrays are as large as they get, and the allocator has its reserves."""

GROWTH = 0.01
"""Most by which memory, and objects that Python watches, may grow after these, as a share."""

LONGEST, PATIENCE = 600.0, 3600.0
"""Longest processor time, and wall time, of all rounds [s]."""


@cache
def env_of(task: str) -> TissueEnv:
    """Return the environment of a task, prepared once."""
    return TissueEnv(task)


@battery(n_per_change=2 * N_TASKS, n_long=1000 * N_TASKS)
def test_a_random_episode_of_any_task_is_sane_to_its_end(case, tally):
    play(env_of(TASK_SCENES[case % N_TASKS]), case // N_TASKS, tally)


@battery(n_per_change=1, n_long=N_TASKS)
def test_memory_is_flat_over_the_same_random_episodes_again_and_again(case, tally, request):
    """The same ones, since a body keeps arrays that are as large as its largest cut so far."""
    n_episodes, n_rounds = LONG_ROUNDS if request.config.getoption("long") else SHORT_ROUNDS
    arguments = (TASK_SCENES[case % N_TASKS], n_episodes, n_rounds)
    limits = {"longest": LONGEST, "patience": PATIENCE, "growth": math.inf, "room": None}
    with closing(Child("tests.long.random_episodes", "rounds", *arguments, **limits)) as child:
        found = [Round(*row) for row in child.run(case * n_episodes)]
    tally["episodes"] += n_episodes * n_rounds
    first, *later = found[N_WARM - 1 :]
    assert max(row.memory for row in later) <= (1.0 + GROWTH) * first.memory, found
    assert max(row.objects for row in later) <= (1.0 + GROWTH) * first.objects, found
