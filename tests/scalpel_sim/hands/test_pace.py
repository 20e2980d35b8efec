import pytest

from scalpel_sim.hands.run_controls import MOST_BEHIND, Pace
from tests.scalpel_sim.hands.driven_runs import Clock

DT = 1e-3


class Machine(Clock):
    """A machine on which a frame takes some wall time, and a sleep what was asked for."""

    def run(self, pace: Pace, n: int, seconds: float) -> None:
        for _ in range(n):
            self.now += seconds
            pace.wait(DT)

    def sleep(self, seconds: float) -> None:
        self.now += seconds


def paced() -> tuple[Machine, Pace]:
    machine = Machine()
    return machine, Pace(machine, machine.sleep)


def test_a_fast_machine_waits_for_real_time():
    machine, pace = paced()
    machine.run(pace, 1000, 1e-4)
    assert machine.now == pytest.approx(1.0, abs=0.01)
    assert pace.factor == pytest.approx(1.0, abs=0.02)


def test_a_slow_machine_runs_slower_and_says_by_how_much():
    machine, pace = paced()
    machine.run(pace, 1000, 4 * DT)
    assert machine.now == pytest.approx(4.0)
    assert pace.factor == pytest.approx(0.25, abs=0.01)


def test_what_a_slow_second_has_lost_is_not_caught_up():
    machine, pace = paced()
    machine.run(pace, 100, 10 * DT)
    before = machine.now
    machine.run(pace, 1000, 1e-4)
    assert machine.now - before > 1.0 - MOST_BEHIND - 0.01
