"""A run that a hand leads is scored by the plan of the scene, and so is its repetition."""

import json

import numpy as np
from msgspec import structs

from scalpel_sim import prepare
from scalpel_sim.cli.app import command_line
from scalpel_sim.runs.file_names import PLAN, SCENE, SUMMARY
from scalpel_sim.scene.read import read_scene
from scalpel_sim.scene.task_table import SuccessTable, TaskTable
from scalpel_sim.scoring.plan import plan_of
from tests.scalpel_sim.hands.driven_runs import GRID2, controls_of, done, led, through_the_body


def test_what_a_hand_did_is_scored_and_repeated_with_the_same_score(tmp_path):
    task = TaskTable(success=SuccessTable(covered=0.5, off_plan=1e-3))
    scene = structs.replace(GRID2, task=task, seconds=None)
    folder, again = tmp_path / "led", tmp_path / "again"
    simulation, hand = led(scene, seconds=0.8)
    done(
        simulation,
        folder,
        scene,
        controls=controls_of(simulation, hand),
        every_frame=through_the_body(hand),
    )
    score = json.loads((folder / SUMMARY).read_text())["score"]
    assert score["terms"]["cut_area"] > 1e-4
    assert score["terms"]["covered"] > 0.1
    assert score["instruments"][0]["path_length_m"] > 0.02

    body = prepare(GRID2, records=False)
    planned = plan_of(TaskTable(), body.stroke, body.link.snapshot())
    kept = plan_of(read_scene(folder / SCENE).task, body.stroke, body.link.snapshot())
    assert read_scene(folder / SCENE).task.surface == str(folder / PLAN)
    np.testing.assert_array_equal(kept.surface.points, planned.surface.points)
    np.testing.assert_array_equal(kept.depths, planned.depths)

    assert command_line(["run", str(folder / SCENE), "-q", "--out", str(again)]) == 0
    assert json.loads((again / SUMMARY).read_text())["score"] == score
