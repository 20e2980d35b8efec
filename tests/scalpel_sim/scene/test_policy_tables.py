"""The tables `[act]`, `[observe]` and `[[vary]]`: read and written, and refused where wrong."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from scalpel_sim.errors import UsageError
from scalpel_sim.scene.act_table import ActTable, hands_led
from scalpel_sim.scene.observe_table import ObserveTable, quantities_shown
from scalpel_sim.scene.read import read_scene
from scalpel_sim.scene.vary_table import VARIED, VaryTable
from scalpel_sim.scene.write import scene_text

BODY = """
[body]
shape = "block"
size = [0.04, 0.04, 0.04]
cells = [2, 2, 2]

[[label]]
name = "vessel"
region = "0,0,0:0.02,0.04,0.04"

[[label]]
name = "fat"
region = "0.02,0,0:0.04,0.04,0.04"

[[interface]]
between = ["vessel", "fat"]
toughness = 20.0

[[view]]
name = "near"
eye = [0.1, -0.1, 0.1]
target = [0.02, 0.02, 0.04]

[[grasper]]
name = "left"
motion = [{ time = 0.0, at = [0.0, 0.0, 0.1], opening = 0.01 }]

[task]
line = [[0.01, 0.01], [0.03, 0.03]]
depth = 0.006
"""
POLICY = """
[act]
frame = "base"
hands = ["left", "blade"]
step = 0.04
speed = 0.05
turn = 1.0
force = 4.0
arm = "full"

[observe]
state = ["blade", "wrench", "wrench_peak", "target", "depth", "points:64", "left"]
cameras = [{ name = "near", size = [96, 64], depth = true }, { name = "endoscope" }]
sensor = { force = 0.02, torque = 0.0005, delay = 0.02 }

[[vary]]
what = "material.toughness"
label = "fat"
range = [0.7, 1.4]
distribution = "log_uniform"

[[vary]]
what = "interface.toughness"
between = ["vessel", "fat"]
range = [0.5, 2.0]

[[vary]]
what = "task.line.turn"
range = [-20, 20.0]

[[vary]]
what = "start.x"
hand = "left"
range = [-0.005, 0.005]

