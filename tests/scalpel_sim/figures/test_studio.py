"""Pictures of the studio: light, shadow, wet surfaces, and lines."""

from dataclasses import replace

import numpy as np

from scalpel_sim.camera.canvas import PixelSize
from scalpel_sim.camera.viewpoints import Viewpoint
from scalpel_sim.figures.cuts import Moment
from scalpel_sim.figures.framing import projected
from scalpel_sim.figures.mesh_drawing import HIDDEN, SKIN_FACE, draw_mesh
from scalpel_sim.figures.studio import LAMP, picture
from scalpel_sim.viewer.looks import ORGAN_LOOK
from tests.support.egl import needs_renderer
from tissue import Tissue, block

pytestmark = needs_renderer

SIZE = PixelSize(120, 90)
HIGH = 0.02
MESH = block(cells=(2, 2, 1), size=(0.04, 0.04, HIGH))
VIEW = Viewpoint(np.array([0.02, -0.14, 0.13]), np.array([0.02, 0.02, 0.0]))


def moment(mesh=MESH):
    tissue = Tissue(mesh)
    return Moment(tissue.snapshot(), tissue.surface(), [])


def seen_at(image, point):
    x, y = projected(VIEW, SIZE, np.array([point]))[0].astype(int)
    return image[y, x]


def test_a_body_lies_on_a_white_table_with_a_soft_shadow_away_from_the_lamp():
    image = picture(VIEW, SIZE, moment(), ORGAN_LOOK, with_tool=False)
    red, green, _ = seen_at(image, [0.012, 0.0, 0.5 * HIGH])
    assert red > 1.5 * green
    assert image[-1, 0].min() > 0.97
    away = -HIGH * LAMP[:2] / LAMP[2]  # where the shadow of an upper edge falls
    shadow = [seen_at(image, [0.04 + s * away[0], 0.015, 0.0]).mean() for s in (0.5, 3.0)]
    assert shadow[0] < 0.8 < shadow[1]


def test_a_wet_surface_mirrors_white_and_hides_no_more_than_a_part_of_it(monkeypatch):
    wet = picture(VIEW, SIZE, moment(), ORGAN_LOOK, with_tool=False)
    monkeypatch.setattr("scalpel_sim.figures.studio.WET", 0.0)
    dry = picture(VIEW, SIZE, moment(), ORGAN_LOOK, with_tool=False)
    added = (wet - dry)[wet.max(axis=2) < 0.99]  # in sRGB; a saturated pixel shows less
    assert added.min() > -0.01
    assert added.max() > 0.03
    linear = (wet**2.2 - dry**2.2)[(wet.max(axis=2) < 0.99) & (dry[:, :, 0] > 1.4 * dry[:, :, 1])]
    assert linear.std(axis=1).max() < 0.02  # as much red as green and blue


def test_lines_in_front_are_dark_and_lines_behind_are_pale():
    body, surface, _ = moment(block(cells=(1, 1, 1), size=(0.04, 0.04, HIGH)))
    near = replace(VIEW, fov_degrees=18.0)
    image = draw_mesh(near, SIZE, body, surface).mean(axis=2)
    for point, low, high in (
        ([0.02, 0.0, HIGH], 0.1, 0.5),  # on an edge in front
        ([0.03, 0.04, 0.0], 1.0 - 2.0 * HIDDEN, 0.93),  # on an edge below and behind
        ([0.004, 0.01, HIGH], 0.95 * min(SKIN_FACE), 1.0),  # on a face, beside all edges
    ):
        x, y = projected(near, SIZE, np.array([point]))[0].astype(int)
        assert low < image[y - 1 : y + 2, x].min() < high, point
    assert image[0, 0] == 1.0
