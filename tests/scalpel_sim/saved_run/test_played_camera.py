"""Images of a recorded run are those of the run, from the same cameras."""

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from scalpel_sim import SCENES, Camera, RunRecorder, SavedRun, prepare, read_scene
from scalpel_sim.cli.app import command_line
from scalpel_sim.errors import EXIT_OK, EXIT_WRONG_USE
from scalpel_sim.saved_run.played_camera import PlayedCamera
from scalpel_sim.scene.scene import changed
from tests.support.egl import needs_renderer

pytestmark = needs_renderer

EXAMPLES = Path(__file__).parents[3] / "docs" / "examples"

CAMERAS = """
    <camera name="side" pos="0.5 -0.6 0.5" xyaxes="0.8 0.6 0 -0.3 0.4 0.9" fovy="50"/>
    <camera name="flat" projection="orthographic"/>
    <camera name="lens" focal="0.004 0.004" sensorsize="0.005 0.004" resolution="64 48"/>
"""
"""One that stands, and two whose pictures no angle describes."""

SIZE = {"width": 128, "height": 96}

FEW = 0.01
"""Share of pixels that may show another thing: at the rims of round shapes, whose facets are others
than those of MuJoCo."""

DEPTH_ERROR = 5e-5
"""Error of the depth of tissue [m], which is recorded in single precision: that of `Camera`."""


@pytest.fixture(scope="module")
def own_arm(tmp_path_factory):
    """Return the scene of an arm of one's own that carries a camera, and others beside it."""
    folder = tmp_path_factory.mktemp("own_arm")
    model = (EXAMPLES / "robot.xml").read_text()
    model = model.replace("<worldbody>", f"<worldbody>{CAMERAS}", 1)
    hand = model.index("<site")
    carried = '<camera name="wrist" pos="0 -0.05 0.02" euler="2.9 0 0"/>'
    (folder / "robot.xml").write_text(f"{model[:hand]}{carried}{model[hand:]}")
    (folder / "robot.toml").write_text((EXAMPLES / "robot.toml").read_text())
    return read_scene(folder / "robot.toml")


@pytest.fixture(scope="module", params=["own arm", "two hands"])
def recorded(request, own_arm, tmp_path_factory):
    """Return a recording, and what each camera has seen of its last step."""
    scene = own_arm if request.param == "own arm" else SCENES["retract"]
    path, simulation = tmp_path_factory.mktemp("recorded") / "run.vtkhdf", prepare(scene)
    cameras = [Camera(simulation, **SIZE)]
    plain = [name for name in cameras[0].names if name not in ("flat", "lens")]
    cameras = [cameras[0].another(name) for name in plain]
    with RunRecorder(simulation, path, seconds=0.2):
        simulation.run(0.2)
    return path, {each.name: (each.image(), each.ids) for each in cameras}


def test_a_recording_has_the_cameras_and_the_numbers_of_its_run(recorded):
    path, seen = recorded
    with SavedRun(path) as run, PlayedCamera(run, **SIZE) as camera:
        assert camera.names == list(seen)
        for _, ids in seen.values():
            assert dict(camera.ids) == dict(ids)


def test_each_camera_sees_what_it_saw_in_the_run(recorded):
    path, seen = recorded
    with SavedRun(path) as run:
        for name, (image, ids) in seen.items():
            with PlayedCamera(run, name, **SIZE) as camera:
                played = camera.image(run.step(-1))
                differs = played.segmentation != image.segmentation
                assert differs.mean() < FEW, name
                tissue = (image.segmentation > 0) & (image.segmentation < ids["blade"]) & ~differs
                assert tissue.sum() > 10, name
                errors = np.abs(played.depth - image.depth)[tissue]
                assert np.quantile(errors, 0.99) < DEPTH_ERROR, name
                assert np.array_equal(played.rgb, camera.rgb(run.step(-1)))


def test_a_camera_without_an_angle_is_not_there_and_the_others_are_named(own_arm, tmp_path):
    path, simulation = tmp_path / "run.vtkhdf", prepare(own_arm)
    with RunRecorder(simulation, path):
        pass
    with SavedRun(path) as run, pytest.raises(ValueError, match="wrist") as refused:
        PlayedCamera(run, "flat")
    assert "side" in str(refused.value)


def test_snapshot_shows_a_recorded_instant_without_simulating(tmp_path, monkeypatch, capsys):
    path, folder = tmp_path / "out" / "run.vtkhdf", tmp_path / "out"
    folder.mkdir()
    simulation = prepare(changed(SCENES["slab"], seconds=0.2))
    with RunRecorder(simulation, path, seconds=0.2):
        simulation.run(0.2)
    monkeypatch.setattr("scalpel_sim.cli.camera_run.prepare", None)
    files = {kind: tmp_path / f"{kind}.npy" for kind in ("output", "depth", "segmentation")}
    options = [word for kind, file in files.items() for word in (f"--{kind}", str(file))]
    options += ["--width", "128", "--height", "96", "--samples", "0"]
    for name in (path, folder):
        asked = ["snapshot", str(name), "--at", "0.13", *options, "--json"]
        assert command_line(asked) == EXIT_OK
        found = json.loads(capsys.readouterr().out)
        assert (found["time_s"], found["scene"]) == (0.12, "slab")
        with SavedRun(path) as run, PlayedCamera(run, **SIZE) as camera:
            expected = camera.image(run.step(3))
            assert found["ids"] == dict(camera.ids) and found["far_m"] == camera.far
        for file, array in zip(files.values(), expected, strict=True):
            assert np.array_equal(np.load(file), array)
    picture = tmp_path / "end.png"
    assert command_line(["snapshot", str(path), "-o", str(picture), *options[6:]]) == EXIT_OK
    assert "slab after 0.200 s" in capsys.readouterr().out
    with SavedRun(path) as run, PlayedCamera(run, **SIZE) as camera:
        assert np.array_equal(np.asarray(Image.open(picture)), camera.rgb(run.step(-1)))
    for words, said in ((["--at", "0.3"], "has no instant 0.3 s"), (["--toughness", "3"], "tough")):
        assert command_line(["snapshot", str(path), *words]) == EXIT_WRONG_USE
        assert said in capsys.readouterr().err
