"""What a client knows of a scene whose tissue is in another process: of a file, or by its name."""

import json

import pytest

from bridge import InProcessLink, LinkError, SceneView
from scalpel_sim import read_scene
from scalpel_sim.cli.app import command_line
from scalpel_sim.preparation.tissue import make_tissue
from scalpel_sim.recording.recording import read_forces
from scalpel_sim.scene.read import SCENES
from scalpel_sim.scene.scene import changed
from scalpel_sim.scene.schema import ViewTable
from scalpel_sim.scene.served import scene_of
from tests.scalpel_sim.served_scenes import address_of_server, served
from tests.support.run_files import assert_same_run

FILE = """\
seconds = 0.35
[body]
shape = "block"
cells = [6, 4, 2]
size = [0.06, 0.04, 0.01]
fixed = "left,right,front"

[material]
preset = "gelatin"

[[label]]
name = "far part"
region = "0,0.03,0:0.06,0.04,0.01"

[world]
table = -0.014

[[grasper]]
name = "left"
closed = 0.0105
motion = [
  { time = 0, at = [0.03, 0.05, 0.005], opening = 0.02, approach = [0, -1, 0], across = [0, 0, 1] },
  { time = 0.1, at = [0.03, 0.038, 0.005] },
  { time = 0.2, opening = 0.008 },
  { time = 0.35, at = [0.03, 0.038, 0.009] },
]

[[stroke]]
kind = "points"
points = [[0.056, 0.045, -0.008], [0.056, 0.02, -0.008]]
length = 0.035

[[view]]
name = "from above"
eye = [0.03, 0.02, 0.2]
target = [0.03, 0.02, 0.0]
up = [0.0, 1.0, 0.0]
"""


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    path = tmp_path_factory.mktemp("served") / "mine.toml"
    path.write_text(FILE, encoding="utf-8")
    return path


def test_a_scene_in_a_file_runs_with_its_tissue_elsewhere_as_it_does_here(path):
    here, there = path.parent / "here", path.parent / "there"
    scene = changed(read_scene(path), audit=True)  # as `run` has it
    words = ["run", str(path), "-q", "--out"]
    assert command_line([*words, str(here)]) == 0
    assert command_line([*words, str(there), "--connect", address_of_server(scene)]) == 0
    assert_same_run(here, there)
    theirs = read_forces(there / "forces.csv")
    assert theirs.column("cutting_0_j")[-1] > 0.0 and theirs.of_label(1)[1] > 0.0
    assert theirs.column("left_points").max() > 0 and theirs.column("cut_area_m2")[-1] > 0.0
    of_hands = [json.loads((each / "summary.json").read_text())["hands"] for each in (here, there)]
    assert of_hands[0] == of_hands[1] and of_hands[0][0]["points_held_most"] > 0


def test_a_file_of_another_scene_than_the_one_that_is_served_is_refused(path, capsys):
    address = address_of_server(SCENES["grid2"])
    assert command_line(["run", str(path), "--connect", address]) == 2
    assert "the body there is that of 'grid2', not of 'mine'" in capsys.readouterr().err


def test_the_file_is_read_before_the_server_is_asked(path, capsys):
    wrong = path.with_name("wrong.toml")
    wrong.write_text("[bdoy]", encoding="utf-8")
    assert command_line(["run", str(wrong), "--connect", "127.0.0.1:1"]) == 2
    assert "body" in capsys.readouterr().err


def test_a_client_that_knows_the_scene_by_name_has_its_graspers_and_the_views_of_the_server():
    above = ViewTable(name="above", eye=(0.0, 0.0, 1.0), target=(0.0, 0.0, 0.0), up=(0, 1, 0))
    scene = changed(SCENES["retract"], views=(above,))
    with served(scene) as link:
        found = scene_of(link)
    assert found.graspers == scene.graspers and found.strokes == scene.strokes
    assert found.views == (above,)


def test_a_client_that_does_not_know_the_scene_has_its_views(path):
    scene = read_scene(path)
    with served(scene) as link:
        found = scene_of(link)
    assert found.name == "mine" and found.views == scene.views and len(found.views) == 1


@pytest.mark.parametrize(
    ("view", "said"),
    [
        (("a", (0.0, 0.0, 1.0), (0.0, 0.0, 1.0), (0.0, 1.0, 0.0), 38.0), "its eye at its target"),
        (("a", (0.0, 0.0, 1.0), (0.0, 0.0, 0.0), (0.0, 0.0, 1.0), 38.0), "looks along its up"),
        (("a" * 50, (0.0, 0.0, 1.0), (0.0, 0.0, 0.0), (0.0, 1.0, 0.0), 38.0), "name"),
    ],
)
def test_a_view_that_shows_nothing_is_refused_with_the_name_of_who_sent_it(view, said):
    link = InProcessLink(make_tissue(SCENES["grid2"]), "grid2", [SceneView(*view)])
    with pytest.raises(LinkError, match=f"the server sends a view that cannot be used: .*{said}"):
        scene_of(link)


def test_a_name_with_a_dot_is_that_of_its_scene_over_a_link():
    scene = changed(SCENES["grid2"], name="grid.2")
    with served(scene) as link:
        assert link.describe().scene == "grid_2"
        assert scene_of(link, scene).name == "grid.2"
        assert scene_of(link).name == "grid_2"
