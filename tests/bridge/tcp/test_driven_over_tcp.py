"""Frames and geoms driven over TCP act to the bit as in process; what is wrong is refused."""

import contextlib
import threading

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from bridge import Bridge, GeomPoses, InProcessLink, LinkError, TcpLink
from bridge.driven import FrameAttachment, FrameTie
from bridge.tcp.channel import LARGEST_PART
from bridge.tcp.messages.driven import ATTACHMENT, NUMBER, pack_geoms
from bridge.tcp.messages.step import pack_step
from bridge.tcp.server import TissueServer
from bridge.tcp.wire import MessageKind, pack_frame
from tests.bridge.bits import bits
from tests.bridge.changed_messages import with_number
from tests.bridge.tcp.bare_sockets import DT, connected_client, link_once_free, read_one
from tests.bridge.tcp.serve_block import SIDE, block_tissue
from tests.bridge.test_driven_frames import pose
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


BALL = Geom("ball", "sphere", (3e-3,))
CENTRE = np.array([[SIDE / 3, 0.01, 0.01]])
ABOVE = GeomPoses(np.array([[0.01, 0.01, 0.03]]), np.eye(3)[None])


@pytest.fixture
def link(server):
    with contextlib.closing(link_once_free(server.address)) as link:
        yield link


def held_tied_and_cut(link, upright):
    """Two grips, one of which lets go by itself, and two fibres, between which a blade cuts."""
    bridge, found = Bridge(link), []
    grips = [
        bridge.attach([[x, 0.01, 0.02]], stiffness=50.0, damping=0.5, breaks_at=limit)
        for x, limit in ((0.004, np.inf), (0.016, 0.02))
    ]
    tie = bridge.tie(
        [[0.004, 0.01, 0.02], [0.016, 0.01, 0.02]],
        [[0.004, 0.01, 0.05], [0.03, 0.03, 0.03]],
        stiffness=100.0,
        area=1e-6,
        toughness=100.0,
        damping=0.1,
        breaks_at=2.0,
    )
    for i in range(200):
        for grip in grips:
            grip.move(grip.pose.origin + np.array([0.0, 0.0, 2e-5]), pose(i).rotation)
        bridge.step(upright(0.02, -0.002 + 0.2 * DT * i), DT)
        found.append([(tuple(load.wrench), load.n_points) for load in bridge.frame_loads])
        if i == 170:
            bridge.release(grips[0])
            bridge.release(tie)
    return found


def test_frames_over_tcp_are_the_same_as_in_process_bit_for_bit(link, upright):
    here = InProcessLink(block_tissue())
    of_here, of_there = held_tied_and_cut(here, upright), held_tied_and_cut(link, upright)
    assert bits(tuple(map(tuple, of_here))) == bits(tuple(map(tuple, of_there)))
    assert bits(here.snapshot()) == bits(link.snapshot())
    assert [[n for _, n in of_here[i]] for i in (0, 160, 180)] == [[1, 1, 2], [1, 0, 1], [0, 0, 0]]


def test_a_wrong_number_of_poses_is_refused_and_the_link_stays(link):
    link.attach(FrameAttachment("top", 100.0))
    with pytest.raises(ValueError, match="poses of 0 frames, and 1 are driven"):
        link.step(None, DT)
    assert link.step(None, DT, [pose(0)]).n_tetrahedra == 72


FIBRES = FrameTie("top", np.array([[0.01, 0.01, 0.05]]), 100.0, 1e-6, 50.0)


@pytest.mark.parametrize(
    ("spec", "expected"),
    [
        (FrameAttachment("tpo", 100.0), "Did you mean 'top'"),
        (FrameAttachment("top", -1.0), "stiffness is -1.0"),
        (FrameAttachment(np.array([[9.0, 9.0, 9.0]]), 100.0), "outside the body"),
        (FIBRES._replace(area=0.0), "area is 0.0 m2; it must be positive"),
        (FIBRES._replace(stiffness=np.inf), "the request to tie a frame cannot be read"),
        (
            FIBRES._replace(to=np.tile(FIBRES.to, (2, 1))),
            "one place in m, or one for each of",
        ),
    ],
)
def test_an_impossible_frame_is_refused_and_the_link_stays(link, spec, expected):
    add = link.attach if isinstance(spec, FrameAttachment) else link.tie
    with pytest.raises(LinkError, match=expected):
        add(spec)
    assert link.step(None, DT).n_tetrahedra == 72 and len(link.loads()) == 0


