"""A recording is played in a page, without simulating."""

import re

import msgspec
import numpy as np
import pytest

from scalpel_sim import SCENES, RunRecorder, SavedRun, prepare
from scalpel_sim.cli.app import command_line
from scalpel_sim.scene.scene import changed
from scalpel_sim.viewer.looks import look_of_scene
from scalpel_sim.viewer.model_shapes import shapes_of
from scalpel_sim.viewer.packing import pack
from tests.support.browser import local_file

LAYERS = changed(SCENES["layers"], seconds=0.2)
"""A body of several labels."""


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    path, simulation = tmp_path_factory.mktemp("recorded") / "run.vtkhdf", prepare(LAYERS)
    with RunRecorder(simulation, path, seconds=0.2):
        simulation.run(0.2)
    return path


def packets(path):
    return re.findall(r'data-time="([^"]+)"', path.read_text())


def test_a_page_has_a_frame_for_each_step(recorded, tmp_path, capsys):
    page = tmp_path / "page.html"
    assert command_line(["replay", str(recorded), "-o", str(page)]) == 0
    assert capsys.readouterr().out == f"{page}: open it in a browser\n"
    opening, *times = packets(page)
    assert float(opening) == 0.0
    assert [float(time) for time in times] == [0.0, 0.04, 0.08, 0.12, 0.16, 0.2]


def test_of_a_folder_its_replay_or_its_one_recording_is_played(recorded, tmp_path, capsys):
    folder = recorded.parent
    assert command_line(["replay", str(folder)]) == 0
    assert len(packets(recorded.with_suffix(".html"))) == 7
    (folder / "replay.html").write_text("the run's own")
    assert command_line(["replay", str(folder)]) == 0
    assert f"{folder / 'replay.html'}: open" in capsys.readouterr().out
    assert command_line(["replay", str(tmp_path)]) == 2
    assert "has neither a replay nor a recording" in capsys.readouterr().err
    assert command_line(["export", str(tmp_path), "-o", "x.stl"]) == 2
    assert "has no recording; `scalpel-sim run --record run.vtkhdf`" in capsys.readouterr().err
    for name in ("a", "b"):
        (tmp_path / f"{name}.vtkhdf").touch()
    for words in (["replay", str(tmp_path)], ["export", str(tmp_path), "-o", "x.stl"]):
        assert command_line(words) == 2
        assert "choose one of a.vtkhdf, b.vtkhdf" in capsys.readouterr().err


def test_shapes_are_read_as_they_were(recorded):
    expected = list(shapes_of(prepare(LAYERS).arm.model))
    with SavedRun(recorded) as run:
        assert run.stage.look == look_of_scene(LAYERS)
        for shape, other in zip(run.stage.shapes, expected, strict=True):
            assert pack(shape) == pack(other)


def test_all_but_the_page_can_be_read_where_shapes_have_another_form(recorded, tmp_path, capsys):
    import h5py

    path = tmp_path / "old.vtkhdf"
    path.write_bytes(recorded.read_bytes())
    with h5py.File(path, "r+") as file:
        del file["scalpel_sim/stage"]
        file["scalpel_sim/stage"] = np.frombuffer(msgspec.msgpack.encode({}), np.uint8)
    assert command_line(["export", str(path), "-o", str(tmp_path / "body.vtu")]) == 0
    assert command_line(["replay", str(path)]) == 2
    assert re.search("shapes of the arm in another form.*cannot be drawn", capsys.readouterr().err)


@pytest.mark.browser
def test_the_slider_of_the_page_goes_forward_and_back(recorded, tab, tmp_path):
    page = tmp_path / "page.html"
    assert command_line(["replay", str(recorded), "-o", str(page)]) == 0
    tab.goto(local_file(page))
    tab.wait_for_function("typeof player !== 'undefined' && player.shown >= 0")
    with SavedRun(recorded) as run:
        for time, number in ((0.16, 4), (0.05, 1), (0.2, 5), (0.0, 0)):
            seek = "(s, t) => { s.value = t; s.dispatchEvent(new Event('input')); }"
            tab.locator("#scrubber").evaluate(seek, time)
            assert not tab.evaluate("player.isPlaying")
            assert tab.evaluate("player.shown") == number
            force = np.linalg.norm(run.step(number).wrench.force)
            assert tab.text_content("#force") == f"{force:.2f} N"
