"""How much of a target a camera sees by rays, against the pixels of its picture."""

import json

import numpy as np
import pytest
from msgspec import structs
from PIL import Image, ImageDraw

from scalpel_sim import SCENES, Camera, SimulationState, StrokeTable, prepare
from scalpel_sim.errors import UsageError
from scalpel_sim.runs.file_names import SUMMARY
from scalpel_sim.scene.body import OneOfBodiesTable
from scalpel_sim.scene.schema import LabelTable, ViewTable
from scalpel_sim.scene.task_table import SuccessTable, TaskTable
from scalpel_sim.scoring.exposure import Exposure, TaskCamera, hiding
from tests.scalpel_sim.hands.driven_runs import done
from tests.scalpel_sim.served_scenes import served

VIEWS = {
    "from above": (0.02, 0.0201, 0.2),
    "below the lid": (-0.10, 0.05, 0.03),
    "over the lid": (-0.03, -0.05, 0.11),
    "past the blade": (0.16, 0.02, 0.05),
}
"""Where the cameras are [m]; all look at the middle of the marker."""
MIDDLE = (0.02, 0.02, 0.01)
SIDE = 240
"""Pixels of a picture, across and up."""
FINER = 4
"""Pixels of the silhouette over those of the picture."""


def block(name, **keys):
    return OneOfBodiesTable(name=name, shape="block", fixed="bottom", **keys)


def covered_marker(**changes):
    """Return a bed with a marker on it, of which a lid on one side hides a part, and a blade."""
    views = [
        ViewTable(name=name, eye=eye, target=MIDDLE, fov_degrees=30.0)
        for name, eye in VIEWS.items()
    ]
    views.append(ViewTable(name="narrow", eye=(0.02, 0.0201, 0.2), target=MIDDLE, fov_degrees=2.0))
    bodies = (
        block("bed", cells=(5, 5, 1), size=(0.04, 0.04, 0.01)),
        block("lid", cells=(2, 3, 1), size=(0.012, 0.03, 0.004), pos=(0.008, 0.008, 0.018)),
    )
    marker = LabelTable(name="marker", body="bed", region="0.008,0.008,-0.001:0.032,0.032,0.011")
    blade = StrokeTable(
        kind="rest", points=[(0.036, 0.02, 0.012)], length=0.03, forward=(0.0, 1.0, 0.0)
    )
    tables = {"body": bodies, "labels": (marker,), "views": tuple(views), "strokes": (blade,)}
    return structs.replace(SCENES["slab"], **tables | changes)


def task(camera="from above"):
    success = SuccessTable(exposed=0.9)
    return TaskTable(kind="expose", target="bed/marker", camera=camera, success=success)


@pytest.fixture(scope="module")
def simulation():
    return prepare(covered_marker(), records=False)


def exposure(simulation, view):
    """Return the share by rays."""
    body, tissue = simulation.link.snapshot(), simulation.link.tissue
    labels = tuple(number for number, name in tissue.label_names.items() if name == "bed/marker")
    camera = TaskCamera(view, simulation.scene.views, simulation.arm.model)
    return Exposure(camera, body, labels).look(tissue, simulation)


def share_of_pixels(simulation, view):
    """Return the pixels of the marker in a picture over those of its silhouette."""
    surface = simulation.link.surface()
    eye = np.array(next(each.eye for each in simulation.scene.views if each.name == view))
    names = simulation.link.tissue.label_names
    number = next(number for number, name in names.items() if name == "bed/marker")
    triangles = surface.triangles[surface.labels == number]
    a, b, c = (surface.positions[triangles[:, i]] for i in range(3))
    triangles = triangles[((a - eye) * np.cross(b - a, c - a)).sum(axis=1) < 0.0]
    with Camera(simulation, view, width=SIDE, height=SIDE) as camera:
        seen = (camera.segmentation() == camera.ids["bed/marker"]).sum()
        places = camera.pixels_of(simulation.frame.points_to_world(surface.positions))
    alone = Image.new("1", (FINER * SIDE, FINER * SIDE))
    for triangle in triangles:
        ImageDraw.Draw(alone).polygon([tuple(FINER * places[i]) for i in triangle], fill=1)
    return seen / (np.asarray(alone).sum() / FINER**2)


