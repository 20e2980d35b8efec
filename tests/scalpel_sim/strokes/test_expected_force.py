"""A stroke takes toughness times the width of cut, and a run that cannot do it says so before."""

import re

import numpy as np
import pytest

from scalpel_sim import SCENES, prepare
from scalpel_sim.scene.scene import changed
from scalpel_sim.strokes.expected_force import expected_force, is_inside, length_inside
from scalpel_sim.strokes.kinds.incision import DEPTH, SLOPE
from tests.support.planned_strokes import plan_stroke
from tissue import BladeSegment, block, boundary_faces, liver_lobe

SLAB = block((4, 6, 4), (0.04, 0.06, 0.04))
J = 20.0


def inside(mesh, tip, heel):
    pose = BladeSegment(np.array(tip), np.array(heel), np.array([0.0, 1.0, 0.0]))
    return length_inside(pose, mesh, mesh.positions[boundary_faces(mesh.tetrahedra)])


@pytest.mark.parametrize(
    ("tip", "heel", "expected"),
    [
        ((0.013, 0.017, -0.01), (0.013, 0.017, 0.06), 0.04),  # through
        ((0.013, 0.017, 0.03), (0.013, 0.017, 0.06), 0.01),  # the tip inside
        ((0.013, 0.017, 0.06), (0.013, 0.017, 0.03), 0.01),  # the heel inside
        ((0.013, 0.017, 0.01), (0.013, 0.017, 0.03), 0.02),  # both
        ((0.013, 0.077, 0.01), (0.013, 0.077, 0.03), 0.0),  # beside it
    ],
)
def test_the_length_of_an_edge_in_a_block(tip, heel, expected):
    assert inside(SLAB, tip, heel) == pytest.approx(expected, abs=1e-12)


def test_the_length_in_an_organ_is_that_of_the_points_inside():
    mesh = liver_lobe()
    low, high = mesh.positions.min(axis=0), mesh.positions.max(axis=0)
    random = np.random.default_rng(0)
    for _ in range(5):
        tip, heel = random.uniform(low, high, (2, 3))
        points = tip + (np.arange(400.0)[:, None] + 0.5) / 400.0 * (heel - tip)
        share = np.mean([is_inside(point, mesh) for point in points])
        found = inside(mesh, tip, heel) / np.linalg.norm(heel - tip)
        assert found == pytest.approx(share, abs=5e-3)


def test_a_straight_stroke_takes_toughness_times_height():
    force, width = expected_force(plan_stroke("straight", SLAB), SLAB, J)
    assert (force, width) == pytest.approx((J * 0.04, 0.04))


def test_an_incision_takes_most_as_its_sloping_edge_goes_in():
    """Then it opens the length of the edge seen from above; drawn, it opens the depth."""
    width = expected_force(plan_stroke("incision", SLAB), SLAB, J).width
    assert width == pytest.approx(DEPTH / np.tan(SLOPE), rel=0.05)


def test_an_arm_that_is_too_weak_for_the_cut_is_named_with_the_numbers(caplog):
    prepare(SCENES["grid2"])
    assert "renders" not in caplog.text
    prepare(changed(SCENES["grid2"], toughness=400.0, young_modulus=1e5))
    words = r"take some 16 N \(400 J/m2 over 4\d mm of edge\), and the arm 'premium' renders 8.5 N"
    assert re.search(words, caplog.text)


def test_a_stronger_arm_is_taken_where_the_cut_needs_it():
    tough = changed(SCENES["grid2"], toughness=120.0, young_modulus=1e5)
    assert prepare(SCENES["grid2"]).arm.name == "touch"
    assert prepare(tough).arm.name == "premium"
