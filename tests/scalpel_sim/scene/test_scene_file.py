"""Scenes as files: those that come with the project, layers over them, and what a run writes."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from scalpel_sim import SCENES, prepare, read_scene
from scalpel_sim.cli.app import command_line
from scalpel_sim.cli.options import ArmOptions, BodyOptions, TissueOptions
from scalpel_sim.cli.scene_options import chosen_scene
from scalpel_sim.errors import UsageError
from scalpel_sim.scene.case import CaseContent
from scalpel_sim.scene.page import with_tables
from scalpel_sim.scene.read import (
    SHIPPED_SCENES,
    read_scene_file,
    scene_in,
    shipped_path,
    shipped_scene,
    with_environment,
    with_settings,
)
from scalpel_sim.scene.scene import Scene, changed
from scalpel_sim.scene.schema import ViewTable
from scalpel_sim.scene.write import scene_text
from scalpel_sim.tables.problems import kinds_of
from tissue import pieces_of

ROOT = Path(__file__).parents[3]
SLAB = shipped_scene("slab")


def changed_by(*settings):
    return scene_in(with_settings(SLAB, settings))


def read_back(scene, path):
    path.write_text(scene_text(scene, path), encoding="utf-8")
    return scene_in(read_scene_file(path))


# Those that come with the project


def test_every_shipped_file_is_a_scene_by_its_name():
    files = {path.stem for path in shipped_path("organ").parent.glob("*.toml")}
    assert files == set(SHIPPED_SCENES)
    assert [scene.name for scene in SCENES.values()] == list(SHIPPED_SCENES)


# What a run writes


@pytest.mark.parametrize("name", SHIPPED_SCENES)
def test_a_scene_that_is_written_reads_back_the_same(name, tmp_path):
    scene = SCENES[name]
    found = read_back(scene, tmp_path / "scene.toml")
    assert found.settings() == scene.settings()
    assert (found.name, found.graspers, found.views) == (scene.name, scene.graspers, scene.views)
    np.testing.assert_array_equal(found.mesh().positions, scene.mesh().positions)
    np.testing.assert_array_equal(found.mesh().tetrahedra, scene.mesh().tetrahedra)


def test_odd_numbers_read_back_to_the_same_bits(tmp_path):
    bevel = np.nextafter(0.3, 1.0)
    scene = SCENES["organ"]
    odd = changed(
        scene,
        material=scene.material.changed(young_modulus=1e4 / 3.0, prony=((1 / 3, 0.1),)),
        blade=replace(scene.blade, bevel_angle=float(bevel)),
        floor=-0.1,
        seconds=0.1 + 0.2,
        views=(
            ViewTable(name="Ä 1", eye=(1 / 3, 0.0, 0.0), target=(0.0, 0.1, 0.0)),
            ViewTable(
                name="above",
                eye=(0.0, 0.0, 0.3),
                target=(0.0, 0.0, 0.0),
                up=(0.0, 1.0, 0.0),
                fov_degrees=100 / 3,
            ),
        ),
    )
    assert read_back(odd, tmp_path / "scene.toml").settings() == odd.settings()


def test_files_of_a_scene_are_found_from_where_it_is_written(tmp_path, monkeypatch):
    (tmp_path / "in").mkdir()
    (tmp_path / "out").mkdir()
    (tmp_path / "in" / "mesh.vtk").write_text(ONE_TETRAHEDRON)
    (tmp_path / "in" / "way.csv").write_text(WAY)
    (tmp_path / "in" / "scene.toml").write_text(
        '[body]\nshape = "mesh"\nfile = "mesh.vtk"\n[[stroke]]\nkind = "recorded"\nfile = "way.csv"'
    )
    monkeypatch.chdir(tmp_path / "in")
    scene = chosen_scene("scene.toml", TissueOptions())
    found = read_back(scene, tmp_path / "out" / "scene.toml")
    assert Path(found.strokes[0].file).resolve() == tmp_path / "in" / "way.csv"
    monkeypatch.chdir(tmp_path)
    assert len(scene_in(read_scene_file(tmp_path / "out" / "scene.toml")).mesh().tetrahedra) == 1


# Layers


def test_a_later_layer_overrides_an_earlier_one(tmp_path, monkeypatch):
    path = tmp_path / "mine.toml"
    path.write_text('[body]\nshape = "organ"\n[material]\npreset = "fat"\n[world]\ngravity = 1.0\n')
    monkeypatch.setenv("SCALPEL_SIM__WORLD__GRAVITY", "2")
    assert chosen_scene(str(path), TissueOptions()).world.gravity == 2.0
    set_too = TissueOptions(settings=("world.gravity=3",))
    assert chosen_scene(str(path), set_too).world.gravity == 3.0
    optioned = TissueOptions(settings=("world.gravity=3",), body=BodyOptions(gravity=4.0))
    assert chosen_scene(str(path), optioned).world.gravity == 4.0


def test_gravity_is_a_number_downwards_or_a_vector():
    assert chosen_scene("slab", TissueOptions()).world.free_fall == (0.0, 0.0, -9.81)
    vector = BodyOptions(gravity="1,2,-3.5")
    assert chosen_scene("slab", TissueOptions(body=vector)).world.free_fall == (1.0, 2.0, -3.5)
    assert changed_by("world.gravity=[0, 0, 9]").world.free_fall == (0.0, 0.0, 9.0)
    for text, why in (("1,2", "a vector of three"), ("-9.81", "0 or more"), ("x", "is 'x'; write")):
        with pytest.raises(UsageError, match=why):
            chosen_scene("slab", TissueOptions(body=BodyOptions(gravity=text)))
    with pytest.raises(UsageError, match="gravity is 200 m/s2; it must be at most 100"):
        changed_by("world.gravity=[0, 200, 0]")


def test_a_value_is_one_of_toml_or_a_text():
    scene = changed_by("material.toughness=5", "body.fixed=bottom", "solver.audit=true")
    assert (scene.material.toughness, scene.body.fixed, scene.solver.audit) == (5.0, "bottom", True)
    assert changed_by("body.cells=[2, 3, 2]").mesh().tetrahedra.shape == (72, 4)
    assert changed_by('material.law="neo_hookean"').material.law.name == "neo_hookean"


def test_the_stretch_of_other_sides_is_dropped_unless_it_is_given():
    assert changed_by("body.fixed=bottom").body.stretched_by == 0.0
    assert changed_by("body.fixed=front,back", "body.stretch=0.1").body.stretched_by == 0.1
    assert changed_by("body.stretch=0.2").body.stretched_by == 0.2


def test_rows_are_counted_from_zero_and_the_usual_stroke_is_one():
    assert changed_by("stroke.0.speed=0.1").strokes[0].speed == 0.1
    bare = SLAB._replace(content={"body": SLAB.content["body"]})
    assert scene_in(with_settings(bare, ["stroke.0.kind=press"])).stroke == "press"


@pytest.mark.parametrize(
    ("setting", "expected"),
    [
        ("body.strech=1", "--set body.strech=1: no key of [body] is called 'strech'. Did you mean"),
        (
            "material.toughness=-1",
            "--set material.toughness=-1: [material] toughness is -1; it must be a number, 0",
        ),
        ("stroke.1.kind=press", "'1' is no row; it must be a number from 0 to 0"),
        (
            "stroke.0.kind=pres",
            "no stroke is called 'pres'. Did you mean 'press'",
        ),
        ("about.x=1", "'about' is a value; it has no key 'x'"),
        ("body=3", "it must be a table: [body]"),
        ("gravity", "has no key and value; write --set"),
        ("=3", "has no key and value; write --set"),
    ],
)
def test_a_wrong_setting_is_named(setting, expected):
    with pytest.raises(UsageError) as error:
        changed_by(setting)
    assert expected in str(error.value)


def test_a_wrong_variable_is_named_and_others_are_ignored():
    others = {"SCALPEL_SIM_KEY": "secret", "HOME": "/"}
    assert with_environment(SLAB, others) == SLAB
    with pytest.raises(UsageError, match="SCALPEL_SIM__MATERIAL__TOUGHNES: no key"):
        scene_in(with_environment(SLAB, others | {"SCALPEL_SIM__MATERIAL__TOUGHNES": "3"}))


# The page


def test_the_tables_of_the_page_are_those_of_the_schema():
    """To renew them: `python -m scalpel_sim.scene.page docs/scenes.md`."""
    page = (ROOT / "docs" / "scenes.md").read_text(encoding="utf-8")
    assert with_tables(page) == page
    missing = {*kinds_of(Scene), *kinds_of(CaseContent)} - set(
        re.findall(r"<!-- keys of (\w+) -->", page)
    )
    assert missing == {"name", "about", "seconds", "title"}


def test_the_scene_of_the_page_cuts_a_block_into_three(tmp_path):
    page = (ROOT / "docs" / "scenes.md").read_text(encoding="utf-8")
    path = tmp_path / "scene.toml"
    path.write_text(page.partition("```toml\n")[2].partition("```")[0], encoding="utf-8")
    simulation = prepare(read_scene(path))
    simulation.run(simulation.stroke.duration)
    assert len(pieces_of(simulation.link.snapshot())) == 3


# Options


def test_an_option_of_the_stroke_replaces_all_of_them():
    arm = ArmOptions(stroke="press", speed=0.02)
    (stroke,) = chosen_scene("slab", TissueOptions(settings=("stroke.0.pause=1",)), arm).strokes
    assert (stroke.kind, stroke.speed, stroke.pause) == ("press", 0.02, 0.0)


def test_what_a_command_takes_by_itself_gives_way_to_the_file():
    verlet = chosen_scene("organ", TissueOptions(), relaxation="verlet", audits=True)
    assert (verlet.solver.relaxation, verlet.solver.audit) == ("verlet", True)
    said = TissueOptions(settings=("solver.relaxation=global", "solver.audit=false"))
    found = chosen_scene("organ", said, relaxation="verlet", audits=True)
    assert (found.solver.relaxation, found.solver.audit) == ("global", False)


# The command `new`


def test_a_new_scene_is_a_shipped_one_with_its_comments(tmp_path, capsys):
    path = tmp_path / "mine.toml"
    assert command_line(["new", str(tmp_path / "mine"), "--from", "incision"]) == 0
    assert str(path) in capsys.readouterr().out
    assert path.read_text() == shipped_path("incision").read_text()
    found = scene_in(read_scene_file(path))
    assert found.name == "mine"
    assert changed(found, name="incision") == SCENES["incision"]


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["taken.toml"], "add --force to replace it"),
        (["mine.toml", "--from", "organn"], "Did you mean 'organ'"),
        (["nowhere/mine.toml"], "cannot be written"),
    ],
)
def test_what_cannot_be_written_says_why(words, expected, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "taken.toml").write_text("precious")
    assert command_line(["new", *words]) in (1, 2)
    assert expected in capsys.readouterr().err
    assert (tmp_path / "taken.toml").read_text() == "precious"
    assert command_line(["new", "taken", "--force", "-q"]) == 0


ONE_TETRAHEDRON = """\
# vtk DataFile Version 3.0
one
ASCII
DATASET UNSTRUCTURED_GRID
POINTS 4 double
0 0 0 0.04 0 0 0 0.04 0 0 0 0.04
CELLS 1 5
4 0 1 2 3
CELL_TYPES 1
10
"""

WAY = "t,tip_x,tip_y,tip_z,heel_x,heel_y,heel_z\n0,0,0,0,0,0,1\n1,0,0.1,0,0,0.1,1\n"
