import math

import fcl
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge import FixtureBox, FixtureMesh
from bridge.collision.collisions import ArmGeom, Collisions

TABLE = FixtureBox("table", np.array([1.0, 1.0, 0.02]), np.array([0.0, 0.0, -0.01]))
SHEET = FixtureMesh(
    "sheet",
    np.array([[-9.0, 0.5, -9.0], [9.0, 0.5, -9.0], [0.0, 0.5, 9.0]]),
    np.array([[0, 1, 2]]),
)
ROD = ArmGeom("rod", "capsule", (0.01, 0.1))
BLADE = ArmGeom("blade", "box", (0.02, 2e-4, 3e-3), is_instrument=True)
UPRIGHT = np.eye(3)


def turned(angle):
    """Return axes turned about x."""
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])


def pairs_at(collisions, *positions, axes=UPRIGHT):
    """Return the colliding pairs of geoms at positions, all in the same orientation."""
    return collisions.colliding_pairs(np.array(positions), np.stack([axes] * len(positions)))


@pytest.mark.parametrize(("gap", "collides"), [(-1e-6, True), (1e-6, False)])
def test_a_rod_collides_with_the_table_when_its_cap_does(gap, collides):
    found = pairs_at(Collisions([ROD], [TABLE]), (0.0, 0.0, 0.11 + gap))
    assert found == ((("rod", "table"),) if collides else ())


def test_a_slanted_rod_above_an_edge_is_tested_by_its_shape_and_not_by_its_box():
    # The axis-aligned box of the rod would reach 71 mm down.
    assert pairs_at(Collisions([ROD], [TABLE]), (0.0, 0.52, 0.065), axes=turned(math.pi / 4)) == ()
    assert pairs_at(Collisions([ROD], [TABLE]), (0.0, 0.4, 0.065), axes=turned(math.pi / 4)) != ()


def test_every_pair_is_named_in_the_order_of_the_geoms():
    both = Collisions([ROD, BLADE], [TABLE, SHEET])
    assert pairs_at(both, (0.3, 0.0, 1.0), (0.0, 0.0, 1.0)) == ()
    positions = (0.3, 0.495, 0.0), (0.0, 0.0, 0.0)
    assert pairs_at(both, *positions) == (("rod", "table"), ("rod", "sheet"), ("blade", "table"))


@pytest.mark.parametrize("geom", [ROD, BLADE], ids=["rod", "blade"])
def test_a_geom_does_not_jump_over_a_sheet_in_one_frame(geom):
    collisions = Collisions([geom], [SHEET])
    assert pairs_at(collisions, (0.0, 0.4, 1.0)) == ()
    assert pairs_at(collisions, (0.0, 0.6, 1.0)) == ((geom.name, "sheet"),)
    assert pairs_at(collisions, (0.0, 0.6, 1.0)) == ()


def test_a_geom_that_swings_through_a_sheet_is_found_although_its_centre_stays():
    collisions = Collisions([ROD], [SHEET])
    assert pairs_at(collisions, (0.0, 0.45, 1.0), axes=turned(0.3)) == ()
    assert pairs_at(collisions, (0.0, 0.45, 1.0), axes=turned(math.pi - 0.3)) == (("rod", "sheet"),)
    assert pairs_at(collisions, (0.0, 0.45, 1.0), axes=turned(math.pi - 0.3)) == ()


@given(
    st.floats(-1.0, 1.0),
    st.floats(-1.0, 1.0),
    st.floats(0.01, 3.0),
    st.floats(0.0, 1.0),
    st.floats(-0.1, 0.1),
)
def test_a_geom_that_moves_along_an_arc_collides_with_what_is_on_it(y, z, angle, when, along):
    """A rod on an arm turns about the x axis through the origin; a crumb lies on its path."""
    start = np.array([0.0, y, z])
    crumb_at = turned(when * angle) @ (start + np.array([0.0, 0.0, along]))
    crumb = FixtureBox("crumb", np.full(3, 1e-4), crumb_at)
    collisions = Collisions([ROD], [crumb])
    first = pairs_at(collisions, start)
    second = pairs_at(collisions, turned(angle) @ start, axes=turned(angle))
    assert first + second != ()


def test_the_instrument_is_tested_against_the_arm_except_the_links_next_to_it():
    forearm = ArmGeom("forearm", "capsule", (0.01, 0.1))
    wrist = ArmGeom("wrist", "sphere", (0.02,), checked_against_instrument=False)
    collisions = Collisions([forearm, wrist, BLADE])
    assert pairs_at(collisions, *[(0.0, 0.0, 0.0)] * 3) == (("blade", "forearm"),)
    assert pairs_at(collisions, (0.0, 1.0, 0.0), *[(0.0, 0.0, 0.0)] * 2) == ()