[[vary]]
what = "sensor.force"
range = [0.0, 0.05]
"""


def scene_of(text, folder):
    path = folder / "mine.toml"
    path.write_text(text, encoding="utf-8")
    return read_scene(path)


def test_the_tables_are_written_as_they_were_read(tmp_path):
    scene = scene_of(BODY + POLICY, tmp_path)
    again = scene_of(scene_text(scene, tmp_path / "again.toml"), tmp_path)
    assert scene.act.step == 0.04
    assert scene.observe.cameras[0].size == (96, 64)
    assert (scene.act, scene.observe, scene.vary) == (again.act, again.observe, again.vary)
    names = [row.name for row in scene.vary]
    assert names == [
        "material.toughness:fat",
        "interface.toughness:fat+vessel",
        "task.line.turn",
        "start.x:left",
        "sensor.force",
    ]


def test_a_report_has_the_tables(tmp_path):
    settings = scene_of(BODY + POLICY, tmp_path).settings()
    assert settings["act"]["speed"] == 0.05
    assert settings["observe"]["sensor"]["delay"] == 0.02
    assert settings["vary"][0] == {
        "what": "material.toughness",
        "label": "fat",
        "range": (0.7, 1.4),
        "distribution": "log_uniform",
    }


def test_hands_are_the_blade_and_graspers_in_the_order_of_the_scene():
    assert hands_led(ActTable(), ["left", "right"]) == ("blade", "left", "right")
    assert hands_led(ActTable(hands=("right", "blade")), ["left", "right"]) == ("blade", "right")


def test_a_plan_is_shown_where_there_is_one():
    assert quantities_shown(ObserveTable(), ["left"], has_plan=False) == ("blade", "wrench", "left")
    assert quantities_shown(ObserveTable(), [], has_plan=True)[-2:] == ("target", "depth")
    own = ObserveTable(state=("depth", "points:8"))
    assert quantities_shown(own, ["left"], has_plan=False) == ("depth", "points:8")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('"base"', '"camera"', r'frame is "camera"; it must be "tool" or "base"'),
        ('"blade"]\nstep', '"right"]\nstep', r"\[act\] hands: no hand is called 'right'"),
        ('["left", "blade"]', '["left", "left"]', "names one twice"),
        ("step = 0.04", "step = 0.0204", r"whole number of milliseconds, such as 0.02"),
        ("step = 0.04", "step = 20", r"step is 20; it must be a time from 0.001 to 0.1 s"),
        ("force = 4.0", "force = 0.0", "it must be a number above 0"),
        ('"full"', '"rigid"', 'it must be "kinematic" or "full"'),
        ('"depth", "points', '"dept", "points', "Did you mean 'depth'"),
        ("points:64", "points:0", "the number of points is from 1 to 4096"),
        ("points:64", "points", "the number of points is from 1 to 4096"),
        ('"points:64", "left"', '"depth"', "names a quantity twice"),
        ('"endoscope"', '"endo"', r"row 2 of cameras: no camera is called 'endo'"),
        ('{ name = "endoscope" }', '{ name = "near" }', "is the second one of 'near'"),
        ('{ name = "endoscope" }', '{ name = "overview", rgb = false }', "shows nothing"),
        ("[96, 64]", "[96, 4]", "it must be two whole numbers from 8 to 2048"),
        ("delay = 0.02", "delay = 20", "delay is 20; it must be a time from 0 to 1 s"),
        ('"material.toughness"', '"material.colour"', r"\[\[vary\]\] number 1 what"),
        ('label = "fat"', 'hand = "left"', "has the key hand, which belongs to others"),
        ("[0.7, 1.4]", "[1.4, 0.7]", "the lowest number comes first"),
        ("[0.7, 1.4]", "[0.7, 14]", "a factor is from 0.1 to 10"),
        ("[0.0, 0.05]", "[-0.1, 0.05]", "a standard deviation is at least 0"),
        ("[-20, 20.0]", "[-200, 20.0]", r"a turn \[degree\] is from -180 to 180"),
        (
            "range = [-20, 20.0]",
            'range = [-20, 20.0]\ndistribution = "log_uniform"',
            "log_uniform, and its range begins at -20",
        ),
        ('between = ["vessel", "fat"]\nrange', "range", "has no between: the two parts"),
        (
            'between = ["vessel", "fat"]\nrange',
            'between = ["vessel", "skin"]\nrange',
            "is of no [[interface]]: vessel and skin. Those that are: fat and vessel",
        ),
        ('hand = "left"', 'hand = "right"', "hand: no hand of a policy is called 'right'"),
        ('"sensor.force"\n', '"task.line.turn"\n', "is the second one of task.line.turn"),
    ],
)
def test_what_makes_no_sense_is_refused(old, new, message, tmp_path):
    assert POLICY.count(old) == 1
    with pytest.raises(UsageError, match=message.replace("[[interface]]", r"\[\[interface\]\]")):
        scene_of(BODY + POLICY.replace(old, new), tmp_path)


def test_what_is_about_a_plan_needs_a_task(tmp_path):
    body = BODY.partition("[task]")[0]
    with pytest.raises(UsageError, match="state has target, of the plan of a task"):
        scene_of(body + POLICY, tmp_path)
    with pytest.raises(UsageError, match="moves the line of a task"):
        scene_of(body + '[[vary]]\nwhat = "task.line.along"\nrange = [0, 0.01]\n', tmp_path)


def test_a_part_that_the_body_does_not_have_does_not_vary(tmp_path):
    scene = scene_of(BODY + POLICY.replace('label = "fat"', 'label = "skin"'), tmp_path)
    with pytest.raises(UsageError, match=r"\[\[vary\]\] number 1: the body has no part 'skin'"):
        scene.mesh()


def test_an_arm_of_ones_own_may_have_cameras_that_no_scene_knows(tmp_path):
    named = POLICY.replace('"endoscope"', '"wrist"')
    own = BODY + '[arm]\nmodel = "arm.xml"\n' + named
    assert scene_of(own, tmp_path).observe.cameras[1].name == "wrist"


@given(
    low=st.floats(0.1, 10.0),
    width=st.floats(1.0, 100.0),
    kind=st.sampled_from(["uniform", "log_uniform"]),
    seed=st.integers(0, 2**32 - 1),
)
def test_a_number_is_drawn_from_its_range(low, width, kind, seed):
    row = VaryTable(what="sensor.force", range=(low, low * width), distribution=kind)
    assert low <= row.drawn(np.random.default_rng(seed)) <= low * width


def test_a_logarithm_is_drawn_evenly():
    row = VaryTable(what="sensor.force", range=(0.25, 4.0), distribution="log_uniform")
    rng = np.random.default_rng(1)
    numbers = [row.drawn(rng) for _ in range(2000)]
    assert np.mean(np.array(numbers) < 1.0) == pytest.approx(0.5, abs=0.05)


def test_the_page_explains_all_that_can_vary():
    page = (Path(__file__).parents[3] / "docs" / "scenes.md").read_text(encoding="utf-8")
    table = page.partition("### What varies")[2]
    assert [name for name in VARIED if f"`{name}`" not in table] == []
