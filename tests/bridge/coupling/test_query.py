import threading
import time

import numpy as np
import pytest

from bridge import LinkError
from bridge.coupling.query import Query, TimedSweep
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
    """A wall that answers only once it is allowed to."""

    def __init__(self):
        super().__init__(np.zeros(3), BACK, 1e3)
        self.may_answer = threading.Event()

    def step(self, sweep, dt, *led):
        assert self.may_answer.wait(10.0)
        return super().step(sweep, dt, *led)


def until_answered(query):
    deadline = time.monotonic() + 10.0
    while time.monotonic() < deadline:
        answer = query.take_answer()
        if answer is not None:
            return answer
        time.sleep(1e-3)
    raise AssertionError("no answer in 10 s")


def test_a_query_that_waits_has_its_answer():
    query = Query(wall(), waits=True)
    query.start([TimedSweep(BladeSweep(at(0.0), at(1e-3)), DT)], at(1e-3))
    assert query.is_pending
    answer = query.take_answer()
    assert answer.result.wrench_t1.force[1] == pytest.approx(-1.0)
    assert answer.seconds == DT and not query.is_pending and query.take_answer() is None


def test_a_query_that_does_not_wait_has_no_answer_until_it_arrives():
    slow = SlowWall()
    query = Query(slow, waits=False)
    query.start([TimedSweep(BladeSweep(at(0.0), at(1e-3)), DT)], at(1e-3))
    assert query.take_answer() is None and query.is_pending
    slow.may_answer.set()
    assert until_answered(query).result.wrench_t1.force[1] == pytest.approx(-1.0)


def test_the_loss_of_a_tissue_is_raised_where_the_answer_is_taken():
    class Lost(Wall):
        def step(self, sweep, dt, *led):
            raise LinkError("the server is gone")

    query = Query(Lost(np.zeros(3), BACK, 1e3), waits=False)
    query.start([TimedSweep(None, DT)], at(0.0))
    with pytest.raises(LinkError, match="the server is gone"):
        until_answered(query)


def test_a_path_in_parts_gets_one_answer_with_its_mean_wrench():
    """Impulse and angular impulse are sums over all steps; values at the end are of the last."""
    depths, tissue = np.array([0.0, 1e-3, 3e-3, 2e-3]), wall()
    seconds = [DT, 2 * DT, DT]
    path = [
        TimedSweep(BladeSweep(at(a), at(b)), dt)
        for a, b, dt in zip(depths[:-1], depths[1:], seconds, strict=True)
    ]
    query = Query(tissue, waits=True)
    query.start(path, at(depths[-1]))
    result = query.take_answer().result
    assert result.wrench.force * sum(seconds) == pytest.approx(tissue.impulse)
    means = -1e3 * 0.5 * (depths[:-1] + depths[1:])
    assert result.wrench.force[1] == pytest.approx(means @ seconds / sum(seconds))
    assert result.wrench.torque == pytest.approx(
        np.cross([0.0, 0.0, 0.02], result.wrench.force)  # pressed all along the edge
    )
    assert result.wrench_t1.force[1] == pytest.approx(-2.0)
    assert result.n_substeps == 3
