"""Cylinders of rings and layers."""

import numpy as np
import pytest

from tissue import cylinder
from tissue.mesh.faces import boundary_faces
from tissue.mesh.validation import checked, quality, signed_volumes


@pytest.mark.parametrize("cells", [(1, 1), (2, 3), (5, 8), (8, 4)])
def test_its_volume_is_that_of_the_circle_times_the_height(cells):
    mesh = cylinder(cells, 0.015, 0.04)
    volumes = signed_volumes(*mesh)
    assert volumes.min() > 0.0
    assert volumes.sum() == pytest.approx(np.pi * 0.015**2 * 0.04, rel=1e-12)
    assert len(mesh.tetrahedra) == 3 * 6 * cells[0] ** 2 * cells[1]


def test_neighbours_agree_on_every_face():
    mesh = cylinder((4, 6), 0.015, 0.04)
    rings, layers = 4, 6
    outer = 2 * 6 * rings**2 + 2 * 6 * rings * layers  # both ends, and two for each side of a prism
    assert len(boundary_faces(mesh.tetrahedra)) == outer
    assert checked(mesh).mesh.positions.shape == mesh.positions.shape


def test_its_elements_have_no_bad_shape():
    mesh = cylinder((5, 17), 0.015, 0.05)
    assert quality(*mesh).min() > 0.3


def test_the_ends_are_flat_and_the_side_is_on_a_circle():
    mesh = cylinder((3, 4), 0.01, 0.02)
    x = mesh.positions
    assert set(np.round(x[:, 2], 9)) == {0.0, 0.005, 0.01, 0.015, 0.02}
    radius = np.hypot(x[:, 0], x[:, 1])
    outer = np.sort(radius)[-5 * 18 :]
    np.testing.assert_allclose(outer, outer[0], rtol=1e-12)
    assert outer[0] == pytest.approx(0.01, rel=0.011)  # a little more: the area is exact


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        ({"cells": (0, 4)}, "whole numbers of at least 1"),
        ({"cells": (2.5, 4)}, "whole numbers of at least 1"),
        ({"cells": (2, 4, 4)}, "whole numbers of at least 1"),
        ({"cells": (10_000, 10_000)}, "prisms; take fewer"),
        ({"radius": 0.0}, "radius is 0.0 m"),
        ({"height": float("nan")}, "height is nan m"),
    ],
)
def test_measures_that_make_no_body_are_refused(arguments, expected):
    with pytest.raises(ValueError, match=expected):
        cylinder(**arguments)
