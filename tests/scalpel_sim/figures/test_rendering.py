"""Camera, light and rendering: where points are drawn, and how bright."""

import numpy as np
import pytest

from scalpel_sim.figures.camera import Margins, fit_view, view_from
from scalpel_sim.figures.light import SurfacePoints, illuminate, make_lights
from scalpel_sim.figures.rendering import SceneObject, render, table_below
from scalpel_sim.scene.schema import ViewTable
from scalpel_sim.viewer.primitives import TriangleMesh

UP = np.array([0.0, 0.0, 1.0])
LAMP = np.array([0.0, 0.0, 1.0])
BOX = np.array([[x, y, z] for x in (0.0, 0.2) for y in (0.0, 0.1) for z in (0.0, 0.05)])
WHITE = (1.0, 1.0, 1.0)


def plate(height: float, half: float = 0.05) -> TriangleMesh:
    """Return a level square above the origin."""
    corners = half * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    positions = np.column_stack([corners, np.full(4, height)])
    return TriangleMesh(positions, np.array([[0, 1, 2], [0, 2, 3]]), np.tile(UP, (4, 1)))


@pytest.mark.parametrize("towards_eye", [(0.1, -0.4, 0.3), (0.3, 0.3, 0.1), (0.0, 0.0, 0.5)])
def test_what_is_framed_fills_the_picture_up_to_its_margins(towards_eye):
    view = fit_view(BOX, np.array(towards_eye), 300, 200, Margins(side=0.1, top=0.2, bottom=0.05))
    low, high = (f(view.project(BOX)[:, :2], axis=0) for f in (np.min, np.max))
    assert low[0] >= 29.0 and high[0] <= 271.0
    assert low[1] >= 39.0 and high[1] <= 191.0
    assert max((high - low) / [240.0, 150.0]) == pytest.approx(1.0, abs=0.01)


def test_nearness_is_linear_on_the_picture():
    view = fit_view(BOX, np.array([0.1, -0.4, 0.3]), 300, 200, Margins(0.1, 0.1, 0.1))
    a, b = view.project(BOX[0]), view.project(BOX[7])
    between = view.project(np.linspace(BOX[0], BOX[7], 50))
    share = (between[:, 0] - a[0]) / (b[0] - a[0])
    assert between == pytest.approx(a + share[:, None] * (b - a), abs=1e-9)


def lit_below(mesh: TriangleMesh, points: np.ndarray) -> np.ndarray:
    lights = make_lights(LAMP, mesh.positions[mesh.triangles], np.ones(2, bool))
    up = np.tile(UP, (len(points), 1))
    return illuminate(lights, SurfacePoints(points, up, up, up), 50.0).diffuse


def test_a_plate_casts_a_shadow_below_and_none_far_beside_or_above():
    points = np.array([[0.0, 0.0, 0.0], [3.0, 0.0, 0.0], [0.0, 0.0, 0.06]])
    below, beside, above = lit_below(plate(0.02), points)
    assert below < 0.35 * beside
    assert above == pytest.approx(beside, rel=0.02)


def test_a_surface_does_not_shade_itself():
    on_it = np.array([[x, y, 0.02] for x in (-0.03, 0.0, 0.03) for y in (-0.02, 0.04)])
    far = lit_below(plate(0.02), np.array([[3.0, 0.0, 0.0]]))
    assert lit_below(plate(0.02), on_it) == pytest.approx(np.full(6, far[0]), rel=0.02)


def test_a_red_plate_on_a_white_table_is_red_with_a_shadow_and_white_far_away():
    red, table = plate(0.03), table_below(np.array([[-0.05, -0.05, 0.0], [0.05, 0.05, 0.03]]))
    objects = [
        SceneObject(red, (0.8, 0.1, 0.1)),
        SceneObject(table, WHITE, catches_shadows_only=True),
    ]
    around = np.array([[-0.15, -0.15, 0.0], [0.15, 0.15, 0.03]])
    view = fit_view(around, np.array([0.0, -0.3, 0.5]), 80, 60, Margins(0.05, 0.05, 0.05))
    image = render(view, objects, lamp=np.array([-1.0, 0.0, 1.0]), background=WHITE)
    x, y = view.project(np.array([0.0, 0.0, 0.03]))[:2].astype(int)
    assert image[y, x, 0] > 0.6 and image[y, x, 1] < 0.3
    x, y = view.project(np.array([0.065, 0.0, 0.0]))[:2].astype(int)  # the lamp is on the left
    assert image[y, x].max() < 0.85
    assert image[-1, 0].min() > 0.95


def test_the_camera_of_a_scene_spans_its_angle_with_its_target_in_the_middle():
    camera = ViewTable(
        name="above",
        eye=(0.1, 0.2, 0.5),
        target=(0.1, 0.2, 0.0),
        up=(1.0, 0.0, 0.0),
        fov_degrees=90,
    )
    corners = np.array([[0.1, 0.2, 0.0], [0.6, 0.2, 0.0], [0.1, -0.3, 0.0]])
    seen = view_from(camera, 200, 100).project(corners)[:, :2]
    assert seen == pytest.approx(np.array([[100.0, 50.0], [100.0, 0.0], [150.0, 50.0]]))
