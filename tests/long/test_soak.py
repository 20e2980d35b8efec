"""An hour of simulated time: memory stays flat, the account closes, nothing drifts at rest."""

import math
from contextlib import closing

from tests.long.child import Child
from tests.long.soak import LIFE, Life
from tests.support.battery import battery

HOUR = 3600.0
"""Simulated time of a long run [s]."""

SHORT, SHORT_LIFE = 32.0, 8.0
"""Simulated time for each change, and of a life in it [s]."""

LIMIT = 5 * 3600.0
"""Longest time that it may take [s]."""

GROWTH = 5e6
"""Most by which memory may grow after the first minute [bytes]."""

RESIDUAL = 0.01
"""Largest residual of the account of energy, as a share of the work of the blade."""

DRIFT = 1e-4
"""Farthest that a node may drift while the body is at rest [m], a hundredth of an element."""


@battery(n_per_change=1, n_long=1)
def test_nothing_grows_or_drifts_and_the_account_closes(tally, request, case):
    times = (HOUR, LIFE) if request.config.getoption("long") else (SHORT, SHORT_LIFE)
    # The limits that it takes are its own: it starts processes, which have as much room.
    limits = {"longest": LIMIT, "patience": LIMIT, "growth": math.inf, "room": None}
    with closing(Child("tests.long.soak", "run", *times, **limits)) as soak:
        reply = soak.run(case)
    lives = [Life(*row) for row in reply["lives"]]
    tally["frames"] += sum(life.frames for life in lives)
    tally["lives"] += len(lives)
    tally["tabs"] += reply["tabs"]
    assert [life for life in lives if life.residual > RESIDUAL] == []
    assert [life for life in lives if life.drift > DRIFT] == []
    for memory in (reply["memory"], reply["page_memory"]):
        assert max(memory[3:]) - max(memory[:3]) < GROWTH
