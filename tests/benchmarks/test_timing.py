"""Timing with a simulated clock, whose times are known exactly."""

import pytest

from benchmarks.timing import LEAST_SAMPLES, SHORTEST_SAMPLE, Case, Clock, time_in_turns


class SimulatedClock:
    """A simulated clock, and cases whose calls each advance it by a fixed time."""

    def __init__(self):
        self.time = 0.0
        self.calls = []

    @property
    def clock(self):
        return Clock("made", lambda: self.time)

    def case(self, name, seconds):
        def run(n):
            self.time += n * seconds
            self.calls.append(name)

        return Case(name, run)


def test_every_sample_is_the_time_of_one_call():
    simulated = SimulatedClock()
    slow, fast = time_in_turns(
        [simulated.case("slow", 0.05), simulated.case("fast", 1e-6)],
        3,
        clock=simulated.clock,
        turn=0.02,
    )
    assert len(slow) == len(fast) == 3
    assert [len(samples) for samples in slow] == [LEAST_SAMPLES] * 3
    for rounds, seconds in ((slow, 0.05), (fast, 1e-6)):
        assert all(samples == pytest.approx(seconds) for samples in rounds)
    assert all(0.02 <= len(samples) * 1e-6 * 256 <= 0.021 for samples in fast)


def test_calls_that_are_too_short_to_time_are_timed_together():
    simulated = SimulatedClock()
    ((samples,),) = time_in_turns(
        [simulated.case("short", 1e-5)], 1, clock=simulated.clock, turn=0.01
    )
    assert len(samples) * 32 * 1e-5 == pytest.approx(0.01, rel=0.05)
    assert 32 * 1e-5 >= SHORTEST_SAMPLE > 16 * 1e-5


def test_cases_take_turns_and_every_other_round_goes_backwards():
    simulated = SimulatedClock()
    cases = [simulated.case(name, 1.0) for name in "abc"]
    time_in_turns(cases, 3, clock=simulated.clock, turn=0.0)
    turns = [
        name for i, name in enumerate(simulated.calls) if i == 0 or simulated.calls[i - 1] != name
    ]
    assert "".join(turns) == "abc" + "abc" + "ba" + "bc"  # first each is called once, to load it
