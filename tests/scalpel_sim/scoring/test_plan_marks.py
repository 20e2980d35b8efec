"""The plan as it is drawn: a line on the skin that moves with the material, and what is open."""

import numpy as np
import pytest

from scalpel_sim import SCENES, changed, prepare
from scalpel_sim.scene.task_table import TaskTable
from scalpel_sim.scoring.plan_marks import MarkedPlan
from scalpel_sim.strokes.kind import StrokeTable
from scalpel_sim.viewer.judged import judged_state
from scalpel_sim.viewer.pictures import state_of

LINE = [(0.02, 0.012), (0.02, 0.048)]
DEPTH = 6e-3


@pytest.fixture(scope="module")
def simulation():
    """A cut along the first part of a planned line on the slab."""
    points = [(x, y, 0.04) for x, y in (LINE[0], (0.02, 0.03))]
    stroke = StrokeTable(kind="traced", points=points, depth=DEPTH, speed=0.05)
    task = TaskTable(line=LINE, depth=DEPTH)
    simulation = prepare(changed(SCENES["slab"], strokes=(stroke,), task=task))
    simulation.run(simulation.duration)
    return simulation


def test_the_line_is_open_where_it_was_cut(simulation):
    score, tissue = simulation.score, simulation.link.tissue
    marks = MarkedPlan(score.plan, tissue).now(tissue, score.is_covered)
    at_rest = score.plan.stations[:, 1]
    assert marks.is_open[at_rest < 0.028].mean() > 0.9
    assert not marks.is_open[at_rest > 0.034].any()


def test_the_line_is_in_the_skin_and_moves_with_it(simulation):
    tissue = simulation.link.tissue
    marks = MarkedPlan(simulation.score.plan, tissue).now(tissue, simulation.score.is_covered)
    surface = simulation.link.surface()
    top = surface.positions[np.unique(surface.triangles[~surface.is_cut])]
    nearest = np.linalg.norm(marks.places[:, None] - top[None], axis=2).min(axis=1)
    assert nearest.max() < 0.008  # of a mesh with nodes 10 mm apart


def test_an_open_line_follows_one_lip_and_not_both_in_turn(simulation):
    """The lips are apart by more than the line is rough: from station to station it is smooth."""
    tissue = simulation.link.tissue
    marks = MarkedPlan(simulation.score.plan, tissue).now(tissue, simulation.score.is_covered)
    along = np.diff(marks.places[marks.is_open], axis=0)
    assert np.abs(along[:, 0]).max() < 0.25 * np.abs(along[:, 1]).mean()


def test_after_a_reset_nothing_of_the_line_is_open_and_it_is_where_it_was(simulation):
    assert judged_state(simulation).is_open.any()
    simulation.reset()
    state = judged_state(simulation)
    assert not state.is_open.any()
    np.testing.assert_allclose(state.places[:, 0], 0.02, atol=2e-3)


def test_a_run_without_a_task_shows_no_plan():
    assert state_of(prepare(SCENES["slab"])).judged is None
