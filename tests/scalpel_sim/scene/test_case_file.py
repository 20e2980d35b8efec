"""Case files: what is refused, with which words."""

from pathlib import Path

import pytest

from scalpel_sim.errors import UsageError
from scalpel_sim.scene.case import read_case
from scalpel_sim.validate.cases.runner import assemble

EXAMPLES = Path(__file__).parents[3] / "docs" / "examples"
TENSION = (EXAMPLES / "tension.toml").read_text(encoding="utf-8")
CUT = (EXAMPLES / "cut.toml").read_text(encoding="utf-8")

LOAD = '[[load]]\nname = "pull"\nregion = "top"\nforce = [[0.0, 0.0, 1.0]]\n'

# What is replaced in the example, by what, and what the error says.
WRONG = {
    "an unknown key of a row": ("region = \"left\"", "regoin = \"left\"", "[[support]] number 1"),
    "a missing table": ("[run]\nseconds = 0.5\nrecord_every = 0.02\n", "", "has no [run]"),
    "a missing key": ("seconds = 0.5\n", "", "[run] has no seconds: a number above 0"),
    "a key of another shape": ("cells = [16, 4, 4]", "radius = 0.01", "has no cells"),
    "times without displacement": ("displacement =", "# ", "one that moves has both"),
    "a start that is not at rest": ("[[0.0, 0.0, 0.0],", "[[0.1, 0.0, 0.0],", "must be [0, 0, 0]"),
    "rows without a time": ("times = [0.0, 0.5]", "times = [0.0]", "2 rows and 1 times"),
    "a support of another name": ('support = "grip"', 'support = "gripp"', "Did you mean 'grip'"),
    "a reaction of nothing": ('support = "grip"\n', "", "quantity reaction has no support"),
    "two of a name": ('name = "grip"', 'name = "clamp"', "two of [[support]] are called clamp"),
    "an unknown record": ('record = "force"', 'record = "forces"', "Did you mean 'force'"),
    "neither file nor value": ('file = "tension.csv"\n', "", "no file and no value"),
    "a blade that is not there": ('quantity = "reaction"\nsupport = "grip"',
                                  'quantity = "blade_force"', "needs a [blade]"),
    "too long a step": ("record_every = 0.02", "record_every = 0.02\ndt = 0.1", "in this order"),
    "a load on nothing": (
        "[[record]]",
        LOAD.replace('region = "top"\n', "") + "[[record]]",
        "no region and no points",
    ),
    "a region that holds nothing": (
        'region = "left"',
        'region = "1,1,1:2,2,2"',
        "[[support]] clamp: no node is in the box",
    ),
    "supports that overlap": ('region = "left"', 'region = "left,right"', "must not overlap"),
}  # fmt: skip


def written(folder, text):
    path = folder / "case.toml"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize("name", WRONG)
def test_a_wrong_file_is_answered_with_what_is_wrong_and_where(name, tmp_path):
    old, new, expected = WRONG[name]
    assert TENSION.count(old) >= 1
    path = written(tmp_path, TENSION.replace(old, new, 1))
    with pytest.raises(ValueError) as error:
        assemble(read_case(path))
    assert expected in str(error.value)
    assert len(str(error.value).splitlines()) == 1


def test_a_file_that_is_not_there_is_answered_with_where_to_begin(tmp_path):
    with pytest.raises(UsageError, match=r"docs/scenes\.md"):
        read_case(tmp_path / "none.toml")


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("times = [0.0, 0.46]  # s: 0.1 m/s", "times = [0.0]", "[blade] tip: 2 rows and 1 times"),
        ("forward = [0.0, 1.0, 0.0]", "height = 0.006\nforward = [0, 1, 0]", "no thickness"),
        ("value = -0.4", "value = 0", "the tolerance is a share of it"),
        ("value = -0.4", 'value = -0.4\nagainst = "area"', "a value has from_time"),
    ],
)
def test_a_blade_or_a_value_that_makes_no_sense_is_refused(old, new, expected, tmp_path):
    assert old in CUT
    with pytest.raises(UsageError) as error:
        assemble(read_case(written(tmp_path, CUT.replace(old, new, 1))))
    assert expected in str(error.value)


def test_a_preset_may_have_single_figures_replaced(tmp_path):
    text = TENSION.replace('law = "neo_hookean"', 'preset = "liver"').replace(
        "0.0\nvis", "0.4\nvis"
    )
    assembly = assemble(read_case(written(tmp_path, text)))
    assert assembly.tissue.material.young_modulus == 10e3
    assert assembly.tissue.material.toughness > 100.0
