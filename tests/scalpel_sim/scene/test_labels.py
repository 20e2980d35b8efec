"""Labels of a scene: parts of the body by region, number or name, and their figures."""

import json

import numpy as np
import pytest

from scalpel_sim.cli.app import command_line
from scalpel_sim.cli.options import BodyOptions, MaterialOptions, TissueOptions
from scalpel_sim.cli.scene_options import chosen_scene
from scalpel_sim.errors import EXIT_OK, EXIT_WRONG_USE, UsageError
from scalpel_sim.preparation.tissue import check_scene, make_tissue
from scalpel_sim.recording.recording import read_forces
from scalpel_sim.scene.labels import labelled
from scalpel_sim.scene.read import read_scene
from scalpel_sim.scene.schema import LabelTable
from tissue import MATERIALS, block, read_mesh, write_mesh

MESH = block((4, 4, 4), (0.04, 0.04, 0.04))
LOW, HIGH = "0,0,0:0.04,0.04,0.02", "0,0,0.02:0.04,0.04,0.04"


def test_regions_name_tetrahedra_by_their_middles_and_the_last_one_counts():
    rows = [
        LabelTable(name="low", region=LOW),
        LabelTable(name="lump", region="sphere:0.02,0.02,0.01,0.008"),
    ]
    mesh = labelled(MESH, rows)
    middles = MESH.positions[MESH.tetrahedra].mean(axis=1)
    lump = np.linalg.norm(middles - [0.02, 0.02, 0.01], axis=1) <= 0.008
    assert mesh.label_names == {1: "low", 2: "lump"}
    np.testing.assert_array_equal(mesh.labels == 2, lump)
    np.testing.assert_array_equal(mesh.labels == 1, (middles[:, 2] < 0.02) & ~lump)


def test_a_label_of_the_mesh_is_meant_by_number_or_by_name():
    given = MESH._replace(labels=np.arange(len(MESH.tetrahedra)) % 2, label_names={1: "fat"})
    assert labelled(given, [LabelTable(name="fat")]).label_names == {1: "fat"}
    named = labelled(given, [LabelTable(name="skin", label=0)])
    assert named.label_names == {0: "skin", 1: "fat"}


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        ([LabelTable(name="fat")], "the mesh has no label 'fat'; it has none"),
        ([LabelTable(name="fat", label=3)], "the mesh has no label 3; it has none"),
        ([LabelTable(name="fat", region="1,1,1:2,2,2")], "no tetrahedron has its middle in region"),
        ([LabelTable(name="a", region=LOW), LabelTable(name="a", region=HIGH)], "occurs twice"),
        ([LabelTable(name="a", region=LOW), LabelTable(name="b", region=LOW)], "hold all of it"),
    ],
)
def test_labels_that_cannot_be_are_refused_by_name(rows, message):
    with pytest.raises(UsageError, match=message):
        labelled(MESH, rows)


TOUGHNESSES = np.array([1136.0, 200.0, 550.0])
"""Of skin, fat and muscle [J/m2]."""


@pytest.fixture(scope="module")
def cut_layers(tmp_path_factory):
    """A strip 4 mm thick of skin, fat and muscle is cut in two."""
    folder = tmp_path_factory.mktemp("layers")
    assert command_line(["run", "layers", "--quiet", "--out", str(folder)]) == EXIT_OK
    return folder


def test_the_force_of_layers_is_the_toughness_of_each(cut_layers):
    force = np.genfromtxt(cut_layers / "forces.csv", delimiter=",", names=True)
    area, felt = force["cut_area_m2"], np.abs(force["force_y_n"])
    # Fat is thin: the edge is held again soon before it comes to muscle.
    found = [
        np.median(felt[(area > 2e-6) & (area < 12e-6)]),
        felt[np.argmax(area > 56e-6)],
        np.median(felt[(area > 80e-6) & (area < 120e-6)]),
    ]
    # In layers of 4 and 12 mm no force is steady; that of two that are cut at once is (5 %).
    np.testing.assert_allclose(found, 0.004 * TOUGHNESSES, rtol=0.06)
    parts = {
        row["name"]: row for row in json.loads((cut_layers / "summary.json").read_text())["labels"]
    }
    found = [parts[name]["cut_area_m2"] for name in ("skin", "fat", None)]
    np.testing.assert_allclose(found, [16e-6, 48e-6, 64e-6], rtol=0.01)


