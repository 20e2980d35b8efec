import threading

import numpy as np
import pytest

from bridge import LinkError
from bridge.coupling.query import Inquiry, Leg
from tests.bridge.coupling.walls import Wall
from tissue import BladeSegment, BladeSweep

DT = 1e-3
BACK = np.array([0.0, -1.0, 0.0])


def at(y):
    return BladeSegment(
        np.array([0.0, y, 0.0]), np.array([0.0, y, 0.04]), np.array([0.0, 1.0, 0.0])
    )


def wall():
    return Wall(np.zeros(3), BACK, 1e3)


class SlowWall(Wall):
    """Answers when it is told to."""

    def __init__(self):
        super().__init__(np.zeros(3), BACK, 1e3)
        self.may_answer = threading.Event()

    def step(self, sweep, dt):
        assert self.may_answer.wait(10.0)
        return super().step(sweep, dt)


def until(condition, inquiry):
    for _ in range(10_000):
        answer = inquiry.answer()
        if answer is not None:
            return answer
        condition.wait(1e-3)
    raise AssertionError("no answer in 10 s")


def test_an_answer_that_is_waited_for_is_there():
    inquiry = Inquiry(wall(), waits=True)
    inquiry.ask([Leg(BladeSweep(at(0.0), at(1e-3)), DT)], at(1e-3))
    assert inquiry.is_open
    answer = inquiry.answer()
    assert answer.result.wrench_t1.force[1] == pytest.approx(-1.0)
    assert answer.seconds == DT and not inquiry.is_open and inquiry.answer() is None


def test_an_answer_that_is_not_waited_for_comes_when_it_comes():
    slow = SlowWall()
    inquiry = Inquiry(slow, waits=False)
    inquiry.ask([Leg(BladeSweep(at(0.0), at(1e-3)), DT)], at(1e-3))
    assert inquiry.answer() is None and inquiry.is_open
    slow.may_answer.set()
    assert until(slow.may_answer, inquiry).result.wrench_t1.force[1] == pytest.approx(-1.0)


def test_a_tissue_that_is_lost_is_told_where_the_answer_is_taken():
    class Lost(Wall):
        def step(self, sweep, dt):
            raise LinkError("the server is gone")

    inquiry = Inquiry(Lost(np.zeros(3), BACK, 1e3), waits=False)
    inquiry.ask([Leg(None, DT)], at(0.0))
    with pytest.raises(LinkError, match="the server is gone"):
        until(threading.Event(), inquiry)


def test_the_legs_of_a_way_answer_together_with_their_mean_wrench():
    """Impulse and angular impulse are those of all steps; what is at the end is of the last."""
    ways, asked = np.array([0.0, 1e-3, 3e-3, 2e-3]), wall()
    seconds = [DT, 2 * DT, DT]
    legs = [
        Leg(BladeSweep(at(a), at(b)), dt)
        for a, b, dt in zip(ways[:-1], ways[1:], seconds, strict=True)
    ]
    inquiry = Inquiry(asked, waits=True)
    inquiry.ask(legs, at(ways[-1]))
    result = inquiry.answer().result
    assert result.wrench.force * sum(seconds) == pytest.approx(asked.impulse)
    means = -1e3 * 0.5 * (ways[:-1] + ways[1:])
    assert result.wrench.force[1] == pytest.approx(means @ seconds / sum(seconds))
    assert result.wrench.torque == pytest.approx(
        np.cross([0.0, 0.0, 0.02], result.wrench.force)  # pressed all along the edge
    )
    assert result.wrench_t1.force[1] == pytest.approx(-2.0)
    assert result.n_substeps == 3
