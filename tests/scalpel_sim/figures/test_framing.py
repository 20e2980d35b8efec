"""Views of figures: where points are in a picture."""

import numpy as np
import pytest

from scalpel_sim.camera.canvas import PixelSize
from scalpel_sim.figures.framing import Margins, fitted, pixel_at, projected

BOX = np.array([[x, y, z] for x in (0.0, 0.2) for y in (0.0, 0.1) for z in (0.0, 0.05)])
SIZE = PixelSize(300, 200)


@pytest.mark.parametrize("towards_eye", [(0.1, -0.4, 0.3), (0.3, 0.3, 0.1), (0.0, 0.0, 0.5)])
def test_what_is_framed_fills_the_picture_up_to_its_margins(towards_eye):
    view = fitted(BOX, np.array(towards_eye), SIZE, Margins(side=0.1, top=0.2, bottom=0.05))
    low, high = (f(projected(view, SIZE, BOX), axis=0) for f in (np.min, np.max))
    assert low[0] >= 29.0 and high[0] <= 271.0
    assert low[1] >= 39.0 and high[1] <= 191.0
    assert max((high - low) / [240.0, 150.0]) == pytest.approx(1.0, abs=0.01)


def test_a_line_as_long_as_a_pixel_at_the_target_is_a_pixel_long():
    view = fitted(BOX, np.array([0.1, -0.4, 0.3]), SIZE, Margins(0.1, 0.1, 0.1))
    forward, up = view.axes
    ends = view.target + pixel_at(view, SIZE) * np.stack([0.0 * up, np.cross(forward, up), up])
    seen = projected(view, SIZE, ends)
    assert seen - seen[0] == pytest.approx(np.array([[0.0, 0.0], [1.0, 0.0], [0.0, -1.0]]))
