"""`scalpel-sim trace` writes a scene whose stroke goes along a line in an image."""

import json

import numpy as np
import pytest

from scalpel_sim import SCENES, Camera, pixels_to_points, prepare, read_scene
from scalpel_sim.cli.app import command_line
from scalpel_sim.errors import EXIT_OK, EXIT_WRONG_USE
from tests.support.egl import needs_renderer

pytestmark = needs_renderer

SMALL = ["--camera", "endoscope", "--width", "96", "--height", "64", "--samples", "0"]
LINE = [(40.0, 30.0), (52.0, 33.0)]


def test_the_scene_has_the_points_that_the_pixels_show(tmp_path, capsys):
    path = tmp_path / "cut.toml"
    pixels = [word for x, y in LINE for word in ("--pixel", f"{x},{y}")]
    asked = ["trace", "slab", *SMALL, *pixels, "--depth", "0.004", "-o", str(path), "--json"]
    assert command_line(asked) == EXIT_OK
    printed = json.loads(capsys.readouterr().out)["points_m"]
    camera = Camera(prepare(SCENES["slab"]), "endoscope", width=96, height=64)
    expected = pixels_to_points(camera, LINE)
    (stroke,) = read_scene(path).strokes
    assert stroke.kind == "traced" and stroke.depth == 0.004
    np.testing.assert_allclose(stroke.points, expected, atol=1e-9)
    np.testing.assert_allclose(printed, expected, atol=1e-9)


@pytest.mark.parametrize(
    ("pixels", "message"),
    [(["40;30", "52,33"], "write COLUMN,ROW"), (["1,1", "52,33"], "shows no tissue")],
)
def test_a_pixel_that_means_nothing_is_refused(tmp_path, capsys, pixels, message):
    words = [word for each in pixels for word in ("--pixel", each)]
    path = tmp_path / "cut.toml"
    asked = ["trace", "slab", *SMALL, *words, "--depth", "0.004", "-o", str(path)]
    assert command_line(asked) == EXIT_WRONG_USE
    assert message in capsys.readouterr().err and not path.exists()
