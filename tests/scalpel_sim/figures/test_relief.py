"""The relief of a picture on a mesh."""

import io

import numpy as np
import pytest
from PIL import Image

from scalpel_sim.figures.relief import RELIEF, with_relief
from scalpel_sim.viewer.primitives import TriangleMesh

UP = np.array([0.0, 0.0, 1.0])


def level_square(uv):
    corners = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]])
    return TriangleMesh(corners, np.array([[0, 1, 2], [0, 2, 3]]), np.tile(UP, (4, 1)), uv)


def png(bright):
    file = io.BytesIO()
    Image.fromarray(np.asarray(bright, np.uint8)).save(file, format="PNG")
    return file.getvalue()


RAMPS = {
    "along u": np.tile(np.arange(256), (256, 1)),
    "along v": np.tile(255 - np.arange(256)[:, None], (1, 256)),  # the lowest row is the darkest
}


@pytest.mark.parametrize(("ramp", "axis"), [("along u", 0), ("along v", 1)])
def test_a_slope_of_brightness_turns_normals_by_the_slope_of_the_relief(ramp, axis):
    """The square has one repeat along x and along y: there a ramp rises by one over it."""
    uv = np.array([[0.2, 0.2], [0.8, 0.2], [0.8, 0.8], [0.2, 0.8]])  # away from where it repeats
    fine = with_relief(level_square(uv), png(RAMPS[ramp]), most=2_000)
    expected = UP.copy()
    expected[axis] = -RELIEF * 256 / 255
    assert fine.normals == pytest.approx(
        np.tile(expected / np.linalg.norm(expected), (len(fine.normals), 1)), abs=1e-9
    )


def test_an_even_picture_divides_a_mesh_and_changes_nothing_else():
    mesh = level_square(np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]))
    fine = with_relief(mesh, png(np.full((8, 8), 90)), most=2_000)
    assert 500 < len(fine.triangles) <= 2_000
    assert fine.normals == pytest.approx(np.tile(UP, (len(fine.normals), 1)))
    assert fine.uv == pytest.approx(fine.positions[:, :2])
    a, b, c = fine.positions[fine.triangles].swapaxes(0, 1)
    assert 0.5 * np.cross(b - a, c - a).sum(axis=0) == pytest.approx(UP)
