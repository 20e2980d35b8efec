"""Cameras, light and colours differ from episode to episode in images, and in nothing else."""

import numpy as np
import pytest

from scalpel_sim import changed
from scalpel_sim.errors import UsageError
from scalpel_sim.learning import TissueEnv
from scalpel_sim.scene.observe_table import CameraTable, ObserveTable
from scalpel_sim.scene.schema import LabelTable, ViewTable
from scalpel_sim.scene.vary_table import VaryTable
from tests.scalpel_sim.learning.little_task import little_task
from tests.support.egl import needs_renderer

__all__ = ["little_task"]

pytestmark = needs_renderer

EYE, BY = (0.03, -0.04, 0.07), (0.004, -0.006, 0.01)
NEAR = ViewTable(name="near", eye=EYE, target=(0.03, 0.015, 0.01), fov_degrees=40.0)
MOVED = ViewTable(
    name="near",
    eye=tuple(np.add(EYE, BY).tolist()),
    target=NEAR.target,
    fov_degrees=NEAR.fov_degrees,
)
SIZE = (64, 48)
RANGES = {
    "camera.x": (-0.02, 0.02),
    "camera.y": (-0.02, 0.02),
    "camera.z": (-0.02, 0.02),
    "light.brightness": (0.5, 1.5),
    "colour.red": (0.5, 1.5),
    "colour.green": (0.5, 1.5),
    "colour.blue": (0.5, 1.5),
}
AS_IT_IS = {name: 0.0 if name.startswith("camera") else 1.0 for name in RANGES}


def scene_of(task, view=NEAR, rows=()):
    cameras = (CameraTable(name="near", size=SIZE, segmentation=True),)
    return changed(task, observe=ObserveTable(cameras=cameras), views=(view,), vary=tuple(rows))


@pytest.fixture(scope="module")
def varied(little_task):
    rows = [VaryTable(what=what, range=ends) for what, ends in RANGES.items()]
    env = TissueEnv(scene_of(little_task, rows=rows), obs="all")
    yield env
    env.close()


def seen(env, **numbers):
    """Return the first observation of an episode, by what differs in it."""
    given = AS_IT_IS | {name.replace("_", "."): each for name, each in numbers.items()}
    return env.reset(seed=2, options={"variation": given})[0]


def usually_seen(task, view=NEAR):
    env = TissueEnv(scene_of(task, view), obs="all")
    found = env.reset(seed=2)[0]
    env.close()
    return found


def test_a_camera_that_moves_sees_what_a_view_there_does_and_then_what_it_did(varied, little_task):
    usual, there = usually_seen(little_task), usually_seen(little_task, MOVED)
    moved = seen(varied, **dict(zip(("camera_x", "camera_y", "camera_z"), BY, strict=True)))
    back = seen(varied, light_brightness=0.7, colour_red=0.6) and seen(varied)
    for name, image in usual.items():
        assert np.array_equal(moved[name], there[name])
        assert np.array_equal(back[name], image)
    assert not np.array_equal(there["near_rgb"], usual["near_rgb"])


def test_numbers_are_those_of_an_episode_that_looks_otherwise(varied):
    one, other = seen(varied, colour_blue=0.5), seen(varied, light_brightness=1.4, camera_x=0.01)
    assert not np.array_equal(one["near_rgb"], other["near_rgb"])
    numbers = [name for name in one if not name.startswith("near")]
    assert numbers
    assert all(np.array_equal(one[name], other[name]) for name in numbers)


def test_half_the_light_and_half_the_red_are_seen_by_halves(varied):
    usual = seen(varied)
    on_skin = (
        usual["near_segmentation"][..., 0] == varied.unwrapped._images._cameras["near"].ids["skin"]
    )
    bright = usual["near_rgb"][on_skin].astype(float)
    dark = seen(varied, light_brightness=0.5)["near_rgb"][on_skin]
    assert dark.mean(axis=0) == pytest.approx(0.5 * bright.mean(axis=0), abs=2.0)
    blue = seen(varied, colour_red=0.5)["near_rgb"][on_skin]
    assert 0.45 < blue[:, 0].mean() / bright[:, 0].mean() < 0.7, (
        "highlights have their lamp's colour"
    )
    assert blue[:, 1:] == pytest.approx(bright[:, 1:], abs=1.0)


def test_the_colour_of_a_part_is_that_of_its_skin_alone(little_task):
    rows = [VaryTable(what="colour.green", range=(0.5, 1.0), label="left half")]
    halves = [
        LabelTable(name="left half", region="0,0,0:0.03,0.03,0.02"),
        LabelTable(name="right half", region="0.03,0,0:0.06,0.03,0.02"),
    ]
    env = TissueEnv(changed(scene_of(little_task, rows=rows), labels=tuple(halves)), obs="images")
    usual, tinted = (
        env.reset(options={"variation": {"colour.green:left half": number}})[0]
        for number in (1.0, 0.5)
    )
    ids = env.unwrapped._images._cameras["near"].ids
    env.close()
    numbers = usual["near_segmentation"][..., 0]
    changed_pixels = (usual["near_rgb"] != tinted["near_rgb"]).any(axis=-1)
    assert changed_pixels[numbers == ids["left half"]].mean() > 0.95
    assert not changed_pixels[numbers != ids["left half"]].any()


@pytest.mark.parametrize(
    ("row", "message"),
    [
        ({"what": "camera.x", "camera": "far"}, "no camera of .* is called 'far'"),
        ({"what": "colour.red", "camera": "near"}, "has the key camera, which belongs to others"),
        ({"what": "light.brightness", "range": (0.0, 1.0)}, "a factor is from 0.1 to 10"),
        ({"what": "colour.red", "label": "fat"}, "fat"),
    ],
)
def test_looks_that_make_no_sense_are_refused(little_task, row, message):
    with pytest.raises((UsageError, ValueError), match=message):
        TissueEnv(scene_of(little_task, rows=[VaryTable(**{"range": (0.5, 1.0)} | row)]))


def test_what_only_images_show_asks_for_a_camera(little_task):
    row = VaryTable(what="light.brightness", range=(0.5, 1.0))
    with pytest.raises(UsageError, match=r"is seen in images alone: add `cameras`"):
        changed(little_task, observe=ObserveTable(), vary=(row,))
