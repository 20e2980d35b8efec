"""Scenes of several bodies: what they are made of, what is refused, and the page's example."""

import json
from pathlib import Path

import numpy as np
import pytest

from scalpel_sim.cli.app import command_line
from scalpel_sim.cli.options import TissueOptions
from scalpel_sim.cli.scene_options import chosen_scene
from scalpel_sim.errors import EXIT_OK, EXIT_WRONG_USE, UsageError
from scalpel_sim.preparation.tissue import make_tissue
from scalpel_sim.scene.read import read_scene
from scalpel_sim.scene.scene import changed
from scalpel_sim.scene.write import scene_text
from tissue import MATERIALS, block, write_mesh

PAGE = Path(__file__).parents[3] / "docs" / "scenes.md"
EXAMPLE = PAGE.read_text("utf-8").partition("## Several bodies")[2]
EXAMPLE = EXAMPLE.partition("```toml\n")[2].partition("```")[0]


LAYER = PAGE.read_text("utf-8").partition("### Ties between bodies")[2]
LAYER = LAYER.partition("```toml\n")[2].partition("```")[0]


def written(folder: Path, text: str = EXAMPLE) -> Path:
    path = folder / "scene.toml"
    path.write_text(text, "utf-8")
    return path


def test_the_example_of_the_page_cuts_both_bodies_in_two(tmp_path):
    out = tmp_path / "out"
    command = ["run", str(written(tmp_path)), "--quiet", "--out", str(out)]
    assert command_line(command) == EXIT_OK
    summary = json.loads((out / "summary.json").read_text())
    parts = {row["name"]: row for row in summary["labels"]}
    assert {name: row["pieces"] for name, row in parts.items()} == {
        "muscle": 2,
        "fat": 2,
        "muscle/vessel": 1,
    }
    assert parts["muscle"]["cut_area_m2"] == pytest.approx(0.04 * 0.008, rel=0.05)
    assert parts["fat"]["cut_area_m2"] == pytest.approx(0.035 * 0.006, rel=0.05)
    assert summary["warnings"] == []
    assert [each["held"] for each in summary["each_piece"]] == [True] * 4
    again = tmp_path / "again"
    assert command_line(["run", str(out / "scene.toml"), "-q", "--out", str(again)]) == EXIT_OK
    forces = [
        np.genfromtxt(each / "forces.csv", delimiter=",", names=True) for each in (out, again)
    ]
    for column in ("tip_y_m", "force_y_n", "cut_area_m2"):
        np.testing.assert_array_equal(forces[0][column], forces[1][column])


def test_each_body_has_its_own_material_and_what_it_leaves_out_is_that_of_all(tmp_path):
    text = (
        '[[body]]\nname = "a"\nshape = "block"\ncells = [1, 1, 1]\nsize = [0.01, 0.01, 0.01]\n'
        '[[body]]\nname = "b"\nshape = "block"\ncells = [2, 1, 1]\nsize = [0.02, 0.01, 0.01]\n'
        "pos = [0.02, 0.0, 0.0]\nquat = [0.0, 0.0, 0.0, 1.0]\nmaterial = { density = 1100.0 }\n"
        '[[label]]\nname = "lump"\nbody = "b"\nregion = "0,-1,-1:0.01,1,1"\n'
        "material = { toughness = 3.0 }\n"
        '[material]\npreset = "gelatin"\n'
    )
    scene = read_scene(written(tmp_path, text))
    gelatin = MATERIALS["gelatin"].material
    assert scene.materials == {
        "a": gelatin,
        "b": gelatin.changed(density=1100.0),
        "b/lump": gelatin.changed(density=1100.0, toughness=3.0),
    }
    mesh = scene.mesh()
    assert dict(mesh.label_names) == {1: "a", 2: "b", 3: "b/lump"}
    half = mesh.positions[mesh.tetrahedra[mesh.labels == 3]].mean(axis=1)
    assert (half[:, 0] < 0.01).all() and len(half) == 6
    np.testing.assert_allclose(mesh.positions[8:].max(axis=0), [0.02, 0.0, 0.01], atol=1e-15)


