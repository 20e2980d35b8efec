"""The report of a whole run, with its task, its pictures and how to do it again."""

import io
import re

import numpy as np
import pytest
from PIL import Image

from scalpel_sim import SCENES, changed, prepare
from scalpel_sim.cli.app import command_line
from scalpel_sim.runs.file_names import REPORT
from scalpel_sim.runs.run_pictures import pictures_of
from scalpel_sim.scene.task_table import TaskTable
from scalpel_sim.strokes.kind import StrokeTable
from tests.support.egl import needs_renderer

LINE = [[0.02, 0.012], [0.02, 0.048]]
POINTS = [[x, y, 0.04] for x, y in LINE]
STROKE = f'stroke=[{{kind="traced",points={POINTS},depth=0.006,force_limit=2.0}}]'
TASK = f'task={{kind="incise",line={LINE},depth=0.006,success={{covered=0.5,force=1.0}}}}'


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    folder = tmp_path_factory.mktemp("report")
    assert (
        command_line(["run", "slab", "--set", STROKE, "--set", TASK, "--out", f"{folder}", "-q"])
        == 0
    )
    return (folder / REPORT).read_text()


def test_it_says_what_was_to_be_done_and_whether_it_was(page):
    assert "Incise along a line on the skin, 36 mm long, 6.0 mm deep." in page
    assert "<strong>Passed.</strong>" in page and "2 of 2 criteria are met" in page
    assert "50% or more" in page and "1.00 N or less" in page


def test_the_force_has_the_lowest_of_the_limits(page):
    assert "limit 1.00 N" in page


def test_it_says_who_did_it_and_how_to_do_it_again(page):
    assert "By a script, which led the arm" in page
    assert re.search(r"scalpel-sim run \S+scene\.toml: the same, to the bit", page)


@needs_renderer
def test_it_has_pictures_of_a_run_with_a_task(page):
    assert page.count("data:image/png;base64,iVBOR") == 2
    assert "the plan is violet, and green where the cut is open" in page


@needs_renderer
def test_the_plan_is_drawn_into_the_picture_where_the_camera_sees_it():
    stroke = StrokeTable(kind="traced", points=[tuple(each) for each in POINTS], depth=6e-3)
    scene = changed(SCENES["slab"], strokes=(stroke,))
    planned, plain = (
        np.asarray(Image.open(io.BytesIO(pictures_of(prepare(each))[0].png)).convert("RGB"), int)
        for each in (changed(scene, task=TaskTable(line=LINE, depth=6e-3)), scene)
    )
    changes = np.abs(planned - plain).max(axis=2) > 60
    assert 200 < changes.sum() < 5000
    violet = (planned[changes] - [0x6A, 0x4A, 0xE0]).__abs__().max(axis=1) < 12
    assert violet.sum() > 50, "nothing is open yet"
