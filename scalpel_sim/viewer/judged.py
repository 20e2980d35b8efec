"""Plan and score in a picture: a line on the tissue, and the terms so far."""

from weakref import WeakKeyDictionary

import numpy as np

from bridge import InProcessLink
from scalpel_sim.scoring.judged_terms import judged_terms
from scalpel_sim.scoring.plan_marks import MarkedPlan, PlanMarks
from scalpel_sim.scoring.score import Score
from scalpel_sim.simulation import Simulation
from scalpel_sim.viewer.scene3d import JudgedState

_NO_PLACES = np.zeros((0, 3))

_plans: WeakKeyDictionary[Simulation, tuple[tuple[int, int], MarkedPlan]] = WeakKeyDictionary()
"""The plan of each simulation that is shown, and its frames and tetrahedra then: to look its
stations up in the mesh takes some milliseconds, to follow them none."""


def judged_state(simulation: Simulation) -> JudgedState | None:
    """Return the plan and the score of a simulation now; None where it has no task."""
    score = simulation.score
    if not isinstance(score, Score):
        return None
    marks = plan_marks(simulation)
    rows = [
        (term.name, term.figure, term.is_met)
        for term in judged_terms(score.figures(), briefly=True)
    ]
    if marks is None:
        return JudgedState(_NO_PLACES, np.zeros(0, bool), rows)
    return JudgedState(marks.places, marks.is_open, rows)


def plan_marks(simulation: Simulation) -> PlanMarks | None:
    """Return the plan of a simulation on the tissue; None where it has no line on the skin."""
    score, link = simulation.score, simulation.link
    if not (isinstance(score, Score) and isinstance(link, InProcessLink)):
        return None
    if score.plan is None or len(score.plan.stations) == 0:
        return None
    result = simulation.bridge.result
    now = simulation.n_frames, 0 if result is None else result.n_tetrahedra
    before, marked = _plans.get(simulation, ((0, 0), None))
    if marked is None or marked.plan is not score.plan:  # another one in each episode
        marked = MarkedPlan(score.plan, link.tissue)
    elif now[0] < before[0] or now[1] < before[1]:  # the body has gone back to an earlier state
        marked.locate(link.tissue)
    _plans[simulation] = now, marked
    return marked.now(link.tissue, score.is_covered)
