"""A yardstick whose line is moved: as one that is made anew, and what does not change is shared."""

import numpy as np
import pytest

from scalpel_sim import SCENES, changed
from scalpel_sim.errors import UsageError
from scalpel_sim.instruments.scene_arms import resting_stroke
from scalpel_sim.preparation.tissue import make_tissue
from scalpel_sim.scene.task_table import LimitTable, TaskTable
from scalpel_sim.scoring.plan import skin_at_rest
from scalpel_sim.scoring.yardstick import with_line, yardstick_of
from tissue import BladeSegment

TASK = TaskTable(
    line=[(0.01, 0.02), (0.03, 0.03)], depth=6e-3, limits=(LimitTable(strain=0.5),), seconds=3.0
)
ABOVE = BladeSegment(
    np.array([0.0, 0.0, 0.1]), np.array([0.0, 0.0, 0.2]), np.array([1.0, 0.0, 0.0])
)
NO_STROKE = resting_stroke(ABOVE)
MOVED = [(0.012, 0.015), (0.02, 0.04), (0.03, 0.05)]


@pytest.fixture(scope="module")
def body():
    return make_tissue(changed(SCENES["slab"], stretch=0.0)).snapshot()


def made(task, body):
    return yardstick_of(task, NO_STROKE, body, {})


def moved_task():
    return TaskTable(line=MOVED, depth=6e-3, limits=TASK.limits, seconds=3.0)


def test_a_moved_line_gives_the_plan_that_is_made_anew(body):
    moved = with_line(made(TASK, body), moved_task(), body, skin_at_rest(body))
    anew = made(moved_task(), body)
    for one, other in zip(moved.plan.surface, anew.plan.surface, strict=True):
        np.testing.assert_array_equal(one, other)
    for one, other in zip(moved.plan[1:], anew.plan[1:], strict=True):
        np.testing.assert_array_equal(one, other)
    places = np.random.default_rng(2).uniform((0.0, 0.0, 0.03), (0.04, 0.06, 0.04), (50, 3))
    np.testing.assert_array_equal(
        moved.plan_search.distances(places), anew.plan_search.distances(places)
    )
    depths = np.zeros((2, len(anew.plan.stations)))
    for each, row in zip((moved, anew), depths, strict=True):
        each.station_search.deepen(anew.plan.surface.points, row)
    np.testing.assert_array_equal(*depths)
    assert depths[0].min() > 5e-3


def test_what_a_line_does_not_change_is_shared(body):
    yardstick = made(TASK, body)
    moved = with_line(yardstick, moved_task(), body, skin_at_rest(body))
    assert moved.strains is yardstick.strains
    assert moved.task.line == MOVED


def test_a_line_that_is_moved_off_the_body_is_refused(body):
    task = TaskTable(line=[(0.01, 0.02), (0.05, 0.02)], depth=6e-3)
    with pytest.raises(UsageError, match="line misses the body at"):
        with_line(made(TASK, body), task, body, skin_at_rest(body))
