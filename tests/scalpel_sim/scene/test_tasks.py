"""Tasks that come with the project: each is a scene, and what its script does solves it."""

import re

import numpy as np
import pytest

from scalpel_sim import prepare, scene_called
from scalpel_sim.arm.grasper import HALF_PAD
from scalpel_sim.cli.app import app, command_line
from scalpel_sim.instruments.guarded_follower import ENDED
from scalpel_sim.scene.read import (
    SHIPPED_SCENES,
    TASK_SCENES,
    read_scene_file,
    scene_in,
    shipped_path,
)
from scalpel_sim.scene.vary_table import OF_START
from scalpel_sim.scene.write import scene_text
from scalpel_sim.strokes.scene_stroke import stroke_through

HALF_WIDTH = 5e-3
"""Half the width of a grasper across its shaft and its opening, and of a jaw [m], at most."""

REST = 0.1
"""Time after the strokes, in which what was cut comes to rest [s]."""


def test_every_file_of_tasks_is_a_scene_by_its_name_and_version():
    files = {path.stem for path in shipped_path("incise-v0").parent.glob("*.toml")}
    assert files == set(TASK_SCENES)
    assert not files & set(SHIPPED_SCENES)
    assert all(re.fullmatch(r"[a-z_]+-v\d+", name) for name in TASK_SCENES)


def test_the_help_names_every_task(capsys):
    app(["run", "--help"], exit_on_error=False, result_action="return_value")
    help_of_run = re.sub(r"[\s│]+", " ", capsys.readouterr().out)
    assert all(name in help_of_run for name in TASK_SCENES)


def has_ended(simulation):
    """Return whether its strokes have ended, where they end otherwise than by the clock."""
    progress = simulation.blade.progress
    return progress is not None and progress.mode == ENDED


@pytest.mark.parametrize("name", TASK_SCENES)
def test_what_the_script_of_a_task_does_solves_it(name):
    simulation = prepare(scene_called(name), records=False)
    assert simulation.score.failed(), "it is not solved as it begins"
    simulation.run(simulation.duration, has_ended)
    simulation.run(simulation.time + REST)
    assert simulation.score.failed() == []


@pytest.mark.parametrize("name", TASK_SCENES)
def test_a_task_is_of_the_size_that_can_be_learned_on(name):
    assert 400 <= len(scene_called(name).mesh().tetrahedra) <= 1500


@pytest.mark.parametrize("name", TASK_SCENES)
def test_a_task_that_is_written_reads_back_the_same(name, tmp_path):
    scene, path = scene_called(name), tmp_path / "scene.toml"
    path.write_text(scene_text(scene, path), encoding="utf-8")
    assert scene_in(read_scene_file(path)).settings() == scene.settings()


@pytest.mark.parametrize("name", [n for n in TASK_SCENES if scene_called(n).graspers])
def test_no_start_of_a_task_has_two_instruments_in_one_place(name):
    scene = scene_called(name)
    blade = stroke_through(scene.mesh(), scene.strokes).pose(0.0)
    moved = {row.hand: np.zeros(3) for row in scene.vary if row.what in OF_START}
    for row in scene.vary:
        if row.what in OF_START:
            moved[row.hand][OF_START.index(row.what)] = np.abs(row.range).max()
    along_edge = np.linspace(blade.tip, blade.heel, 50)
    for grasper in scene.graspers:
        begins = grasper.motion[0]
        ahead, across = np.array(begins.approach), np.array(begins.across)
        axes = np.array([ahead, across, np.cross(ahead, across)])
        from_pads = (along_edge - begins.at) @ axes.T
        half = np.array([HALF_PAD, 0.5 * begins.opening + HALF_WIDTH, HALF_WIDTH])
        beyond = np.abs(from_pads) - half
        beyond[:, 0] = from_pads[:, 0] - HALF_PAD  # behind the jaws is the shaft
        distance = np.linalg.norm(np.maximum(beyond, 0.0), axis=1).min()
        assert distance > np.linalg.norm(sum(moved.values(), np.zeros(3)))


def test_a_new_scene_may_be_that_of_a_task(tmp_path):
    path = tmp_path / "mine.toml"
    assert command_line(["new", str(path), "--from", "incise-v0"]) == 0
    assert path.read_text() == shipped_path("incise-v0").read_text()
