"""Geoms that are led over TCP act to the bit as in process, and what is wrong is refused."""

import contextlib
import json
import struct

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from bridge import Bridge, GeomPoses, InProcessLink, LinkError
from bridge.tcp.channel import LARGEST_PART
from bridge.tcp.messages.step import pack_step
from bridge.tcp.wire import MessageKind
from tests.bridge.bits import bits
from tests.bridge.tcp.bare_sockets import DT, connected_client, link_once_free
from tests.bridge.tcp.serve_block import SIDE, block_tissue
from tests.bridge.tcp.test_led_frames_over_tcp import asked
from tissue import Geom, RigidContacts

WEDGE = np.array([[-3e-3, 0, 0], [3e-3, 0, 0], [0, 3e-3, 0], [0, -3e-3, 0], [0, 0, 4e-3]])
STARTS = {
    "plane": (Geom("table", "plane", (), 0.5), (0.0, 0.0, -1e-4), (0.0, 0.0, 0.0)),
    "sphere": (Geom("ball", "sphere", (3e-3,), 0.3), (0.006, 0.005, 0.0231), (0.0, 0.0, -1.0)),
    "capsule": (
        Geom("rod", "capsule", (2e-3, 4e-3), 0.2),
        (0.014, 0.005, 0.0221),
        (0.0, 0.0, -1.0),
    ),
    "cylinder": (
        Geom("can", "cylinder", (3e-3, 2e-3), 0.2),
        (0.006, 0.015, 0.0222),
        (0.0, 0.0, -1.0),
    ),
    "ellipsoid": (
        Geom("egg", "ellipsoid", (3e-3, 2e-3, 4e-3), 0.1),
        (0.014, 0.015, 0.0242),
        (0.0, 0.0, -1.0),
    ),
    "box": (Geom("board", "box", (4e-3, 2e-3, 4e-3), 0.4), (0.01, -0.0021, 0.01), (0.0, 1.0, 0.0)),
    "mesh": (Geom("wedge", "mesh", (), 0.2, WEDGE), (SIDE / 3, 0.0241, 0.01), (0.0, -1.0, 0.0)),
}
"""A geom of each shape around the block, where it begins, and the way it goes; the table stays."""
GEOMS = [geom for geom, _, _ in STARTS.values()]
SPEED = 0.02
"""Of each [m/s]."""


def places(i):
    """Where they are after `i` steps; they turn as they go, but for the table."""
    at = np.array([start for _, start, _ in STARTS.values()])
    ways = np.array([way for _, _, way in STARTS.values()])
    turned = Rotation.from_rotvec(2e-3 * i * ways).as_matrix()
    axes = np.tile(np.eye(3), (len(GEOMS), 1, 1))
    lying = Rotation.from_euler("y", 90, degrees=True).as_matrix()
    axes[2], axes[6] = lying, Rotation.from_euler("x", 90, degrees=True).as_matrix()
    return GeomPoses(at + SPEED * DT * i * ways, turned @ axes)


@pytest.fixture
def link(server):
    with contextlib.closing(link_once_free(server.address)) as link:
        yield link


def touched_held_and_cut(link, upright):
    """All geoms push the block, a grip holds it, and a blade goes in between them."""
    bridge, found = Bridge(link), []
    contact = bridge.collide_with(GEOMS, places(0))
    grip = bridge.attach("sphere:0.0,0.0,0.02,0.004", stiffness=50.0, damping=0.5)
    for i in range(1, 150):
        contact.move(places(min(i, 60)))
        grip.move(grip.pose.origin + np.array([0.0, 0.0, 1e-6]))
        bridge.step(upright(0.01, -0.008 + 0.1 * DT * i), DT)
        result = bridge.result._replace(stage_times=None)
        copied = result._replace(contacts=RigidContacts(*map(np.copy, result.contacts)))
        loads = tuple((tuple(load.wrench), load.n_points) for load in bridge.frame_loads)
        found.append((copied, loads, contact.loads, contact.forces()))
    return found


def test_geoms_over_tcp_are_the_same_as_in_process_bit_for_bit(link, upright):
    here = InProcessLink(block_tissue())
    of_here = touched_held_and_cut(here, upright)
    of_there = touched_held_and_cut(link, upright)
    assert [bits(each) for each in of_here] == [bits(each) for each in of_there]
    assert bits(here.snapshot()) == bits(link.snapshot())
    largest = np.max([np.abs(loads.forces).max(axis=1) for _, _, loads, _ in of_here], axis=0)
    assert (largest > 1e-3).all()  # each of them was touched
    numbers = {int(geom) for result, *_ in of_here for geom in result.contacts.geom}
    assert numbers == {-1, *range(len(GEOMS))}
    assert of_here[-1][0].cut_area > 1e-5


