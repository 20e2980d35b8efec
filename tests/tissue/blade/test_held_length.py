"""Length of edge that samples stand for: as much as is in the tissue, wherever the skin is."""

import numpy as np
import pytest

from tests.tissue.kernels_of import line_blade
from tissue import Material, block
from tissue.blade.edge import Edge, pose_at
from tissue.blade.edge_anchors import FREE, anchored_length, anchors_energy, new_anchors
from tissue.blade.edge_search import anchor_entering
from tissue.blade.held_length import measure_held_lengths
from tissue.core.vec3 import Vec3
from tissue.mesh.body import build_body
from tissue.mesh.tetrahedron_grid import build_grid

pytestmark = pytest.mark.kernel

SIZE = (0.02, 0.04, 0.02)
STIFF, TOUGH = 40e3, 20.0
N, SPACING = 8, 4e-3


def upright(low, y=0.009):
    """Return an upright edge that does not move, whose tip is at height `low` [m]."""
    tip, heel = Vec3(0.011, y, low), Vec3(0.011, y, low + (N - 1) * SPACING)
    return Edge(tip, heel, Vec3(0.0, 1.0, 0.0), tip, heel, Vec3(0.0, 1.0, 0.0))


def held_at(low):
    """Return a block, and a blade that holds it."""
    body = build_body(block((2, 4, 2), SIZE), None, None)
    anchors = new_anchors(N, (N - 1) * SPACING, STIFF)
    blade = line_blade(anchors, Material(toughness=TOUGH)).replaced(reach=0.005)
    grid = build_grid(body, body.positions, 0.0)
    box = Vec3(0.0, 0.0, 0.0), Vec3(*SIZE)
    anchor_entering(blade, body, grid, upright(low), 1.0, 1e-3, *box)
    return body, blade


@pytest.mark.parametrize("low", [0.0085, 0.0093, 0.0101, 0.0117])
def test_an_edge_holds_the_tissue_from_its_tip_to_the_skin(low):
    body, blade = held_at(low)
    measure_held_lengths(blade, body, pose_at(upright(low), 1.0))
    assert anchored_length(blade.anchors) == pytest.approx(SIZE[2] - low)
    np.testing.assert_allclose(blade.anchors.stiffness, STIFF * blade.anchors.length)


@pytest.mark.parametrize("low", [-0.0055, -0.0037])
def test_an_edge_that_passes_through_holds_it_from_skin_to_skin(low):
    body, blade = held_at(low)
    measure_held_lengths(blade, body, pose_at(upright(low), 1.0))
    assert anchored_length(blade.anchors) == pytest.approx(SIZE[2])


def test_samples_outside_stand_for_half_the_way_to_the_next_ones():
    body, blade = held_at(0.0085)
    blade.anchors.state[:] = FREE
    measure_held_lengths(blade, body, pose_at(upright(0.0085), 1.0))
    np.testing.assert_allclose(blade.anchors.length, [SPACING / 2, *[SPACING] * 6, SPACING / 2])


def test_the_energy_of_tissue_that_an_edge_takes_hold_of_is_in_the_account():
    body, blade = held_at(0.0085)
    ahead = pose_at(upright(0.0085, y=0.0092), 1.0)
    before = anchors_energy(blade.anchors, body, ahead, blade.toughness)
    measure_held_lengths(blade, body, ahead)
    after = anchors_energy(blade.anchors, body, ahead, blade.toughness)
    assert after != pytest.approx(before, rel=0.01)
    assert blade.totals.released == pytest.approx(before - after)
