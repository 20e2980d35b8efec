"""The line of a plan that is drawn on the skin."""

import numpy as np
import pytest
from msgspec import structs

from scalpel_sim import Camera, changed, prepare
from scalpel_sim.camera.pen_mark import drawn_line
from scalpel_sim.learning.episode import Episode
from scalpel_sim.scene.read import scene_called
from tests.support.egl import needs_renderer

pytestmark = needs_renderer


def marked_scene(*, marked: bool = True):
    """Return a task with or without its line on the skin."""
    scene = scene_called("incise-v0")
    return changed(scene, task=structs.replace(scene.task, marked=marked))


def is_violet(rgb: np.ndarray) -> np.ndarray:
    """Return where a picture of liver is bluer than red."""
    return rgb[:, :, 2].astype(int) > rgb[:, :, 0].astype(int) + 20


def places_of_line(camera: Camera, simulation) -> np.ndarray:
    """Return the pixels of the stations of the plan at rest but its ends, columns and rows."""
    stations = simulation.frame.points_to_world(simulation.score.plan.stations[1:-1])
    return camera.pixels_of(stations).astype(int)


@pytest.fixture(scope="module")
def pair():
    """Return images of the same body with and without ink, and the pixels of the line."""
    images = []
    for marked in (True, False):
        simulation = prepare(marked_scene(marked=marked), records=False)
        with Camera(simulation, "from above", width=240, height=240) as camera:
            images.append(camera.image())
            line = places_of_line(camera, simulation)
    return *images, line


def test_the_line_is_violet_and_all_else_stays_as_it_is(pair):
    marked, plain, line = pair
    violet = is_violet(marked.rgb)
    assert violet[line[:, 1], line[:, 0]].all()
    rows, columns = np.nonzero((marked.rgb != plain.rgb).any(axis=2))
    away = np.hypot(rows[:, None] - line[:, 1], columns[:, None] - line[:, 0])
    assert away.min(axis=1).max() < 5.0  # pixels of 0.4 mm


def test_ink_has_neither_depth_nor_a_number(pair):
    marked, plain, _ = pair
    assert (marked.depth == plain.depth).all()
    assert (marked.segmentation == plain.segmentation).all()


def test_the_ink_lies_where_the_line_of_the_episode_does():
    episode = Episode(marked_scene())
    camera = Camera(episode.simulation, "from above", width=160, height=160)
    lines = []
    for seed in range(2):
        episode.reset(np.random.default_rng(seed))
        violet, line = is_violet(camera.rgb()), places_of_line(camera, episode.simulation)
        lines.append(line)
        assert violet[line[:, 1], line[:, 0]].mean() > 0.8  # the blade hides some
    camera.close()
    assert not violet[lines[0][:, 1], lines[0][:, 0]].all()  # it has moved


def test_a_line_with_a_gap_is_drawn_as_two():
    x = np.array([0.0, 1.0, 2.0, 12.0, 13.0])
    line = drawn_line(np.stack([1e-3 * x, 0.0 * x, 0.0 * x], axis=1), np.array([0.0, 0.0, 1.0]))
    assert len(line.triangles) == 3 * 4
    corners = line.positions[line.triangles]
    turned = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert (turned[:, 2] > 0.0).all()  # seen from above
    assert np.ptp(corners[:, :, 0], axis=1).max() < 2e-3
