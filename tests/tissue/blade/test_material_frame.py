"""The way of an anchor in the body at rest: sideways by the tissue on both sides of the cut.

The body is four cells across the cut, of 10 mm each. The cut is its middle plane, x = 20 mm.
"""

import numpy as np
import pytest

from tissue import block
from tissue.blade.edge_anchors import new_anchors
from tissue.blade.material_frame import BESIDE, displacement_at_rest
from tissue.blade.return_mapping import set_anchor
from tissue.core.vec3 import Vec3
from tissue.mesh.body import CUT, build_body
from tissue.mesh.point_location import tetrahedron_at
from tissue.mesh.tetrahedron_grid import build_grid

pytestmark = pytest.mark.kernel

MIDDLE, SHEAR, STEP = 0.02, 0.1, 1e-4
REACH = 0.015 / BESIDE
"""From near the middle this is well within the outer cells [m]."""
X = Vec3(1.0, 0.0, 0.0)


def way(shear_left, shear_right, *, beside=1e-4, reach=REACH, is_parted=False):
    """Return the way of an anchor that lies so far beside the middle and goes ahead along y [m].

    The outer cells are sheared along x, as a function of y; the middle plane is so by the mean.
    """
    mesh = block((4, 2, 2), (2.0 * MIDDLE, 0.02, 0.02))
    x, y, _ = mesh.positions.T
    mean = 0.5 * (shear_left + shear_right)
    near = np.abs(x - MIDDLE) < 1e-6
    shear = np.where(near, mean, np.where(x < MIDDLE, shear_left, shear_right))
    positions = mesh.positions + np.outer(shear * y, [1.0, 0.0, 0.0])
    body = build_body(mesh, positions, None)
    if is_parted:
        for f in range(4):
            others = np.delete(mesh.tetrahedra, f, axis=1)
            body.links[: len(mesh.tetrahedra)][near[others].all(axis=1), f] = CUT
    anchors = new_anchors(2, 0.01, 1.0)
    p = Vec3(MIDDLE + beside, 0.0101, 0.0102)
    t = tetrahedron_at(body, build_grid(body, body.rest, 0.0), body.rest, p)
    set_anchor(anchors, body, 0, t, p)
    return np.array(displacement_at_rest(anchors, body, 0, Vec3(0.0, STEP, 0.0), X, reach))


@pytest.mark.parametrize("beside", [-1e-4, 1e-4, 2e-3])
def test_lips_that_open_do_not_lead_an_anchor_away_from_the_cut(beside):
    assert way(SHEAR, -SHEAR, beside=beside)[0] == pytest.approx(0.0, abs=1e-12)


def test_tissue_that_is_sheared_as_a_whole_turns_the_way():
    assert way(SHEAR, SHEAR) == pytest.approx([-SHEAR * STEP, STEP, 0.0], rel=0.01)


def test_tissue_sheared_on_one_side_turns_the_way_by_half():
    assert way(0.0, -SHEAR)[0] == pytest.approx(0.5 * SHEAR * STEP, rel=0.05)


@pytest.mark.parametrize("beside", [-1e-4, 1e-4])
def test_an_anchor_whose_other_lip_has_parted_goes_straight_on(beside):
    assert way(SHEAR, -SHEAR, beside=beside, is_parted=True)[0] == pytest.approx(0.0, abs=1e-12)


def test_beside_the_skin_the_tetrahedron_of_the_anchor_decides():
    assert way(0.0, -SHEAR, beside=0.015, reach=0.006 / BESIDE)[0] == pytest.approx(
        SHEAR * STEP, rel=1e-6
    )