@pytest.mark.parametrize("view", [name for name in VIEWS if name != "past the blade"])
def test_rays_see_the_share_that_a_picture_shows(simulation, view):
    found = exposure(simulation, view)
    assert found == pytest.approx(share_of_pixels(simulation, view), abs=0.02)
    assert found > 0.2


def test_each_triangle_that_faces_the_eye_hides_what_a_ray_meets_behind_it():
    """Each ray and triangle by three equations, wherever the triangle is around the eye."""
    rng = np.random.default_rng(3)
    places = np.array([0.3, -0.2, 1.0]) + rng.uniform(-0.2, 0.2, (40, 3))
    corners = 0.3 * places[rng.integers(0, 40, 300)][:, None] + rng.normal(0.0, 0.1, (300, 3, 3))
    corners[::3] = rng.normal(0.0, 1.0, (100, 3, 3))  # in any direction
    hides, triangle = hiding(places, corners.reshape(-1, 3), np.arange(900).reshape(-1, 3))
    found = np.zeros((40, 300), bool)
    found[:, triangle] = hides
    expected = np.zeros_like(found)
    for t, (a, b, c) in enumerate(corners):
        if a @ np.cross(b - a, c - a) >= 0.0:
            continue
        for i, place in enumerate(places):
            along, to_b, to_c = np.linalg.solve(np.stack([place, a - b, a - c], axis=1), a)
            is_within = to_b >= 0.0 and to_c >= 0.0 and to_b + to_c <= 1.0
            before = 1.0 - 1e-4 / np.linalg.norm(place)
            expected[i, t] = is_within and 0.0 < along < before
    assert expected.any(axis=0).sum() > 50
    np.testing.assert_array_equal(found, expected)


def test_an_arm_hides_what_is_behind_it(simulation):
    """The sheet of a blade counts without the point with which pictures draw it."""
    data, before = simulation.arm.data, exposure(simulation, "past the blade")
    places = data.geom_xpos.copy()
    data.geom_xpos[:] += [0.0, 0.0, 10.0]
    assert exposure(simulation, "past the blade") > before + 0.02
    data.geom_xpos[:] = places


def test_what_is_outside_the_picture_is_not_seen(simulation):
    assert 0.0 < exposure(simulation, "narrow") < 0.1


def test_a_run_says_how_much_of_its_target_is_exposed(tmp_path, simulation):
    scene = covered_marker(task=task(), seconds=0.04)
    scored = prepare(scene)
    done(scored, tmp_path, scene)
    score = json.loads((tmp_path / SUMMARY).read_text())["score"]
    found = exposure(simulation, "from above")
    assert score["terms"]["exposed"] == pytest.approx(found, abs=0.01)
    assert score["failed"] == ["exposed"]


def test_what_is_exposed_follows_a_state_to_the_bit():
    scene = covered_marker(task=task("over the lid"))
    simulation = prepare(scene, records=False)
    simulation.run(0.1)
    state = simulation.save_state().to_bytes()
    simulation.run(0.2)
    other = prepare(scene, records=False)
    other.load_state(SimulationState.from_bytes(state))
    other.run(0.2)
    assert other.score.terms()["exposed"] == simulation.score.terms()["exposed"] > 0.0


def test_a_camera_that_is_not_there_is_refused():
    with pytest.raises(UsageError, match=r"camera of \[task\] is called 'abve'.*from above"):
        prepare(covered_marker(task=task("abve")))


def test_what_is_exposed_is_not_known_of_a_tissue_elsewhere():
    scene = covered_marker(task=task())
    with served(scene) as link:
        score = prepare(scene, link, records=False).score
        assert score.figures()["unknown"] == ["exposed"]


def test_a_target_within_other_tissue_is_not_seen():
    lump = LabelTable(name="lump", region="0.008,0.01,0.008:0.032,0.05,0.032")
    above = ViewTable(name="above", eye=(0.02, 0.0301, 0.4), target=(0.02, 0.03, 0.02))
    given = TaskTable(kind="expose", target="lump", camera="above")
    scene = structs.replace(SCENES["slab"], labels=(lump,), views=(above,), task=given)
    simulation = prepare(scene, records=False)
    assert simulation.score.terms()["exposed"] == 0.0
