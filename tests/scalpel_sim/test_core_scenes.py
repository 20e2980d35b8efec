"""Scenes with `[[core]]`: a stone inside tissue, as a file, and a stroke that comes to it."""

import json

import pytest

from scalpel_sim.cli.app import command_line

FILE = """\
[body]
shape = "block"
cells = [8, 6, 6]
size = [0.04, 0.03, 0.03]
fixed = "bottom"

[material]
law = "neo_hookean"
young_modulus = 20e3
toughness = 20.0
viscous_damping = 40.0

[[core]]
where = "sphere:0.02,0.015,0.015,0.0095"
density = 2000.0

[[stroke]]
kind = "points"
points = [[-0.002, 0.0151, 0.012], [0.04, 0.0151, 0.012]]
length = 0.03
speed = 0.1
force_limit = 1.5
"""
"""An edge through the middle of a stone, with a limit of three times the force of the cut."""


@pytest.fixture(scope="module")
def summary(tmp_path_factory):
    """The summary of a run of that file."""
    folder = tmp_path_factory.mktemp("core")
    (folder / "core.toml").write_text(FILE, encoding="utf-8")
    words = ["run", str(folder / "core.toml"), "-q", "--out", str(folder / "out")]
    assert command_line(words) == 0
    return json.loads((folder / "out" / "summary.json").read_text())


def test_a_stroke_stops_at_a_stone_by_its_limit_of_force(summary):
    (stroke,) = summary["strokes"]
    assert stroke["ended"] == "stopped at the limit of force"
    assert summary["cut_area_m2"] > 1e-4


def test_the_summary_says_how_far_a_stone_was_pushed(summary):
    (core,) = summary["cores"]
    assert core["where"].startswith("sphere")
    assert 1e-4 < core["moved_m"] < 0.01
    assert 0.0 < core["turned_rad"] < 0.5