def test_a_scene_of_bodies_reads_back_with_every_number_as_it_was(tmp_path):
    set_keys = ("body.1.material.density=900.0", "body.1.pos=[0.001, 0.002, 0.008]")
    scene = chosen_scene(str(written(tmp_path)), TissueOptions(settings=set_keys))
    assert scene.materials["fat"].density == 900.0
    back = tmp_path / "back.toml"
    back.write_text(scene_text(scene, back), "utf-8")
    found = read_scene(back)
    assert found.materials == scene.materials
    np.testing.assert_array_equal(found.mesh().positions, scene.mesh().positions)
    np.testing.assert_array_equal(found.held_nodes(), scene.held_nodes())
    skipped = ("about", "material")  # one of the file's name, the other that of the first body
    ours, theirs = scene.settings(), found.settings()
    assert {k: v for k, v in ours.items() if k not in skipped} == {
        k: v for k, v in theirs.items() if k not in skipped
    }


def test_labels_of_files_are_numbers_of_one_body(tmp_path):
    cube = block((2, 2, 2), (0.02, 0.02, 0.02))
    labels = np.arange(len(cube.tetrahedra)) % 2 + 4
    write_mesh(tmp_path / "cube.vtu", cube._replace(labels=labels))
    row = 'shape = "mesh"\nfile = "cube.vtu"\n'
    text = (
        f'[[body]]\nname = "one"\n{row}[[body]]\nname = "other"\n{row}pos = [0.02, 0.0, 0.0]\n'
        '[[label]]\nname = "vessel"\nbody = "other"\nlabel = 5\n'
    )
    mesh = read_scene(written(tmp_path, text)).mesh()
    assert list(mesh.label_names.values()) == ["one/4", "one/5", "other/4", "other/vessel"]
    np.testing.assert_array_equal(mesh.labels, np.concatenate([labels - 3, labels - 1]))


def test_attachments_and_cores_are_of_one_body(tmp_path):
    text = EXAMPLE + (
        '[[attachment]]\nwhere = "top"\nbody = "muscle"\nstiffness = 10.0\n'
        '[[attachment]]\nwhere = "top"\nstiffness = 10.0\n'
    )
    tissue = make_tissue(read_scene(written(tmp_path, text)))
    assert [each.n_points for each in tissue.attachments] == [11 * 9, 10 * 8]


def test_a_body_hangs_from_another_by_the_layer_of_the_page(tmp_path):
    tissue = make_tissue(read_scene(written(tmp_path, LAYER)))
    (tie,) = tissue.attachments
    assert tie.n_points == 2 * 6 * 5 and tie.sections.sum() == pytest.approx(0.03 * 0.025)
    tissue.step(None, 1e-3)
    weight = 9.81 * tissue.pieces()[1].mass
    np.testing.assert_allclose(tie.wrench.force, [0.0, 0.0, -weight], atol=0.01 * weight)


def test_a_tie_names_two_bodies(tmp_path):
    for old, new, message in (
        ('body = "lump"\n', "", "has to_body and no other body"),
        ("toughness = 4.0", "", "has to_body and no toughness"),
        ('to_body = "bed"', 'to_body = "bd"', "Did you mean 'bed'"),
        ('to_body = "bed"', 'to_body = "bed"\nto = [0, 0, 0]', "has to_body and to;"),
    ):
        text = LAYER.replace(old, new)
        assert text != LAYER
        with pytest.raises(UsageError, match=message):
            read_scene(written(tmp_path, text))
    far = LAYER.replace('to_body = "bed"', 'to_body = "bed"\nwithin = 1e-4')
    with pytest.raises(UsageError, match=r"\[\[attachment\]\] number 1: no skin of the one body"):
        make_tissue(read_scene(written(tmp_path, far)))


WRONG = {
    "overlap": ("0.0025, 0.008]", "0.0025, 0.0079]", "'muscle' and 'fat' overlap, by 0.1 mm"),
    "one name twice": ('name = "fat"', 'name = "muscle"', "two of [[body]] are called muscle"),
    "no name": ('name = "fat"', "", "[[body]] number 2 has no name"),
    "no size": ("size = [0.045, 0.035, 0.006]", "", 'number 2 of shape "block" has no size'),
    "a wrong key": ("pos = [", "place = [", "place"),
    "a wrong value": ("pos = [0.0025,", "pos = [", "[[body]] number 2 pos is [0.0025, 0.008]"),
    "no turn": ("pos = [", "quat = [0, 0, 0, 0]\npos = [", "number 2 quat is [0, 0, 0, 0]"),
    "a stretch": ("pos = [", "stretch = 0.1\npos = [", "stretch"),
    "nothing to weld": ("pos = [", "weld = true\npos = [", "body 'fat' cannot be welded"),
    "no such side": ('fixed = "bottom"', 'fixed = "under"', "of 'muscle': "),
    "a label of no body": ('body = "muscle"\n', "", "[[label]] number 1 has no body"),
    "an unknown body": ('body = "muscle"', 'body = "muscl"', "Did you mean 'muscle'"),
    "a region beside": ("0.038,0", "0.1,0", "no tetrahedron of body 'muscle' has its middle"),
    "two laws": ('preset = "fat"', 'law = "neo_hookean"', "label 2 ('fat') has law neo_hookean"),
    "nothing below": (
        "0.0025, 0.008]",
        "0.1, 0.008]\nfixed = 'none'",
        "Nothing holds the piece that it belongs to",
    ),
}


