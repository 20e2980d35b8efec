"""Whatever browsers do: the loop of a run never waits, and a good page sees it."""

from tests.long.viewer_faults import NO_WAIT, harass
from tests.support.battery import battery


@battery(n_per_change=1, n_long=100)
def test_no_fault_of_browsers_delays_a_run(case):
    assert harass(case) < NO_WAIT
