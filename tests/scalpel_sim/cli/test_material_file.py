import math
import re
import tomllib
from dataclasses import fields, replace

import pytest

from scalpel_sim import SCALPEL
from scalpel_sim.cli.app import command_line
from scalpel_sim.cli.materials import template
from scalpel_sim.cli.options import BladeOptions, MaterialOptions, TissueOptions
from scalpel_sim.cli.scene_options import chosen_scene, read_figures
from scalpel_sim.errors import UsageError
from scalpel_sim.scene.read import PHANTOM
from scalpel_sim.scene.schema import BladeTable, MaterialTable
from scalpel_sim.tables.key_texts import texts_of
from tissue import MATERIALS, BladeShape, Material

WRONG_FILES = {
    "no file": (None, r"cannot be read: No such file.*materials --write"),
    "nothing": ("", r"has no table \[material\]; .*materials --write"),
    "a series that leaves nothing": (
        '[material]\nlaw = "neo_hookean"\nprony = [[0.6, 0.1], [0.5, 1]]\n[blade]',
        r"mine.toml: \[material\]: prony has g whose sum is 1.1",
    ),
    "no blade": ("[material]\ndensity = 1000", r"has no table \[blade\]"),
    "a bevel that is too steep": (
        "[material]\n[blade]\nbevel_degrees = 80",
        "80 degrees; at most 60",
    ),
}


def options(path, *, blade=None, **given) -> TissueOptions:
    return TissueOptions(
        material=MaterialOptions(material=None if path is None else str(path), **given),
        blade=BladeOptions(blade=blade),
    )


def test_the_tables_have_the_fields_of_material_and_blade():
    assert set(MaterialTable.__struct_fields__) == set(Material().as_keys())
    in_degrees = {field.name for field in fields(BladeShape)} - {"bevel_angle"}
    assert set(BladeTable.__struct_fields__) == in_degrees | {"bevel_degrees"}
    for table in (MaterialTable, BladeTable):
        assert tuple(texts_of(table)) == table.__struct_fields__


@pytest.mark.parametrize("name", [None, *MATERIALS])
def test_what_is_written_reads_back_to_the_same_material_and_blade(name, tmp_path, capsys):
    path = tmp_path / "mine.toml"
    words = ["materials", *([] if name is None else [name]), "--write", str(path)]
    assert command_line(words) == 0
    assert str(path) in capsys.readouterr().out
    wanted = PHANTOM if name is None else MATERIALS[name].material
    assert Material(**read_figures(path, "material")) == wanted
    scene = chosen_scene("slab", options(path, blade=path))
    assert (scene.material, scene.blade) == (wanted, SCALPEL)


def test_a_prony_series_reads_back_and_an_option_overrides_it(tmp_path):
    relaxing = Material(law="neo_hookean", prony=((1 / 3, 0.1), (0.2, 5.0)))
    path = tmp_path / "mine.toml"
    path.write_text(template(relaxing, "one that relaxes"), encoding="utf-8")
    assert Material(**read_figures(path, "material")) == relaxing
    assert chosen_scene("organ", options(path)).material.prony == relaxing.prony
    overridden = chosen_scene("organ", options(path, prony="0.25:3")).material
    assert overridden == replace(relaxing, prony=((0.25, 3.0),))


def test_every_number_of_the_file_has_a_comment_and_a_preset_its_sources(tmp_path):
    liver = MATERIALS["liver"]
    text = template(liver.material, "liver", liver)
    for paragraph in text.split("\n\n")[1:]:
        lines = [line for line in paragraph.splitlines() if not line.startswith("[")]
        assert lines[0].startswith("# ") and " = " in lines[-1]
    assert "Gokgol et al. 2012" in text
    assert max(map(len, text.splitlines())) <= 100
    assert set(tomllib.loads(text)) == {"material", "blade"}


def test_a_file_is_overwritten_only_on_request(tmp_path, capsys):
    path = tmp_path / "mine.toml"
    path.write_text("precious")
    assert command_line(["materials", "--write", str(path)]) == 2
    assert "--force" in capsys.readouterr().err
    assert path.read_text() == "precious"
    assert command_line(["materials", "--write", str(path), "--force", "-q"]) == 0
    assert Material(**read_figures(path, "material")) == PHANTOM
    assert capsys.readouterr().out == ""


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["--write", "mine.txt"], "must end in .toml"),
        (["livr", "--write", "mine.toml"], "Did you mean 'liver'"),
        (["liver", "--force"], "--force is for --write"),
    ],
)
def test_what_cannot_be_written_is_wrong_use(words, expected, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert command_line(["materials", *words]) == 2
    assert expected in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("case", WRONG_FILES)
def test_a_wrong_file_is_named_with_the_key_and_a_remedy(case, tmp_path):
    content, expected = WRONG_FILES[case]
    path = tmp_path / "mine.toml"
    if content is not None:
        path.write_text(content)
    with pytest.raises(UsageError, match=expected) as caught:
        chosen_scene("organ", options(path, blade=path))
    assert str(path) in str(caught.value) and "\n" not in str(caught.value)


def test_a_wrong_file_gets_one_line_and_exit_code_2(tmp_path, capsys):
    path = tmp_path / "mine.toml"
    path.write_text("[material]\nyung_modulus = 5e3\n")
    assert command_line(["run", "grid2", "--material", str(path)]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert re.match(f"error: {path}: .*Did you mean 'young_modulus'", line)


def test_a_key_that_is_not_given_keeps_the_value_of_the_scene(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text("[material]\ndensity = 900\n[blade]\nheight = 0.01\n")
    scene = chosen_scene("organ", options(path, blade=path))
    usual = chosen_scene("organ", TissueOptions())
    assert scene.material.density == 900.0
    assert scene.material.toughness == usual.material.toughness
    assert scene.blade == BladeShape(height=0.01)


def test_a_thickness_of_zero_in_the_file_is_a_line_unless_an_option_makes_it_a_blade(tmp_path):
    path = tmp_path / "line.toml"
    path.write_text("[blade]\nthickness = 0\nbevel_degrees = 20\nheight = 0.01\n")
    assert chosen_scene("organ", options(None, blade=path)).blade is None
    thick = TissueOptions(blade=BladeOptions(blade=path, blade_thickness=1e-3))
    shape = BladeShape(thickness=1e-3, bevel_angle=math.radians(20.0), height=0.01)
    assert chosen_scene("organ", thick).blade == shape
    assert read_figures(path, "blade")["bevel_degrees"] == 20.0


def test_an_unused_table_gets_a_warning(tmp_path, caplog):
    path = tmp_path / "mine.toml"
    path.write_text("[material]\ndensity = 900\n[blade]\nheight = 0.01\n")
    chosen_scene("slab", options(path, blade=path))
    chosen_scene("slab", options("liver", blade=path))
    assert not caplog.records
    chosen_scene("slab", options(path))
    assert f"add --blade {path}" in caplog.text
    chosen_scene("slab", options(None, blade=path))
    assert f"add --material {path}" in caplog.text


@pytest.mark.parametrize("option", ["--material", "--blade"])
def test_a_file_for_a_tissue_elsewhere_belongs_to_its_server(option, capsys):
    assert command_line(["run", "--connect", "127.0.0.1:1", option, "mine.toml"]) == 2
    assert f"{option} belongs to the tissue" in capsys.readouterr().err
