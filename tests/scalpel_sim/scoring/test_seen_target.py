"""A run whose task has a camera: how much of the target it sees, at the end."""

import json

import pytest
from msgspec import structs

from scalpel_sim import SCENES, prepare
from scalpel_sim.errors import UsageError
from scalpel_sim.runs.file_names import SUMMARY
from scalpel_sim.runs.seen_target import target_seen
from scalpel_sim.scene.schema import LabelTable, ViewTable
from scalpel_sim.scene.task_table import TaskTable
from tests.scalpel_sim.hands.driven_runs import done


def scene_with(camera):
    """Return a slab of which one half is the target, seen from straight above."""
    above = ViewTable(
        name="above",
        eye=(0.02, 0.03, 0.54),
        target=(0.02, 0.03, 0.04),
        up=(0.0, 1.0, 0.0),
        fov_degrees=2.0,
    )
    return structs.replace(
        SCENES["slab"],
        labels=(LabelTable(name="half", region="0,0,0:0.02,0.06,0.04"),),
        views=(above,),
        task=TaskTable(kind="expose", target="half", camera=camera),
        seconds=0.04,
    )


def test_a_run_says_how_much_of_its_target_is_exposed(tmp_path):
    scene = scene_with("above")
    simulation = prepare(scene)
    done(simulation, tmp_path, scene)
    score = json.loads((tmp_path / SUMMARY).read_text())["score"]
    assert score["terms"]["exposed"] == pytest.approx(0.5, abs=0.02)
    assert simulation.score.look_for_target is None


def test_a_camera_that_is_not_there_is_refused():
    simulation = prepare(scene_with("aboev"), records=False)
    with (
        pytest.raises(UsageError, match="aboev"),
        target_seen(simulation, simulation.scene.task),
    ):
        raise AssertionError("it is there")