def test_columns_of_labels_have_the_work_and_the_force_of_each(cut_layers):
    forces = read_forces(cut_layers / "forces.csv")
    names = ("1_skin", "2_fat", "0")
    work = np.array([forces.column(f"cutting_{name}_j") for name in names])
    # Skin springs apart before the edge has gone through all of it.
    np.testing.assert_allclose(work[1:, -1], TOUGHNESSES[1:] * [48e-6, 64e-6], rtol=0.05)
    np.testing.assert_allclose(work.sum(axis=0), forces.column("cutting_j"), rtol=1e-9, atol=1e-15)
    area = forces.column("cut_area_m2")
    for name, toughness, low, high, within in (
        ("1_skin", TOUGHNESSES[0], 2e-6, 12e-6, 0.1),  # not steady in 4 mm of it
        ("0", TOUGHNESSES[2], 80e-6, 120e-6, 0.05),
    ):
        felt = forces.column(f"edge_{name}_n")[(area > low) & (area < high)]
        assert np.median(felt) == pytest.approx(0.004 * toughness, rel=within)
    (skin,) = [
        row
        for row in json.loads((cut_layers / "summary.json").read_text())["labels"]
        if row["name"] == "skin"
    ]
    assert skin["work_of_cutting_j"] == work[0, -1]
    assert skin["edge_force_peak_n"] == forces.column("edge_1_skin_n").max()


def test_the_final_mesh_has_the_names_of_its_labels(cut_layers):
    assert read_mesh(cut_layers / "final.vtu").label_names == {1: "skin", 2: "fat"}


def test_a_region_of_a_scene_may_be_a_label(tmp_path):
    path = tmp_path / "held.toml"
    path.write_text(
        """
        [body]
        shape = "block"
        cells = [6, 4, 4]
        size = [0.06, 0.04, 0.04]
        fixed = "label:bone"
        [[label]]
        name = "bone"
        region = "0,0,0:0.01,0.04,0.04"
        [[label]]
        name = "stone"
        region = "0.02,0.01,0.01:0.04,0.03,0.03"
        [[core]]
        where = "label:stone"
        [[attachment]]
        where = "label:stone"
        stiffness = 10.0
        """
    )
    scene = read_scene(path)
    tissue = make_tissue(scene)
    body = tissue.snapshot()
    assert np.array_equal(body.fixed, body.rest_positions[:, 0] < 0.011)
    (core,) = tissue.cores
    np.testing.assert_allclose(core.centre[:2], [0.03, 0.02], atol=1e-3)
    assert len(tissue.attachments[0].points.rest) == 27


def test_a_part_cannot_be_the_region_of_a_label(tmp_path, capsys):
    (tmp_path / "scene.toml").write_text(
        '[body]\nshape = "organ"\n[[label]]\nname = "a"\nregion = "label:b"\n'
    )
    assert command_line(["run", str(tmp_path / "scene.toml")]) == EXIT_WRONG_USE
    assert "it is a box" in capsys.readouterr().err


def test_a_part_that_was_to_be_spared_and_is_cut_is_said(tmp_path, capsys):
    text = """
    [body]
    shape = "block"
    cells = [6, 6, 2]
    size = [0.03, 0.03, 0.008]
    fixed = "left,right"
    [[label]]
    name = "vessel"
    region = "0.01,0,0:0.02,0.03,0.008"
    spare = true
    [[stroke]]
    kind = "straight"
    speed = 0.1
    """
    (tmp_path / "scene.toml").write_text(text)
    out = tmp_path / "out"
    command = ["run", str(tmp_path / "scene.toml"), "--out", str(out)]
    assert command_line(command) == EXIT_OK
    assert "vessel was to be left whole" in capsys.readouterr().err
    summary = json.loads((out / "summary.json").read_text())
    (warning,) = [each for each in summary["warnings"] if each["kind"] == "spared"]
    assert warning["cut_area_m2"] == pytest.approx(summary["cut_area_m2"], rel=1e-6)


def test_a_label_with_number_and_region_is_refused(tmp_path, capsys):
    (tmp_path / "scene.toml").write_text(
        f'[body]\nshape = "organ"\n[[label]]\nname = "a"\nlabel = 1\nregion = "{LOW}"\n'
    )
    assert command_line(["run", str(tmp_path / "scene.toml")]) == EXIT_WRONG_USE
    assert "[[label]] number 1 has label and region" in capsys.readouterr().err


def test_an_option_gives_a_label_of_a_mesh_file_its_material(tmp_path):
    middles = MESH.positions[MESH.tetrahedra].mean(axis=1)
    mesh = MESH._replace(labels=1 + (middles[:, 2] > 0.02))
    write_mesh(tmp_path / "two.vtu", mesh)
    body = BodyOptions(mesh=tmp_path / "two.vtu")
    material = MaterialOptions(material="muscle", label=("2=fat",))
    scene = chosen_scene(None, TissueOptions(body=body, material=material))
    fat, muscle = (MATERIALS[name].material for name in ("fat", "muscle"))
    assert scene.materials == {None: muscle, "fat": fat}
    assert scene.mesh().label_names == {2: "fat"}