def test_a_base_on_the_table_is_not_tested_against_it():
    base = ArmGeom("base", "cylinder", (0.1, 0.1), checked_against_fixtures=False)
    assert pairs_at(Collisions([base], [TABLE]), (0.0, 0.0, 0.1)) == ()


def test_without_geoms_or_without_fixtures_nothing_collides():
    assert pairs_at(Collisions([ROD]), (0.0, 0.0, 0.0)) == ()
    nothing = Collisions([], [TABLE])
    assert nothing.colliding_pairs(np.zeros((0, 3)), np.zeros((0, 3, 3))) == ()


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_a_pose_that_is_not_finite_is_refused_before_the_collision_library_sees_it(bad):
    with pytest.raises(ValueError, match="pose of a geom of the arm is not finite"):
        pairs_at(Collisions([ROD], [TABLE]), (0.0, bad, 0.0))


def test_two_geoms_or_fixtures_with_the_same_name_are_refused():
    with pytest.raises(ValueError, match="two geoms have the name 'rod'"):
        Collisions([ROD, ROD])
    with pytest.raises(ValueError, match="two fixtures have the name 'table'"):
        Collisions([ROD], [TABLE, TABLE])


def test_a_wrong_number_of_poses_is_refused():
    with pytest.raises(ValueError, match=r"poses of shape \(2, 3\) .* for 1 geoms"):
        pairs_at(Collisions([ROD], [TABLE]), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))


@pytest.mark.parametrize(
    ("shape", "sizes", "why"),
    [
        ("cone", (1.0, 1.0), "is a 'cone'; wanted one of box, sphere"),
        ("box", (1.0, 1.0), "a box has 3, all positive"),
        ("sphere", (0.0,), "all positive"),
        ("capsule", (1.0, math.nan), "all positive"),
        ("cylinder", (1.0, math.inf), "all positive"),
    ],
)
def test_a_geom_of_unknown_shape_or_bad_size_is_refused_by_name(shape, sizes, why):
    with pytest.raises(ValueError, match=f"geom 'wrist'.*{why}"):
        ArmGeom("wrist", shape, sizes)


@pytest.mark.parametrize(
    ("shape", "sizes", "half_extents"),
    [
        ("box", (1.0, 2.0, 3.0), (1.0, 2.0, 3.0)),
        ("sphere", (2.0,), (2.0, 2.0, 2.0)),
        ("capsule", (1.0, 3.0), (1.0, 1.0, 4.0)),
        ("cylinder", (1.0, 3.0), (1.0, 1.0, 3.0)),
    ],
)
def test_the_box_around_a_geom_is_that_of_the_collision_library(shape, sizes, half_extents):
    geom = ArmGeom("wrist", shape, sizes)
    np.testing.assert_array_equal(geom.half_extents, half_extents)
    collision_object = fcl.CollisionObject(geom.geometry(), fcl.Transform())
    for axis in range(3):
        for gap, collides in ((-1e-3, True), (1e-3, False)):
            centre = np.zeros(3)
            centre[axis] = half_extents[axis] + 0.01 + gap
            probe = fcl.CollisionObject(fcl.Sphere(0.01), fcl.Transform(centre))
            assert bool(fcl.collide(collision_object, probe)) == collides


@pytest.mark.parametrize(
    ("size", "centre", "why"),
    [
        ([1.0, 0.0, 1.0], [0.0, 0.0, 0.0], "all must be positive"),
        ([1.0, 1.0, np.nan], [0.0, 0.0, 0.0], "not finite"),
        ([1.0, 1.0], [0.0, 0.0, 0.0], "wanted"),
        ([1.0, 1.0, 1.0], [0.0, np.inf, 0.0], "centre of fixture 'table' is not finite"),
    ],
)
def test_a_malformed_box_is_refused_by_name(size, centre, why):
    with pytest.raises(ValueError, match=f"fixture 'table'.*{why}|{why}"):
        FixtureBox("table", np.array(size), np.array(centre))


@pytest.mark.parametrize(
    ("triangles", "why"),
    [
        ([[0, 1, 3]], "refer to vertices 0 to 3, but its vertices are 0 to 2"),
        ([[0, 1, -1]], "refer to vertices -1 to 1"),
        (np.zeros((0, 3), int), "wanted"),
        ([[0, 1]], "wanted"),
        ([[0.0, 1.0, 2.0]], "type float64; wanted vertex indices"),
    ],
)
def test_triangles_that_would_end_the_process_are_refused_by_name(triangles, why):
    with pytest.raises(ValueError, match=f"fixture 'clamp'.*{why}"):
        FixtureMesh("clamp", np.eye(3), np.array(triangles))
