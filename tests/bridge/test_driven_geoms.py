"""Geoms that the arm's side drives, over the link in this process."""

import time

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from bridge import Bridge, GeomLoads, GeomPoses, InProcessLink, VirtualCoupling
from bridge.driven import mean_geom_loads
from tests.bridge.bits import bits
from tests.bridge.test_driven_frames import CUBE, DT, FAR, cube
from tissue import Geom, fixed_nodes

BALL = Geom("ball", "sphere", (0.004,), 0.3)
TABLE = Geom("table", "plane", friction=0.5)
BOTH = [BALL, TABLE]


def places(i):
    """A ball that goes down into the top of the cube, and turns, above a table that stays."""
    turned = Rotation.from_rotvec([[0.0, 0.02 * i, 0.0], [0.0, 0.0, 0.0]]).as_matrix()
    return GeomPoses(np.array([[0.01, 0.01, 0.0241 - 2e-5 * i], [0.0, 0.0, -1e-4]]), turned)


def test_what_a_geom_feels_and_what_the_tissue_feels_sum_to_zero():
    link = InProcessLink(cube())
    link.collide_with(BOTH, places(0))
    for i in range(1, 60):
        found = link.step(None, DT, (), places(i)).contacts
        on_tissue = (found.normal_force[:, None] * found.normal + found.friction).sum(axis=0)
        assert on_tissue + link.geom_loads().forces.sum(axis=0) == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("n", [0, 1, 3])
def test_a_wrong_number_of_geoms_is_refused_and_nothing_moves(n):
    link = InProcessLink(cube())
    link.collide_with(BOTH, places(0))
    before = bits(link.snapshot())
    poses = GeomPoses(np.zeros((n, 3)), np.tile(np.eye(3), (n, 1, 1)))
    with pytest.raises(ValueError, match="and 2 geoms are driven from here"):
        link.step(None, DT, (), poses)
    with pytest.raises(ValueError, match="and 2 geoms are driven from here"):
        link.collide_with(BOTH, poses)
    assert bits(link.snapshot()) == before


def test_other_geoms_take_the_place_of_those_before():
    link = InProcessLink(cube())
    link.collide_with(BOTH, places(0))
    link.collide_with([], GeomPoses(np.zeros((0, 3)), np.zeros((0, 3, 3))))
    link.step(None, DT)
    assert link.n_geoms == 0 and link.geom_loads().forces.shape == (0, 3)


def test_a_bridge_s_geoms_feel_what_those_of_the_tissue_feel():
    tissue, beside = cube(), cube()
    bridge = Bridge(tissue)
    driven, contact = bridge.collide_with(BOTH, places(0)), beside.collide_with(BOTH, *places(0))
    assert len(driven.forces().geom) == 0
    for i in range(1, 60):
        driven.move(places(i))
        contact.move(*places(i))
        bridge.step(FAR, DT)
        beside.step(None, DT)
        assert bits(tuple(driven.loads)) == bits(contact.wrenches())
    there, here = contact.forces(), driven.forces()
    assert len(there.geom) > 0 and bits((there.geom, there.point)) == bits((here.geom, here.point))
    assert here.normal == pytest.approx(there.normal)
    assert here.force == pytest.approx(there.force, abs=1e-12)


@pytest.mark.parametrize("changes", [{"tissue_every": 4}, {"coupling": VirtualCoupling()}])
def test_where_the_tissue_is_queried_seldom_the_geoms_go_as_they_were_driven(changes):
    """One that is there from the middle of a period is at rest up to there."""
    tissue = cube()
    bridge = Bridge(tissue, **changes)
    bridge.step(FAR, DT)
    bridge.step(FAR, DT)
    driven = bridge.collide_with(BOTH, places(0))
    for i in range(1, 80):
        driven.move(places(min(i, 50)))
        bridge.step(FAR, DT)
    assert driven.loads.forces[0, 2] > 0.01
    deepest = tissue.snapshot().positions[fixed_nodes(CUBE, "top"), 2].min()
    assert deepest == pytest.approx(0.0241 - 50 * 2e-5 - 0.004, abs=1e-4)


def test_what_is_made_while_an_answer_is_due_takes_the_next_one():
    """An arm that does not wait attaches and touches while the tissue is busy."""
    bridge = Bridge(cube(), waits=False)
    bridge.step(FAR, DT)
    driven = bridge.collide_with(BOTH, places(0))
    grip = bridge.attach([[0.0, 0.0, 0.02]], stiffness=50.0)
    for i in range(1, 60):
        driven.move(places(i))
        grip.move([0.0, 0.0, 0.02 + 1e-5 * i])
        bridge.step(FAR, DT)
        time.sleep(2e-3)
    assert driven.loads.forces[0, 2] > 0.01
    assert grip.n_points == 1 and grip.wrench.force[2] < 0.0


@pytest.mark.parametrize(
    ("origins", "rotations", "expected"),
    [
        ([[0.0, np.nan, 0.0]], [np.eye(3)], r"origin of geom 'ball' is \[0.0, nan, 0.0\]"),
        ([[0.0, 0.0, 0.0]], [2.0 * np.eye(3)], "rotation of geom 'ball' is"),
        ([[0.0, 0.0, 0.0]], [-np.eye(3)], "rotation of geom 'ball' is"),
        ([0.0, 0.0, 0.0], [np.eye(3)], "1 geoms are driven from here"),
    ],
)
def test_a_pose_that_is_none_is_refused_before_the_tissue_moves(origins, rotations, expected):
    at_first = GeomPoses(np.array([[0.01, 0.01, 0.03]]), np.eye(3)[None])
    driven = Bridge(cube()).collide_with([BALL], at_first)
    with pytest.raises(ValueError, match=expected):
        driven.move(GeomPoses(np.array(origins), np.array(rotations)))
    assert bits(driven.poses) == bits(at_first)


def test_mean_loads_are_those_of_the_impulses():
    """1 N for 1 s and 3 N for 3 s, both upwards through x = 0, on a geom that moves along x."""
    up = np.array([[0.0, 0.0, 1.0]])
    origins = [np.array([[1.0, 0.0, 0.0]]), np.array([[2.0, 0.0, 0.0]])]
    parts = [
        GeomLoads(size * up, np.cross(-at, size * up))
        for size, at in zip((1.0, 3.0), origins, strict=True)
    ]
    mean = mean_geom_loads(parts, origins, [1.0, 3.0])
    assert mean.forces == pytest.approx(2.5 * up)
    assert mean.torques == pytest.approx(np.cross(-origins[1], 2.5 * up))
