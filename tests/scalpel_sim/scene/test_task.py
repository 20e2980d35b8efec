"""The table `[task]`: read and written as the others, and refused where it makes no sense."""

import pytest

from scalpel_sim.errors import UsageError
from scalpel_sim.scene.read import read_scene
from scalpel_sim.scene.write import scene_text

BODY = """
[body]
shape = "block"
size = [0.04, 0.04, 0.04]
cells = [2, 2, 2]

[[label]]
name = "vessel"
region = "0,0,0:0.02,0.04,0.04"
"""
TASK = """
[task]
kind = "incise"
line = [[0.01, 0.01], [0.03, 0.03]]
depth = 0.006
target = "vessel"
spare = [{ label = "vessel", margin = 0.002 }]
limits = [{ strain = 0.5 }, { label = "vessel", strain = 0.3 }, { instrument = "blade", force = 2 }]
seconds = 8.0
success = { covered = 0.95, off_plan = 20e-6, spared = true, force = 2.0, strain_above = 0.0 }
"""


def scene_of(text, folder):
    path = folder / "mine.toml"
    path.write_text(text, encoding="utf-8")
    return read_scene(path)


def test_a_task_is_written_as_it_was_read(tmp_path):
    scene = scene_of(BODY + TASK, tmp_path)
    assert scene.task is not None
    assert scene.task.tolerance == 1e-3
    assert scene.task.spare[0].margin == 0.002
    assert scene.task.success.covered == 0.95
    text = scene_text(scene, tmp_path / "again.toml")
    assert scene_of(text, tmp_path).task == scene.task


def test_the_file_of_a_surface_is_found_from_the_scene(tmp_path):
    scene = scene_of(BODY + '[task]\nsurface = "plan.stl"\n', tmp_path)
    assert scene.task.surface == str(tmp_path / "plan.stl")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('"incise"', '"carve"', r'kind is "carve"; it must be "incise" or "retract"'),
        ("depth = 0.006", "", r"has line and no depth"),
        ("line = [[0.01, 0.01], [0.03, 0.03]]", "", r"has depth and no line"),
        ("[0.03, 0.03]]", "[0.03]]", r"line is .* it must be two points or more"),
        ("depth = 0.006", 'depth = 0.006\nsurface = "a.stl"', "has line and surface"),
        ("depth = 0.006", "depth = 0.006\ninto = [0, 0, 0]", "direction of depth"),
        ('kind = "incise"', 'kind = "excise"', None),
        ('target = "vessel"', 'kind = "excise"', "TOML"),
        ("margin = 0.002", "margins = 0.002", "Did you mean 'margin'"),
        ("{ strain = 0.5 }", '{ label = "vessel" }', "row 1 of limits has no strain or force"),
        ("{ strain = 0.5 }", "{ strain = 0.5, force = 1.0 }", "a strain and a force"),
        ("{ strain = 0.5 }", "{ force = 1.0 }", "a force and no instrument; it is of blade"),
        ('"blade"', '"left"', "a force and instrument 'left'; it is of blade"),
        (
            "{ strain = 0.5 }",
            '{ strain = 0.5, instrument = "blade" }',
            "an instrument and a strain",
        ),
        ('spare = [{ label = "vessel", margin = 0.002 }]', "", "spare has no rows"),
    ],
)
def test_what_makes_no_sense_is_refused(old, new, message, tmp_path):
    assert old in TASK
    text = BODY + TASK.replace(old, new)
    if message is None:
        assert scene_of(text, tmp_path).task.kind == new.split('"')[1]
        return
    with pytest.raises(UsageError, match=message):
        scene_of(text, tmp_path)


def test_a_part_that_is_cut_out_has_a_name(tmp_path):
    text = BODY + TASK.replace('target = "vessel"\n', "").replace('"incise"', '"excise"')
    with pytest.raises(UsageError, match=r'\[task\] of kind "excise" has no target'):
        scene_of(text, tmp_path)


def test_success_of_held_tissue_needs_a_grasper(tmp_path):
    with pytest.raises(UsageError, match=r"success has held, and the scene has no \[\[grasper\]\]"):
        scene_of(f"{BODY}[task]\nsuccess = {{ held = 0.9 }}\n", tmp_path)


@pytest.mark.parametrize("key", ["removed", "healthy", "exposed"])
def test_success_of_a_target_needs_one(key, tmp_path):
    with pytest.raises(UsageError, match=f"success has {key} and no target"):
        scene_of(f"{BODY}[task]\nsuccess = {{ {key} = 1.0 }}\n", tmp_path)
