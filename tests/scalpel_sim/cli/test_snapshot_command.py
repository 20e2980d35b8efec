"""`scalpel-sim snapshot` writes an image of a scene at one instant."""

import json

import numpy as np
import pytest
from PIL import Image

from scalpel_sim import SCENES, Camera, prepare
from scalpel_sim.cli.app import command_line
from scalpel_sim.errors import EXIT_OK, EXIT_WRONG_USE
from tests.support.egl import needs_renderer

pytestmark = needs_renderer

SMALL = ["--width", "96", "--height", "64", "--samples", "0"]


@pytest.fixture(scope="module")
def taken():
    """Return what a camera sees of the slab after 60 ms, and its numbers."""
    simulation = prepare(SCENES["slab"])
    camera = Camera(simulation, "endoscope", width=96, height=64)
    simulation.run(0.06)
    return camera.image(), camera


def test_its_files_hold_what_a_camera_sees_at_that_instant(taken, tmp_path, capsys):
    image, camera = taken
    names = ("a.png", "depth.png", "depth.npy", "ids.png", "ids.npy")
    rgb, depth_png, depth_npy, ids_png, ids_npy = (tmp_path / name for name in names)
    asked = ["snapshot", "slab", "--at", "0.06", "--camera", "endoscope", *SMALL, "-o", str(rgb)]
    for depth, ids in ((depth_png, ids_png), (depth_npy, ids_npy)):
        files = ["--depth", str(depth), "--segmentation", str(ids)]
        assert command_line([*asked, *files, "--json"]) == EXIT_OK
        found = json.loads(capsys.readouterr().out)
    assert (np.asarray(Image.open(rgb)) == image.rgb).all()
    assert (np.load(depth_npy) == image.depth).all()
    assert (np.load(ids_npy) == image.segmentation).all()
    with Image.open(ids_png) as picture:
        assert (np.asarray(picture) == image.segmentation).all()
        assert json.loads(picture.text["ids"]) == dict(camera.ids) == found["ids"]
        assert (
            picture.mode == "P"
            and len(np.unique(np.asarray(picture.convert("RGB")).reshape(-1, 3), axis=0)) > 3
        )
    steps, there = np.asarray(Image.open(depth_png)), image.segmentation > 0
    assert steps.dtype == np.uint16 and (steps[~there] == 0).all()
    assert np.abs(1e-4 * steps - image.depth)[there].max() <= 0.51e-4
    assert found["time_s"] == pytest.approx(0.06) and found["renderer"] == camera.renderer
    assert found["pixels"]["skin"] == (image.segmentation == camera.ids["skin"]).sum()


def test_it_says_in_a_line_what_is_to_be_seen(tmp_path, capsys):
    path = tmp_path / "slab.png"
    asked = ["snapshot", "slab", "--at", "0", *SMALL, "--output", str(path)]
    assert command_line(asked) == EXIT_OK
    (line,) = capsys.readouterr().out.splitlines()
    assert line.startswith(f"{path}: slab after 0.000 s: ") and "skin" in line and "blade" in line


def test_of_a_run_in_a_folder_it_shows_that_instant(taken, tmp_path, capsys):
    out, path = tmp_path / "out", tmp_path / "a.png"
    assert command_line(["run", "slab", "--seconds", "0.1", "-q", "--out", str(out)]) == EXIT_OK
    asked = ["snapshot", str(out), "--at", "0.06", "--camera", "endoscope", *SMALL, "-o", str(path)]
    assert command_line(asked) == EXIT_OK
    assert (np.asarray(Image.open(path)) == taken[0].rgb).all()
    assert command_line([*asked, "--toughness", "3"]) == EXIT_WRONG_USE
    assert "toughness" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--camera", "overvew"], "Did you mean 'overview'"),
        (["--output", "a.jpg"], "must end in .png"),
        (["--depth", "a.tif"], "--depth is a.tif"),
        (["--at", "-1"], "--at is -1.0"),
        (["--width", "0"], "an image of 0 x 480 pixels"),
        (["--output", "nowhere/a.png"], "there is no folder nowhere"),
    ],
)
def test_what_cannot_be_is_refused_before_anything_is_cut(
    options, message, tmp_path, monkeypatch, capsys
):
    monkeypatch.chdir(tmp_path)
    assert command_line(["snapshot", "slab", *options]) == EXIT_WRONG_USE
    assert message in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []
