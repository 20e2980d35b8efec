"""Wrong scene files: each gets an error that says where, what is wrong, and what to do."""

import pytest

from scalpel_sim.cli.app import command_line

ATTACHED = (
    "[[attachment]]\n",
    'where = "top"\n',
    "stiffness = 100.0\n",
    "times = [0.5]\n",
    "displacements = [[0.0, 0.0, 1e-3]]\n",
)
TIED = "to = [0.02, 0.02, 0.08]\narea = 1e-6\nstiffness = 100.0\n"
FILE = """\
about = "a block"
[body]
shape = "block"
size = [0.04, 0.04, 0.04]
cells = [2, 2, 2]
fixed = "left,right"
[material]
law = "neo_hookean"
young_modulus = 1e4
[blade]
thickness = 4e-4
[world]
gravity = 9.81
[solver]
relaxation = "global"
[arm]
preset = "touch"
[[grasper]]
name = "helper"
holds = "attachment"
motion = [
  { time = 0.0, at = [0.1, 0.02, 0.03], approach = [-1, 0, 0], across = [0, 1, 0], opening = 0.01 },
  { time = 0.5, opening = 0.005 },
]
[[stroke]]
kind = "points"
points = [[0.02, -0.01, 0.01], [0.02, 0.05, 0.01]]
length = 0.05
"""
VIEW = """[[view]]
name = "side"
eye = [0.2, -0.2, 0.2]
target = [0.0, 0.0, 0.0]
fov_degrees = 40.0
"""
FILE += "".join(ATTACHED) + VIEW

WRONG = {
    "no toml": ("[body]", "[body", "is not valid TOML"),
    "brackets in brackets": ("9.81", "[" * 100_000, "its brackets are nested too deep"),
    "tables in tables": ("gravity", "gravity" + ".a" * 500_000, "has more than 20 parts"),
    "thousands of digits": ("9.81", "1" * 5_000, "an integer in it has thousands of digits"),
    "no body": (FILE[FILE.index("[body]") : FILE.index("[material]")], "", "has no [body]"),
    "no shape": ('shape = "block"\n', "", "[body] has no shape"),
    "an unknown table": ("[world]", "[wrld]", "Did you mean 'world'"),
    "an unknown key": ("gravity", "gravty", "key of [world] is called 'gravty'. Did you mean"),
    "a key in the wrong table": ("gravity = 9.81", "toughness = 5", "which belongs to [material]"),
    "a key in no table": ("about", "toughness = 5\nabout", "stands in no table; write [material]"),
    "an unknown shape": ('"block"\nsize', '"blok"\nsize', 'must be "organ" or "gallbladder" or'),
    "a block with a radius": ("cells =", "radius = 0.1\ncells =", 'belongs to shape "cylinder"'),
    "a flat body": ("0.04, 0.04, 0.04", "0.04, 0.04, 0.0", "three numbers above 0"),
    "an unknown side": ('"left,right"', '"left,rigth"', "rigth"),
    "a box without nodes": ('"left,right"', '"1,1,1:2,2,2"', "no node"),
    "a stretch of nothing": ('"left,right"', '"bottom"\nstretch = 0.1', "opposite sides"),
    "a negative modulus": ("1e4", "-1e4", "young_modulus is -10000.0; it must be a number above"),
    "a ratio of a half": ("1e4", "1e4\npoisson_ratio = 0.5", "from 0 to below 0.5"),
    "relaxation of springs": (
        '"neo_hookean"',
        '"springs"\nprony = [[0.3, 0.1]]',
        "[material]: prony is given with law springs",
    ),
    "a line with a height": ("4e-4", "0.0\nheight = 0.01", "[blade]: it has thickness 0"),
    "an unknown relaxation": ('"global"', '"globl"', "Did you mean 'global'"),
    "an unknown stroke": ('"points"', '"point"', "Did you mean 'points'"),
    "a key of another stroke": ("length =", "depth = 0.01\nlength =", 'belongs to kind "incision"'),
    "a stroke without a length": ("length = 0.05\n", "", 'of kind "points" has no length'),
    "one point": (", [0.02, 0.05, 0.01]]", "]", "has one point"),
    "a saw that does not move": (
        "length =",
        "saw_frequency = 5.0\nlength =",
        "has one of saw_amplitude and saw_frequency",
    ),
    "a stroke at the speed of sound": ("length =", "speed = 340.0\nlength =", "at most 1"),
    "a stroke along its edge": ("[0.02, 0.05, 0.01]", "[0.02, -0.01, 0.03]", "give the direction"),
    "a stroke beside the body": ("0.02, -0.01, 0.01], [0.02", "0.2, -0.01, 0.01], [0.2", "mm away"),
    "an attachment of nothing": ('"top"', '"sphere:1,1,1,0.01"', "no node is in the sphere"),
    "an attachment in single brackets": (ATTACHED[0], "[attachment]\n", "it must be tables: [[att"),
    "a ligament without a toughness": (ATTACHED[2], TIED, "has to and no toughness"),
    "a toughness of no ligament": (ATTACHED[2], "toughness = 5.0\n" + ATTACHED[2], "and no to;"),
    "a way without times": (ATTACHED[3], "", "give either times or a speed"),
    "a way with too many times": ("times = [0.5]", "times = [0.5, 1.0]", "2 times for 1"),
    "a way back in time": ("times = [0.5]", "times = [0.0]", "begin above 0 and increase"),
    "times of no way": (ATTACHED[4], "", "has times and no displacements"),
    "a region of two numbers": ('"top"', "[0.1, 0.2]", "it must be a region"),
    "a grasper that waits": ('"attachment"', '"suction"', 'must be "attachment" or "friction"'),
    "friction with a spring": (
        'holds = "attachment"',
        'holds = "friction"\nstiffness = 100.0',
        'stiffness is for holds = "attachment"',
    ),
    "a wide grasper": ("opening = 0.005", "opening = 0.03", "a distance from 0 to 0.02 m"),
    "a grasper nowhere": ("at = [0.1, 0.02, 0.03], ", "", "number 1 has no at"),
    "a row without a time": (
        "{ time = 0.5, ",
        "{ ",
        "[[grasper]] number 1 [[motion]] number 2 has no time",
    ),
    "an unknown key of a row": ("time = 0.5, opening", "time = 0.5, openning", "'openning'. Did"),
    "times that go back": ("time = 0.5", "time = 0.0", "times must increase"),
    "jaws along the shaft": ("opening = 0.005", "across = [1, 0, 0]", "not along one line"),
    "a grasper at the speed of sound": ("time = 0.5, ", "time = 0.5, at = [9, 9, 9], ", "2 m/s is"),
    "a grasper that is far away": (
        "time = 0.5, ",
        "time = 9.0, at = [2, 0, 0], ",
        "does not reach the whole motion of 'helper'",
    ),
    "a place without a model": (
        'holds = "attachment"',
        'at = "flange"',
        "at is for an arm of your own",
    ),
    "a model without a place": (
        'holds = "attachment"',
        'model = "arm.xml"',
        "has a model and no at",
    ),
    "a name with a space": ('"helper"', '"my left"', "letters, digits and underscores"),
    "two graspers of one name": (
        "[[stroke]]",
        """[[grasper]]
name = "helper"
motion = [{ time = 0.0, at = [0.0, 0.0, 0.1], opening = 0.01 }]
[[stroke]]""",
        "two of [[grasper]] are called helper",
    ),
    "an eye at its target": ("[0.2, -0.2, 0.2]", "[0, 0, 0]", "number 1 has its eye at its target"),
    "a view along its up": (
        "[0.2, -0.2, 0.2]",
        "[0, 0, 0.2]",
        "[[view]] number 1 looks along its up, [0.0, 0.0, 1.0]; give another up, such as [0, 1, 0]",
    ),
    "an up of no direction": ("fov_degrees", "up = [0, 0, 0]\nfov_degrees", "up is [0, 0, 0]"),
    "a view of everything": ("= 40.0", "= 180.0", "an angle above 0 and below 180 degrees"),
    "a view of two lines": ('"side"', '"a\\nb"', "a name of one line"),
    "an hour and more": ("about", "seconds = 4000.0\nabout", "at most 3600"),
    "contact of an earlier version": (
        '"global"',
        '"global"\ncontact = "penalty"',
        "[solver] contact: contact is always by forces since version 0.2",
    ),
}


def test_the_file_that_they_are_made_from_is_right(tmp_path):
    path = tmp_path / "scene.toml"
    path.write_text(FILE, encoding="utf-8")
    words = ["run", str(path), "--seconds", "0.01", "-q", "--out", str(tmp_path / "out")]
    assert command_line(words) == 0


@pytest.mark.parametrize("name", WRONG)
def test_a_wrong_file_gets_one_line_that_names_it_and_a_remedy(name, tmp_path, capsys):
    old, new, expected = WRONG[name]
    assert FILE.count(old) == 1
    path = tmp_path / "scene.toml"
    path.write_text(FILE.replace(old, new), encoding="utf-8")
    assert command_line(["run", str(path), "--out", str(tmp_path / "out")]) == 2
    lines = [line for line in capsys.readouterr().err.splitlines() if line.startswith("error: ")]
    assert len(lines) == 1 and expected in lines[0]