def test_geoms_of_all_shapes_push_the_block_away_from_them(link):
    link.collide_with(GEOMS, places(0))
    for i in range(1, 60):
        link.step(None, DT, (), places(i))
    ways = np.array([way for _, _, way in STARTS.values()])
    along = (link.geom_loads().forces * ways).sum(axis=1)
    assert (along[1:] < -1e-3).all()


def test_a_wrong_number_of_geoms_is_refused_and_the_link_stays(link):
    link.collide_with(GEOMS, places(0))
    with pytest.raises(ValueError, match="and 7 geoms are driven from here"):
        link.step(None, DT)
    assert link.step(None, DT, (), places(1)).n_tetrahedra == 72


BALL = Geom("ball", "sphere", (3e-3,))
CENTRE = np.array([[SIDE / 3, 0.01, 0.01]])
ABOVE = GeomPoses(np.array([[0.01, 0.01, 0.03]]), np.eye(3)[None])


@pytest.mark.parametrize(
    ("geoms", "poses", "expected"),
    [
        ([BALL._replace(shape="cone")], ABOVE, "geom 'ball' has the shape 'cone'; there are plane"),
        ([BALL._replace(size=())], ABOVE, r"sizes \(\); a sphere has 1"),
        ([BALL._replace(friction=-1.0)], ABOVE, "friction of -1.0"),
        ([BALL._replace(friction=np.nan)], ABOVE, "Expected `float`, got `null`"),
        ([BALL._replace(shape="mesh")], ABOVE, "needs `vertices`"),
        ([BALL], ABOVE._replace(origins=CENTRE), "mm inside the tissue at"),
        ([BALL], ABOVE._replace(origins=np.full((1, 3), 1e4)), "geom 0 is not within 1000 m"),
        ([BALL], ABOVE._replace(rotations=np.zeros((1, 3, 3))), "axes of geom 0 are no rotation"),
        ([BALL, BALL], GeomPoses(*(np.repeat(a, 2, 0) for a in ABOVE)), "two geoms have the name"),
    ],
)
def test_what_cannot_be_touched_is_refused_and_what_was_touched_before_stays(
    link, geoms, poses, expected
):
    link.collide_with([BALL], ABOVE)
    with pytest.raises(LinkError, match=expected):
        link.collide_with(geoms, poses)
    assert link.step(None, DT, (), ABOVE).n_tetrahedra == 72
    assert link.geom_loads().forces.shape == (1, 3)


@pytest.mark.parametrize(
    ("poses", "expected"),
    [
        (ABOVE._replace(origins=np.array([[0.01, 0.01, 900.0]])), "more than 500 increments"),
        (ABOVE._replace(rotations=np.diag([-1.0, -1, 1])[None]), "turns by more than"),
        (ABOVE._replace(origins=np.array([[np.nan, 0, 0]])), "geom 0 is not within 1000 m"),
    ],
)
def test_a_motion_that_no_step_can_follow_is_refused_and_nothing_moves(link, poses, expected):
    link.collide_with([BALL], ABOVE)
    before = bits(link.snapshot())
    with pytest.raises(LinkError, match=expected):
        link.step(None, DT, (), poses)
    assert bits(link.snapshot()) == before
    assert link.step(None, DT, (), ABOVE).n_tetrahedra == 72


def test_meshes_that_no_request_holds_are_refused_before_they_are_sent(link):
    points = np.random.default_rng(0).random((LARGEST_PART // 32 + 1, 3))
    many = Geom("many", "mesh", vertices=points)
    with pytest.raises(LinkError, match="give meshes of fewer vertices"):
        link.collide_with([many], ABOVE)
    assert link.step(None, DT).n_tetrahedra == 72


def test_a_server_refuses_geoms_and_poses_that_no_client_of_ours_sends(server):
    with connected_client(server.address) as peer:
        placed = {"origin": [0, 0, 1], "rotation": [1, 0, 0, 0, 1, 0, 0, 0, 1]}
        ball = {"name": "ball", "shape": "sphere", "size": [0.01]} | placed
        bad = json.dumps({"geoms": [ball | {"size": [-1]}]}).encode()
        assert "geoms cannot be read" in asked(peer, 1, MessageKind.COLLIDE, bad)
        assert asked(peer, 2, MessageKind.COLLIDE, json.dumps({"geoms": [ball]}).encode()) == ""
        none = pack_step(None, DT)
        assert "0 frames and 1 geoms" in asked(peer, 3, MessageKind.STEP, none)
        flat = struct.pack("<13d", DT, *[0.0] * 12)
        assert "axes of geom 0 are no" in asked(peer, 4, MessageKind.STEP, flat)


def test_each_client_gets_a_tissue_that_touches_nothing(server):
    for _ in range(2):
        with contextlib.closing(link_once_free(server.address)) as link:
            assert link.step(None, DT).n_tetrahedra == 72
            link.collide_with(GEOMS, places(0))