def test_more_frames_than_there_may_be_are_refused(monkeypatch):
    server = TissueServer(block_tissue, port=0)
    monkeypatch.setattr("bridge.tcp.server.MAX_FRAMES", 1)
    threading.Thread(target=server.run, daemon=True).start()
    with contextlib.closing(TcpLink(server.address)) as other:
        other.tie(FIBRES)
        with pytest.raises(LinkError, match="there are 1 frames, and there may be no more"):
            other.attach(FrameAttachment("top", 100.0))


def test_a_frame_that_is_not_there_is_not_released(link):
    with pytest.raises(LinkError, match="there is no frame 0; there are 0"):
        link.release(0)


def text_of_reply(peer, sequence, kind, payload):
    """Return the text of the reply to a message from a bare socket."""
    peer.sendall(pack_frame(kind, sequence, payload))
    return read_one(peer).payload.decode(errors="replace")


def test_a_server_refuses_poses_and_frames_that_no_client_of_ours_sends(server):
    with connected_client(server.address) as peer:
        attach = ATTACHMENT.pack(FrameAttachment("top", 10.0))
        text_of_reply(peer, 1, MessageKind.ATTACH, attach)
        bad = with_number(pack_step(None, DT, [pose(0)]), "frames", 0, np.nan)
        assert "frame 0 is not within" in text_of_reply(peer, 2, MessageKind.STEP, bad)
        none = pack_step(None, DT)
        assert "0 frames and 0 geoms; 1 frames" in text_of_reply(peer, 3, MessageKind.STEP, none)
        other = NUMBER.pack(1)
        assert "there is no frame 1" in text_of_reply(peer, 4, MessageKind.RELEASE, other)
        ball = pack_geoms([BALL], ABOVE)
        assert text_of_reply(peer, 5, MessageKind.COLLIDE, ball) == ""
        one = pack_step(None, DT, [pose(0)])
        assert "1 frames and 0 geoms; 1 frames and 1" in text_of_reply(
            peer, 6, MessageKind.STEP, one
        )


def test_each_client_gets_a_tissue_that_nobody_holds_or_touches(server):
    for _ in range(2):
        with contextlib.closing(link_once_free(server.address)) as link:
            assert isinstance(link, TcpLink) and len(link.loads()) == 0
            assert link.step(None, DT).n_tetrahedra == 72
            link.attach(FrameAttachment("top", 100.0))
            link.collide_with(GEOMS, places(0))


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


def test_a_wrong_number_of_geoms_is_refused_and_the_link_stays(link):
    link.collide_with(GEOMS, places(0))
    with pytest.raises(ValueError, match="and 7 geoms are driven from here"):
        link.step(None, DT)
    assert link.step(None, DT, (), places(1)).n_tetrahedra == 72


@pytest.mark.parametrize(
    ("geoms", "poses", "expected"),
    [
        ([BALL._replace(shape="cone")], ABOVE, "geom 'ball' has the shape 'cone'; there are plane"),
        ([BALL._replace(shape="mesh")], ABOVE, "needs `vertices`"),
        ([BALL], ABOVE._replace(origins=CENTRE), "mm inside the tissue at"),
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
    points = np.random.default_rng(0).random((LARGEST_PART // 24 + 1, 3))
    many = Geom("many", "mesh", vertices=points)
    with pytest.raises(LinkError, match="give meshes of fewer vertices"):
        link.collide_with([many], ABOVE)
    assert link.step(None, DT).n_tetrahedra == 72