@pytest.mark.parametrize("name", WRONG)
def test_wrong_bodies_get_one_line_that_says_what_is_wrong(name, tmp_path, capsys):
    old, new, expected = WRONG[name]
    assert EXAMPLE.count(old) == 1
    text = EXAMPLE.replace(old, new)
    if "fixed = 'none'" in new:
        text = text.replace('fixed = "left,right"\n', "")
    words = ["run", str(written(tmp_path, text)), "--out", str(tmp_path / "out")]
    assert command_line(words) != EXIT_OK
    lines = [line for line in capsys.readouterr().err.splitlines() if line.startswith("error: ")]
    assert len(lines) == 1 and expected in lines[0]


TWO_HANDS = """
[[body]]
name = "muscle"
shape = "block"
cells = [12, 8, 2]
size = [0.06, 0.04, 0.010]
fixed = "bottom"
material = { preset = "muscle", law = "neo_hookean", toughness = 20.0 }

[[body]]
name = "flap"                                 # lies on the muscle, and reaches beyond it
shape = "block"
cells = [12, 6, 2]
size = [0.06, 0.03, 0.009]
pos = [0.02, 0.005, 0.010]
fixed = "left"
material = { preset = "gelatin" }

[[grasper]]
closed = 0.0085
motion = [
  { time = 0, at = [0.11, 0.02, 0.0145], approach = [-1, 0, 0], across = [0, 0, 1], opening = 0.02},
  { time = 0.4, at = [0.077, 0.02, 0.0145] },
  { time = 0.7, opening = 0.008 },
  { time = 2.4 },
  { time = 2.9, at = [0.09, 0.02, 0.03] },
]

[[stroke]]
kind = "points"
points = [[0.035, -0.012, 0.004], [0.035, 0.055, 0.004]]
edge = [0.0, 0.0, 1.0]
forward = [0.0, 1.0, 0.0]
length = 0.03
speed = 0.05
wait = 0.7
"""
"""One hand holds the end of a flap, the other cuts it off, and 6 mm into what lies under it."""


def test_two_hands_meet_two_bodies(tmp_path):
    out = tmp_path / "out"
    scene = written(tmp_path, TWO_HANDS)
    assert command_line(["run", str(scene), "-q", "--seconds", "3.2", "--out", str(out)]) == EXIT_OK
    summary = json.loads((out / "summary.json").read_text())
    muscle, flap = summary["labels"]
    assert (muscle["pieces"], flap["pieces"]) == (1, 2)
    assert muscle["cut_area_m2"] == pytest.approx(0.04 * 0.006, rel=0.1)
    assert flap["cut_area_m2"] == pytest.approx(0.03 * 0.009, rel=0.05)
    loose = max((each for each in summary["each_piece"] if not each["held"]), key=volume_of)
    weight = loose["volume_m3"] * MATERIALS["gelatin"].material.density * 9.81
    rows = np.genfromtxt(out / "forces.csv", delimiter=",", names=True)
    held = rows["left_force_z_n"][-200:].mean()
    assert held == pytest.approx(-weight, rel=0.05)  # of the tissue on the grasper


def volume_of(piece):
    return piece["volume_m3"]


def test_options_of_one_body_are_refused(tmp_path, capsys):
    words = ["run", str(written(tmp_path)), "--fix", "bottom", "--out", str(tmp_path / "out")]
    assert command_line(words) == EXIT_WRONG_USE
    expected = "--fix: the scene has 2 of these, each with 'fixed'; say which, 0 to 1, as in --set"
    assert expected in capsys.readouterr().err
    with pytest.raises(UsageError, match="stretch is of one body, and the scene has several"):
        changed(read_scene(written(tmp_path)), stretch=0.1)
