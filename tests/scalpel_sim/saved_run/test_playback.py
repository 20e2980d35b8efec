"""A recording is played in a page, and written as files of one instant, without simulating."""

import re

import msgspec
import numpy as np
import pytest

from scalpel_sim import SCENES, RunRecorder, SavedRun, prepare
from scalpel_sim.cli.app import command_line
from scalpel_sim.output.export import ENDINGS
from scalpel_sim.scene.scene import changed
from scalpel_sim.viewer.looks import look_of_scene
from scalpel_sim.viewer.model_shapes import shapes_of
from scalpel_sim.viewer.packing import pack
from tests.scalpel_sim.output.test_export import exported_mesh
from tests.support.browser import local_file
from tissue import read_mesh

LAYERS = changed(SCENES["layers"], seconds=0.2)
"""A body of several labels."""


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    path, simulation = tmp_path_factory.mktemp("recorded") / "run.vtkhdf", prepare(LAYERS)
    with RunRecorder(simulation, path, LAYERS, seconds=0.2):
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


@pytest.mark.parametrize("ending", ENDINGS)
def test_an_instant_is_written_in_each_format_of_surfaces(ending, recorded, tmp_path, capsys):
    path = tmp_path / f"body{ending}"
    assert command_line(["export", str(recorded), "--at", "0.1", "-o", str(path)]) == 0
    assert capsys.readouterr().out == f"{path}: the body at 0.08 s, step 3 of 6\n"
    with SavedRun(recorded) as run:
        expected = run.at(0.1).surface.to_trimesh()
    assert exported_mesh(path).volume == pytest.approx(expected.volume, rel=1e-5)


def test_an_instant_is_written_as_tetrahedra_with_labels_and_their_names(recorded, tmp_path):
    path = tmp_path / "body.vtu"
    assert command_line(["export", str(recorded), "-o", str(path)]) == 0
    mesh = read_mesh(path)
    with SavedRun(recorded) as run:
        step = run.step(-1)
        assert step.time == 0.2 and set(mesh.label_names.values()) == set(run.label_names.values())
    assert np.array_equal(mesh.positions, step.snapshot.positions)
    assert np.array_equal(mesh.labels, step.snapshot.labels) and len(set(mesh.labels)) > 1
    meshio = pytest.importorskip("meshio")
    stress = meshio.read(path).cell_data["stress"][0]
    assert np.array_equal(stress, step.deformation.stress.reshape(-1, 9).astype("f4"))


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--at", "0.21", "-o", "x.stl"], "has no instant 0.21 s; it goes from 0 to 0.2 s"),
        (["-o", "x.dae"], "must end in .vtu, .stl, .obj, .ply, .glb, .usd, .usda or .usdc"),
        (["-o", "nowhere/x.stl"], "there is no folder nowhere"),
    ],
)
def test_an_export_that_is_not_possible_is_refused(words, said, recorded, capsys):
    assert command_line(["export", str(recorded), *words]) == 2
    assert said in capsys.readouterr().err
