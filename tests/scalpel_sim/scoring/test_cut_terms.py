"""Each term of a cut against geometry that is known: within 1 % on one mesh, 3 % between two."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from scalpel_sim.scoring.cut_terms import CutTerms
from tests.scalpel_sim.scoring.known_cuts import (
    COARSE,
    EVERYWHERE,
    FINE,
    SIZE,
    body,
    spare,
    terms,
    upright_cut,
    yardstick,
)

ONE, TWO = 0.01, 0.03
MIDDLE = [(0.02, 0.0), (0.02, 0.06)]
"""The line across the middle of the body."""
LYING = {"line": [(*each, 0.04) for each in MIDDLE], "depth": 0.03, "spare": spare("vessel")}
MESHES = pytest.mark.parametrize("cells", [COARSE, FINE])


@MESHES
def test_half_a_plan_is_covered_and_what_is_near_it(cells):
    tissue = body(cells)
    upright_cut(tissue, [(0.02, -0.01), (0.02, 0.03)], low=-0.01)
    found = terms(tissue, line=MIDDLE, depth=0.04, tolerance=1e-3)
    assert found.area == pytest.approx(0.03 * 0.04, rel=1e-9)
    assert found.covered == pytest.approx((0.03 + 1e-3) / 0.06, rel=ONE)
    assert found.off_plan == 0.0
    assert found.path_error < 1e-9


@MESHES
def test_a_cut_beside_the_plan_is_off_it_by_its_distance(cells):
    tissue = body(cells)
    upright_cut(tissue, [(0.02, -0.01), (0.02, 0.07)], low=-0.01)
    beside = [(x + 0.002, y) for x, y in MIDDLE]
    found = terms(tissue, line=beside, depth=0.04, tolerance=1e-3)
    assert found.covered == 0.0
    assert found.off_plan == pytest.approx(0.06 * 0.04, rel=ONE)
    assert found.path_error == pytest.approx(0.002, rel=ONE)
    assert found.largest_error == pytest.approx(0.002, rel=ONE)


def oblique(cells):
    """Return the terms of a cut that leaves its plan in the middle by an angle of 0.1."""
    tissue = body(cells, cut=EVERYWHERE)
    slope = np.tan(0.1)
    ends = [(0.0213 + slope * (y - 0.03), y) for y in (-0.01, 0.07)]
    upright_cut(tissue, ends, low=-0.01)
    plan = [(0.0213, y) for _, y in MIDDLE]
    return terms(tissue, line=plan, depth=0.04, tolerance=1e-3)


def test_a_cut_at_an_angle_is_off_its_plan_where_that_is_farther_than_the_tolerance():
    half = 0.03 / np.cos(0.1)  # of its length
    near = 1e-3 / np.sin(0.1)  # of the cut to its plan, and of the plan to the cut
    found, other = oblique(COARSE), oblique(FINE)
    assert found.area == pytest.approx(2.0 * half * 0.04, rel=ONE)
    off, error = 2.0 * (half - near) * 0.04, half * np.sin(0.1) / np.sqrt(3.0)
    assert found.off_plan == pytest.approx(off, rel=ONE)
    assert found.path_error == pytest.approx(error, rel=ONE)
    assert found.largest_error == pytest.approx(half * np.sin(0.1), rel=ONE)
    assert found.covered == pytest.approx(2.0 * near / 0.06, rel=ONE)
    for name in ("covered", "off_plan", "path_error", "largest_error"):
        assert getattr(other, name) == pytest.approx(getattr(found, name), rel=TWO)


@MESHES
def test_depth_is_compared_at_stations(cells):
    """The cut is 30 mm deep; planned are 20 mm, then 40."""
    tissue = body(cells)
    upright_cut(tissue, [(0.02, -0.01), (0.02, 0.07)], low=0.01)
    for depth, error in ((0.02, 0.01), (0.03, 0.0), (0.039, 0.009)):
        found = terms(tissue, line=MIDDLE, depth=depth).depth_error
        assert found == pytest.approx(error, rel=ONE, abs=3e-4 * ONE)


@MESHES
def test_where_nothing_is_cut_the_depth_is_none(cells):
    tissue = body(cells)
    upright_cut(tissue, [(0.02, -0.01), (0.02, 0.03)], low=0.01)
    error = terms(tissue, line=MIDDLE, depth=0.03).depth_error
    assert error == pytest.approx(0.03 * 0.03 / 0.06, rel=TWO)  # to half a station


def vessel(middles):
    """Return 1 for a bar across the body, 10 mm high and wide, from y = 20 to 30 mm."""
    y, z = middles[:, 1], middles[:, 2]
    return (y > 0.02) & (y < 0.03) & (z > 0.01) & (z < 0.02)


@MESHES
def test_the_area_cut_within_a_part_to_be_spared_is_known(cells):
    tissue = body(cells, labels=vessel)
    upright_cut(tissue, [(0.02, -0.01), (0.02, 0.07)], low=-0.01)
    found = terms(tissue, line=MIDDLE, depth=0.04, spare=spare("vessel"))
    assert found.spared_area[0] == pytest.approx(0.01 * 0.01, rel=ONE)
    assert found.spared_distance[0] == 0.0
    assert not found.is_spared


@MESHES
@pytest.mark.parametrize(("margin", "is_spared"), [(0.0095, True), (0.0105, False)])
def test_the_distance_of_a_cut_from_a_part_to_be_spared_is_known(cells, margin, is_spared):
    tissue = body(cells, labels=vessel)
    upright_cut(tissue, [(0.02, -0.01), (0.02, 0.01)], low=-0.01)
    found = terms(tissue, line=MIDDLE, depth=0.04, spare=spare("vessel", margin))
    assert found.spared_distance[0] == pytest.approx(0.01, rel=ONE)
    assert found.spared_area[0] == 0.0
    assert found.is_spared == is_spared


@MESHES
def test_a_cut_along_the_border_of_a_part_is_no_cut_of_it(cells):
    tissue = body(cells, labels=lambda middles: middles[:, 0] < 0.02)
    upright_cut(tissue, [(0.02, -0.01), (0.02, 0.07)], low=-0.01)
    found = terms(tissue, line=MIDDLE, depth=0.04, spare=spare("vessel"))
    assert found.spared_area[0] == 0.0
    assert found.is_spared


NAMES = ("area", "covered", "off_plan", "path_error", "largest_error", "depth_error")


def test_terms_do_not_change_with_the_pose_of_the_body():
    turn = Rotation.from_rotvec((0.4, -0.7, 1.1)).as_matrix()
    move = {"turn": turn, "shift": np.array([0.3, -0.2, 0.1])}
    found = []
    for pose in ({}, move):
        tissue = body(labels=vessel, cut=EVERYWHERE, **pose)
        turned, shift = pose.get("turn", np.eye(3)), pose.get("shift", 0.0)
        line = [tuple(turned @ (x, y, 0.04) + shift) for x, y in MIDDLE]
        task = {"line": line, "into": tuple(-turned[:, 2]), "depth": 0.03, "spare": spare("vessel")}
        there = CutTerms(yardstick(tissue, **task))
        moved_back = CutTerms(yardstick(body(labels=vessel), **LYING))
        upright_cut(tissue, [(0.018, -0.01), (0.024, 0.07)], low=0.012, **pose)
        faces = tissue.cut_faces()
        there.take(faces)
        moved_back.take(faces._replace(corners=(faces.corners - shift) @ turned))
        found.append((there, moved_back))
    (one, _), (other, moved_back) = found
    for name in NAMES:
        # Rows of places at just the tolerance are covered or not: half a row of 240.
        row = 0.5 / 240 if name == "covered" else 0.0
        assert getattr(other, name) == pytest.approx(
            getattr(moved_back, name), rel=1e-4, abs=1.1 * row
        ), name
        # Where the mesh is cut is a matter of rounding: this is another mesh.
        assert getattr(other, name) == pytest.approx(getattr(one, name), rel=TWO), name
    np.testing.assert_allclose(other.spared_area, one.spared_area, rtol=TWO)


def test_terms_grow_with_each_new_face_and_not_by_looking_again():
    tissue = body()
    scale = CutTerms(yardstick(tissue, line=MIDDLE, depth=0.04))
    seen, covered = 0, [0.0]
    for end in (0.01, 0.03, 0.03, 0.07):
        upright_cut(tissue, [(0.02, -0.01), (0.02, end)], low=-0.01)
        scale.take(tissue.cut_faces(since=seen))
        seen = tissue.n_cut_faces
        covered.append(scale.covered)
    assert covered[1] < covered[2] == covered[3] < covered[4] == 1.0
    whole = terms(tissue, line=MIDDLE, depth=0.04)
    assert scale.area == pytest.approx(SIZE[1] * SIZE[2], rel=1e-9)
    np.testing.assert_array_equal(scale.is_covered, whole.is_covered)
