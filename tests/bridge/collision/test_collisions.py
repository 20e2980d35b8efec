import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge import FixtureBox, FixtureMesh
from bridge.collision.arm_geoms import ArmGeom
from bridge.collision.collisions import Collisions

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


def look(collisions, *places, axes=UPRIGHT):
    """Put all geoms, one to each place, into the same orientation."""
    return collisions.colliding_pairs(np.array(places), np.stack([axes] * len(places)))


@pytest.mark.parametrize(("gap", "meets"), [(-1e-6, True), (1e-6, False)])
def test_a_rod_meets_the_table_when_its_cap_does(gap, meets):
    found = look(Collisions([ROD], [TABLE]), (0.0, 0.0, 0.11 + gap))
    assert found == ((("rod", "table"),) if meets else ())


def test_a_rod_that_lies_slanted_over_an_edge_is_told_apart_from_its_box():
    # Its axis-aligned box would reach 71 mm down.
    assert look(Collisions([ROD], [TABLE]), (0.0, 0.52, 0.065), axes=turned(math.pi / 4)) == ()
    assert look(Collisions([ROD], [TABLE]), (0.0, 0.4, 0.065), axes=turned(math.pi / 4)) != ()


def test_every_pair_is_named_in_the_order_of_the_geoms():
    both = Collisions([ROD, BLADE], [TABLE, SHEET])
    assert look(both, (0.3, 0.0, 1.0), (0.0, 0.0, 1.0)) == ()
    places = (0.3, 0.495, 0.0), (0.0, 0.0, 0.0)
    assert look(both, *places) == (("rod", "table"), ("rod", "sheet"), ("blade", "table"))


@pytest.mark.parametrize("geom", [ROD, BLADE], ids=["rod", "blade"])
def test_a_geom_does_not_jump_over_a_sheet_in_one_frame(geom):
    collisions = Collisions([geom], [SHEET])
    assert look(collisions, (0.0, 0.4, 1.0)) == ()
    assert look(collisions, (0.0, 0.6, 1.0)) == ((geom.name, "sheet"),)
    assert look(collisions, (0.0, 0.6, 1.0)) == ()


def test_a_geom_that_swings_through_a_sheet_is_seen_though_its_centre_stays():
    collisions = Collisions([ROD], [SHEET])
    assert look(collisions, (0.0, 0.45, 1.0), axes=turned(0.3)) == ()
    assert look(collisions, (0.0, 0.45, 1.0), axes=turned(math.pi - 0.3)) == (("rod", "sheet"),)
    assert look(collisions, (0.0, 0.45, 1.0), axes=turned(math.pi - 0.3)) == ()


@given(
    st.floats(-1.0, 1.0),
    st.floats(-1.0, 1.0),
    st.floats(0.01, 3.0),
    st.floats(0.0, 1.0),
    st.floats(-0.1, 0.1),
)
def test_a_part_that_goes_along_an_arc_meets_all_that_is_on_it(y, z, angle, when, along):
    """A rod on an arm that turns about the x axis through the origin: a crumb on its way is met."""
    start = np.array([0.0, y, z])
    crumb_at = turned(when * angle) @ (start + np.array([0.0, 0.0, along]))
    crumb = FixtureBox("crumb", np.full(3, 1e-4), crumb_at)
    collisions = Collisions([ROD], [crumb])
    first = look(collisions, start)
    second = look(collisions, turned(angle) @ start, axes=turned(angle))
    assert first + second != ()


def test_the_instrument_must_not_meet_the_arm_but_for_the_links_next_to_it():
    forearm = ArmGeom("forearm", "capsule", (0.01, 0.1))
    wrist = ArmGeom("wrist", "sphere", (0.02,), checked_against_instrument=False)
    collisions = Collisions([forearm, wrist, BLADE])
    assert look(collisions, *[(0.0, 0.0, 0.0)] * 3) == (("blade", "forearm"),)
    assert look(collisions, (0.0, 1.0, 0.0), *[(0.0, 0.0, 0.0)] * 2) == ()


def test_what_stands_on_the_table_does_not_meet_it():
    base = ArmGeom("base", "cylinder", (0.1, 0.1), checked_against_fixtures=False)
    assert look(Collisions([base], [TABLE]), (0.0, 0.0, 0.1)) == ()


def test_an_arm_without_parts_and_a_world_without_fixtures_meet_nothing():
    assert look(Collisions([ROD]), (0.0, 0.0, 0.0)) == ()
    nothing = Collisions([], [TABLE])
    assert nothing.colliding_pairs(np.zeros((0, 3)), np.zeros((0, 3, 3))) == ()


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_a_pose_that_is_not_finite_is_refused_before_the_collision_library_sees_it(bad):
    with pytest.raises(ValueError, match="pose of a geom of the arm is not finite"):
        look(Collisions([ROD], [TABLE]), (0.0, bad, 0.0))


def test_two_geoms_or_fixtures_of_one_name_are_refused():
    with pytest.raises(ValueError, match="two geoms have the name 'rod'"):
        Collisions([ROD, ROD])
    with pytest.raises(ValueError, match="two fixtures have the name 'table'"):
        Collisions([ROD], [TABLE, TABLE])


def test_poses_of_another_number_of_parts_are_refused():
    with pytest.raises(ValueError, match=r"poses of shape \(2, 3\) .* for 1 geoms"):
        look(Collisions([ROD], [TABLE]), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
