"""From a pixel to the place of the material that it shows, and back."""

import numpy as np
import pytest

from scalpel_sim import SCENES, Camera, pixels_to_points, prepare
from scalpel_sim.errors import UsageError
from tests.support.egl import needs_renderer

pytestmark = needs_renderer


@pytest.fixture(scope="module")
def organ() -> Camera:
    """An endoscope above an organ that has been pressed for a while."""
    simulation = prepare(SCENES["organ"])
    camera = Camera(simulation, "endoscope", width=200, height=150)
    simulation.run(0.25)
    return camera


def pixels_of(camera: Camera, name: str, n: int) -> np.ndarray:
    """Middles of pixels that show a thing and nothing else around them, as columns and rows."""
    shows = camera.segmentation() == camera.ids[name]
    inner = shows.copy()
    for axis in (0, 1):
        for step in (-2, 2):
            inner &= np.roll(shows, step, axis)
    rows, columns = np.nonzero(inner)
    chosen = np.random.default_rng(3).choice(len(rows), n, replace=False)
    return np.column_stack([columns, rows])[chosen] + 0.5


def projected(camera: Camera, points: np.ndarray) -> np.ndarray:
    """Places in the image of points of the world, by the pinhole formula; columns and rows."""
    view = camera._view
    forward, up = view.axes
    offsets = points - view.eye
    by_depth = offsets / (offsets @ forward)[:, None]
    scale = 0.5 * camera.height / np.tan(np.radians(0.5 * view.fov_degrees))
    right = np.cross(forward, up)
    middle = 0.5 * np.array([camera.width, camera.height])
    return middle + scale * np.column_stack([by_depth @ right, -(by_depth @ up)])


def test_a_pixel_shows_the_place_of_the_material_that_is_drawn_there(organ):
    pixels = pixels_of(organ, "skin", 60)
    points = pixels_to_points(organ, pixels, organ.depth())
    tissue = organ.theatre.link.tissue
    now = tissue.positions_of(tissue.material_points(points))
    back = projected(organ, organ.theatre.frame.points_to_world(now))
    assert np.linalg.norm(back - pixels, axis=1).max() < 0.5
    world = organ.theatre.frame.points_to_world(now)
    np.testing.assert_allclose(organ.pixels_of(world), back, atol=1e-3)
    assert np.linalg.norm(now - points, axis=1).max() > 1e-4, "the body has moved"


def test_the_places_are_as_deep_as_the_image_says(organ):
    pixels, depth = pixels_of(organ, "skin", 60), organ.depth()
    points = pixels_to_points(organ, pixels)
    tissue = organ.theatre.link.tissue
    now = organ.theatre.frame.points_to_world(tissue.positions_of(tissue.material_points(points)))
    forward, _ = organ._view.axes
    columns, rows = np.floor(pixels).astype(int).T
    np.testing.assert_allclose((now - organ._view.eye) @ forward, depth[rows, columns], atol=1e-4)


def test_lines_of_sight_go_through_the_middle_and_the_corner_of_the_image():
    simulation = prepare(SCENES["slab"])
    camera = Camera(simulation, "overview", width=64, height=48)
    eye, ways = camera.lines_of_sight(np.array([[32.0, 24.0], [0.0, 0.0]]))
    forward, up = camera._view.axes
    np.testing.assert_allclose(eye, camera._view.eye, atol=1e-6)
    np.testing.assert_allclose(ways[0], forward, atol=1e-6)
    half = np.tan(np.radians(0.5 * camera._view.fov_degrees))
    corner = forward + half * up - half * 64 / 48 * np.cross(forward, up)
    np.testing.assert_allclose(ways[1], corner / np.linalg.norm(corner), atol=1e-6)


@pytest.mark.parametrize(
    ("pixel", "message"),
    [
        ((-1.0, 20.0), r"pixel 1, \(-1, 20\), is outside the image of 200 x 150"),
        ((1.0, 149.0), "shows no tissue"),
    ],
)
def test_a_pixel_that_shows_no_skin_is_named(organ, pixel, message):
    with pytest.raises(UsageError, match=message):
        pixels_to_points(organ, [pixel])


def test_what_an_instrument_hides_is_not_seen(organ):
    """Where the blade is in front of the skin, the depth of the image says so."""
    depth = organ.depth()
    (pixel,) = pixels_of(organ, "skin", 1)
    column, row = np.floor(pixel).astype(int)
    before = depth.copy()
    before[row, column] -= 0.01
    pixels_to_points(organ, [pixel], depth)
    with pytest.raises(UsageError, match="something that stands before the tissue"):
        pixels_to_points(organ, [pixel], before)
