"""Whatever browsers do: the loop of a run never waits, and a good page sees it."""

from tests.battery import battery
from tests.long.viewer_faults import NO_WAIT, harass


@battery(n_per_change=1, n_long=100)
def test_no_fault_of_browsers_delays_a_run(case):
    assert harass(case) < NO_WAIT
