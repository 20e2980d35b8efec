"""The score of a run whose tissue is in another process: that of a run here, to the bit."""

import pytest
from msgspec import structs

from scalpel_sim import SCENES, prepare
from scalpel_sim.scene.schema import LabelTable
from scalpel_sim.scene.task_table import LimitTable, SpareTable, SuccessTable, TaskTable
from tests.scalpel_sim.served_scenes import served

HALF = LabelTable(name="half", region="0,0,0:0.02,0.06,0.04")
"""Part of the slab on one side of its cut, which parts it along the border."""
TASK = TaskTable(
    line=[(0.02, 0.001), (0.02, 0.059)],
    depth=0.02,
    target="half",
    spare=(SpareTable(label="half", margin=0.001),),
    success=SuccessTable(covered=0.95, off_plan=1e-6, force=5.0),
)


def scene(**task):
    """Return the slab with a target, and other keys of its task."""
    return structs.replace(SCENES["slab"], task=structs.replace(TASK, **task), labels=(HALF,))


def done(given, link=None):
    """Return the figures of a whole run, and the state in its middle."""
    simulation = prepare(given, link, records=False)
    simulation.run(0.5 * simulation.duration)
    middle = repr(simulation.score.figures())
    simulation.run(simulation.duration)
    return middle, simulation.score.figures()


def test_a_run_with_its_tissue_elsewhere_has_the_same_score():
    given = scene()
    here = done(given)
    with served(given) as link:
        there = done(given, link)
    assert repr(there) == repr(here)
    terms = there[1]["terms"]
    assert terms["cut_area"] > 1e-3
    assert terms["pieces"] == 2.0
    assert terms["removed"] + terms["healthy"] > 0.0  # of halves, either is the smaller
    assert terms["covered"] > 0.9
    assert terms["spared_distance"] == 0.0


def test_strain_is_not_known_of_a_tissue_elsewhere():
    given = scene(limits=(LimitTable(strain=0.2),), success=SuccessTable(strain_above=0.0))
    with served(given) as link:
        score = prepare(given, link, records=False).score
        assert "strain_above" not in score.terms()
        assert score.figures()["unknown"] == ["strain_above"]
        assert score.figures()["success"] is None
    assert prepare(given, records=False).score.terms()["strain_above"] == pytest.approx(0.0)