@pytest.mark.parametrize(
    ("label", "message"),
    [("2", "has no label and no material"), ("2=ft", "fat"), ("7=fat", "has no label 7")],
)
def test_an_option_for_a_label_that_cannot_be_is_explained(tmp_path, label, message):
    write_mesh(tmp_path / "one.vtu", MESH._replace(labels=np.ones(len(MESH.tetrahedra), np.int64)))
    options = TissueOptions(
        body=BodyOptions(mesh=tmp_path / "one.vtu"),
        material=MaterialOptions(material="muscle", label=(label,)),
    )
    with pytest.raises(UsageError, match=message):
        chosen_scene(None, options).mesh()


def test_labels_of_a_file_that_nothing_uses_are_said(tmp_path, caplog):
    labels = np.arange(len(MESH.tetrahedra)) % 2
    write_mesh(tmp_path / "two.vtu", MESH._replace(labels=labels))
    body = BodyOptions(mesh=tmp_path / "two.vtu")
    check_scene(chosen_scene(None, TissueOptions(body=body)))
    assert "labels, and the body is of one material: 0 of 192 tetrahedra, 1 of 192" in caplog.text


TWO_PARTS = """
[body]
shape = "block"
cells = [8, 8, 4]
size = [0.04, 0.04, 0.02]
fixed = "left,right"
[material]
law = "neo_hookean"
young_modulus = 30e3
toughness = 100.0
[[label]]
name = "liver"
region = "0,0,0:0.02,0.04,0.02"
[[label]]
name = "gallbladder"
region = "0.02,0,0:0.04,0.04,0.02"
[[interface]]
between = ["liver", "gallbladder"]
toughness = 10.0
[[stroke]]
kind = "straight"
speed = 0.1
"""

AGAIN = '[[interface]]\nbetween = ["gallbladder", "liver"]\ntoughness = 1.0\n'


def test_a_run_says_how_much_of_a_layer_is_dissected(tmp_path, capsys):
    (tmp_path / "scene.toml").write_text(TWO_PARTS)
    out = tmp_path / "out"
    assert command_line(["run", str(tmp_path / "scene.toml"), "--out", str(out)]) == EXIT_OK
    assert "liver and gallbladder" in capsys.readouterr().out
    summary = json.loads((out / "summary.json").read_text())
    (layer,) = summary["interfaces"]
    assert layer["area_m2"] == pytest.approx(0.04 * 0.02, rel=1e-9)
    assert layer["cut_area_m2"] == pytest.approx(summary["cut_area_m2"], rel=1e-9)
    assert summary["settings"]["interfaces"][0]["toughness"] == 10.0
    assert summary["work_of_blade_j"] == pytest.approx(10.0 * 0.04 * 0.02, rel=0.05)


def test_the_areas_of_labels_and_layers_add_up_in_the_middle_of_a_cut(tmp_path):
    """There, one face that is cut has all its nodes on the rim: it cannot open, and counts."""
    (tmp_path / "scene.toml").write_text(TWO_PARTS)
    out = tmp_path / "out"
    command = ["run", str(tmp_path / "scene.toml"), "-q", "--seconds", "0.49", "--out", str(out)]
    assert command_line(command) == EXIT_OK
    summary = json.loads((out / "summary.json").read_text())
    (layer,), whole = summary["interfaces"], 0.04 * 0.02
    assert 0.1 * whole < layer["cut_area_m2"] < 0.9 * whole
    assert layer["cut_area_m2"] == pytest.approx(summary["cut_area_m2"], rel=1e-9)
    of_labels = [row["cut_area_m2"] for row in summary["labels"]]
    assert sum(of_labels) == pytest.approx(summary["cut_area_m2"], rel=1e-9)
    assert of_labels[0] == of_labels[1]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('"gallbladder"]', '"liver"]', "number 1 is between 'liver' and itself"),
        ('"gallbladder"]', '"fat"]', "the body has no part 'fat'"),
        ("toughness = 10.0", "toughness = -1.0", "toughness"),
        ("[[stroke]]", f"{AGAIN}[[stroke]]", "the second one between"),
        ("0.02,0,0:", "0.03,0,0:", "share a face"),
    ],
)
def test_an_interface_that_cannot_be_is_refused(tmp_path, capsys, old, new, message):
    (tmp_path / "scene.toml").write_text(TWO_PARTS.replace(old, new))
    assert command_line(["run", str(tmp_path / "scene.toml")]) == EXIT_WRONG_USE
    assert message in capsys.readouterr().err
