"""Toughness is charged for the area of the body at rest, and in the skin."""

import numpy as np
import pytest

from tests.tissue.kernels_of import line_blade
from tissue import Material, block
from tissue.blade.edge import Edge, pose_at
from tissue.blade.edge_anchors import held_toughness, new_anchors
from tissue.blade.return_mapping import AVERAGED_OVER, LARGEST_SHARE, set_anchor, update_rest_share
from tissue.blade.toughness import (
    skin_toughness_of,
    toughening_at,
    toughness_law_of,
    toughness_of,
)
from tissue.core.vec3 import Vec3
from tissue.mesh.body import build_body

pytestmark = pytest.mark.kernel

REACH = 0.005
FAR = AVERAGED_OVER * REACH
"""Distance after which the share is that of the last step alone [m]."""
TOUGH = 20.0


@pytest.fixture
def blade():
    """Three samples 5 mm apart at rest, on an upright edge that faces along y."""
    body = build_body(block((2, 2, 2), (0.02, 0.02, 0.02)), None, None)
    anchors = new_anchors(3, 0.01, 1e4)
    for k in range(3):
        set_anchor(anchors, body, k, 0, Vec3(0.0, 0.0, 0.0))
        anchors.rest[k] = (0.01, 0.01, 0.005 * (k + 1))
    return line_blade(anchors, Material(toughness=TOUGH)).replaced(reach=REACH)


def slip(blade, at_rest, now, length=0.01):
    """Slip the middle anchor by so much at rest and in the body as it is [m]."""
    tip, heel = Vec3(0.01, 0.01, 0.005), Vec3(0.01, 0.01, 0.005 + length)
    pose = pose_at(Edge(tip, heel, Vec3(0.0, 1.0, 0.0), tip, heel, Vec3(0.0, 1.0, 0.0)), 0.0)
    ways = (Vec3(0.0, at_rest, 0.0), Vec3(0.0, now, 0.0))
    update_rest_share(blade.anchors, 1, *ways, pose, REACH)
    return blade.anchors.rest_share[1]


def test_tissue_that_is_not_strained_costs_its_toughness(blade):
    assert slip(blade, FAR, FAR) == pytest.approx(1.0)
    assert held_toughness(blade.anchors, 1, blade.toughness) == pytest.approx(TOUGH)


def test_tissue_squeezed_to_half_its_length_costs_twice_as_much(blade):
    assert slip(blade, 2.0 * FAR, FAR) == pytest.approx(2.0)
    assert held_toughness(blade.anchors, 1, blade.toughness) == pytest.approx(2.0 * TOUGH)


def test_tissue_drawn_out_along_the_edge_costs_less(blade):
    assert slip(blade, FAR, FAR, length=0.02) == pytest.approx(0.5)


def test_a_share_is_averaged_over_the_way(blade):
    assert slip(blade, 0.2 * FAR, 0.1 * FAR) == pytest.approx(1.1)


def test_tissue_that_is_nearly_flat_costs_no_more_than_what_can_be_measured(blade):
    assert slip(blade, 100.0 * FAR, FAR) == pytest.approx(LARGEST_SHARE)


def test_an_anchor_beside_no_other_keeps_its_share(blade):
    blade.anchors.state[[0, 2]] = 0
    assert slip(blade, 2.0 * FAR, FAR) == 1.0


def test_an_anchor_that_did_not_slip_keeps_its_share(blade):
    assert slip(blade, 0.0, 0.0) == 1.0
    assert np.isfinite(blade.anchors.rest_share).all()


def test_skin_is_never_weaker_than_the_tissue_below():
    skinned = Material(toughness=20.0, skin_toughness=50.0)
    assert toughness_law_of(skinned, None).skin_toughness == 50.0
    assert toughness_law_of(Material(toughness=20.0), None).skin_toughness == 20.0


def test_skin_costs_at_least_what_the_speed_asks_for():
    material = Material(
        toughness=20.0, skin_toughness=50.0, toughness_exponent=0.5, toughness_speed=0.1
    )
    law = toughness_law_of(material, None)
    slow, fast = toughening_at(law, 0, 0.1), toughening_at(law, 0, 0.9)
    assert toughness_of(law, law.relative, 0, slow) == pytest.approx(40.0)
    assert skin_toughness_of(law, law.relative, 0, slow) == 50.0
    assert skin_toughness_of(law, law.relative, 0, fast) == pytest.approx(80.0)
