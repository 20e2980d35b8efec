"""Frames that are led over TCP act to the bit as in process, and what is wrong is refused."""

import contextlib
import struct
import threading

import mujoco
import numpy as np
import pytest

from bridge import Bridge, InProcessLink, LinkError, TcpLink
from bridge.driven import FrameAttachment, FrameTie
from bridge.tcp.messages.step import pack_step
from bridge.tcp.server import TissueServer
from bridge.tcp.wire import FrameReader, MessageKind, pack_frame
from scalpel_sim import Grip
from tests.bridge.bits import bits
from tests.bridge.tcp.bare_sockets import DT, connected_client, link_once_free
from tests.bridge.tcp.serve_block import block_tissue
from tests.bridge.test_driven import FAR, pose

JAW = """
<mujoco>
  <option timestep="0.001" gravity="0 0 0"/>
  <worldbody>
    <body name="jaw" pos=".01 .01 .03">
      <joint name="lift" type="slide" axis="0 0 1"/>
      <geom size=".01" mass=".2"/>
    </body>
  </worldbody>
  <actuator><position joint="lift" kp="500" kv="10"/></actuator>
</mujoco>
"""


@pytest.fixture
def link(server):
    with contextlib.closing(link_once_free(server.address)) as link:
        yield link


def held_and_cut(link, upright):
    """Two grips on the ends of the top, one of which lets go, while a blade cuts between them."""
    bridge, found = Bridge(link), []
    grips = [
        bridge.attach([[x, 0.01, 0.02]], stiffness=50.0, damping=0.5, breaks_at=limit)
        for x, limit in ((0.004, np.inf), (0.016, 0.02))
    ]
    for i in range(150):
        for grip in grips:
            grip.move(grip.pose.origin + np.array([0.0, 0.0, 2e-5]), pose(i).rotation)
        bridge.step(upright(0.009, -0.002 + 0.1 * DT * i), DT)
        found.append([(tuple(load.wrench), load.n_points) for load in bridge.frame_loads])
        if i == 120:
            bridge.release(grips[0])
    return found


def test_frames_over_tcp_are_the_same_as_in_process_bit_for_bit(link, upright):
    here = InProcessLink(block_tissue())
    of_here, of_there = held_and_cut(here, upright), held_and_cut(link, upright)
    assert bits(tuple(map(tuple, of_here))) == bits(tuple(map(tuple, of_there)))
    assert bits(here.snapshot()) == bits(link.snapshot())
    assert [n for _, n in of_here[0]] == [1, 1]
    assert [n for _, n in of_here[110]] == [1, 0]  # the second has let go by itself
    assert [n for _, n in of_here[-1]] == [0, 0]


def tied_and_cut(link, upright):
    """Two strands above the top, of which the blade that cuts the block cuts one."""
    bridge, found = Bridge(link), []
    ends = [[0.004, 0.01, 0.05], [0.03, 0.03, 0.03]]
    grip = bridge.tie(
        [[0.004, 0.01, 0.02], [0.016, 0.01, 0.02]],
        ends,
        stiffness=100.0,
        area=1e-6,
        toughness=100.0,
        damping=0.1,
        breaks_at=2.0,
    )
    for i in range(200):
        bridge.step(upright(0.02, -0.002 + 0.2 * DT * i), DT)
        found.append([(tuple(load.wrench), load.n_points) for load in bridge.frame_loads])
        if i == 170:
            bridge.release(grip)
    return found


def test_ties_over_tcp_are_the_same_as_in_process_bit_for_bit(link, upright):
    here = InProcessLink(block_tissue())
    of_here, of_there = tied_and_cut(here, upright), tied_and_cut(link, upright)
    assert bits(tuple(map(tuple, of_here))) == bits(tuple(map(tuple, of_there)))
    assert bits(here.snapshot()) == bits(link.snapshot())
    assert [of_here[i][0][1] for i in (0, 160, 180)] == [2, 1, 0]


def jaw_held(link):
    """A jaw of MuJoCo that lifts what it holds; its way."""
    model = mujoco.MjModel.from_xml_string(JAW)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    bridge, way = Bridge(link), []
    grip = Grip(data, "jaw", bridge, "top", stiffness=200.0, damping=2.0)
    data.ctrl[0] = 2e-3
    for _ in range(60):
        mujoco.mj_step1(model, data)
        grip.follow()
        bridge.step(FAR, DT)
        grip.apply()
        mujoco.mj_step2(model, data)
        way.append((data.qpos[0], *data.xfrc_applied[1].tolist()))
    assert grip.n_points > 0 and grip.wrench.force[2] < -1e-3
    grip.release()
    assert grip.n_points == 0
    np.testing.assert_allclose(data.xfrc_applied[1], 0.0, atol=1e-12)
    return way


def test_a_jaw_of_mujoco_holds_tissue_over_any_link(link):
    assert bits(tuple(jaw_held(InProcessLink(block_tissue())))) == bits(tuple(jaw_held(link)))


def test_a_wrong_number_of_poses_is_refused_and_the_link_stays(link):
    link.attach(FrameAttachment("top", 100.0))
    with pytest.raises(ValueError, match="poses of 0 frames, and 1 are driven"):
        link.step(None, DT)
    assert link.step(None, DT, [pose(0)]).n_tetrahedra == 72


@pytest.mark.parametrize(
    ("hold", "expected"),
    [
        (FrameAttachment("tpo", 100.0), "Did you mean 'top'"),
        (FrameAttachment("top", -1.0), "stiffness is -1.0"),
        (FrameAttachment("top", np.nan), "Expected `float`, got `null` - at `\\$.stiffness`"),
        (FrameAttachment([1000], 100.0), "there is no node 1000"),
        (FrameAttachment([[9.0, 9.0, 9.0]], 100.0), "outside the body"),
    ],
)
def test_what_cannot_be_held_is_refused_and_the_link_stays(link, hold, expected):
    with pytest.raises(LinkError, match=expected):
        link.attach(hold)
    assert link.step(None, DT).n_tetrahedra == 72 and len(link.loads()) == 0


STRANDS = FrameTie("top", [[0.01, 0.01, 0.05]], 100.0, 1e-6, 50.0)


@pytest.mark.parametrize(
    ("tie", "expected"),
    [
        (STRANDS._replace(where="tpo"), "Did you mean 'top'"),
        (STRANDS._replace(where=""), r"length >= 1 - at `\$\.region`"),
        (STRANDS._replace(area=0.0), "area is 0.0 m2; it must be positive"),
        (STRANDS._replace(toughness=-1.0), "toughness is -1.0"),
        (STRANDS._replace(stiffness=np.inf), "Expected `float`, got `null`"),
        (STRANDS._replace(rest_length=-1.0), "rest_length is -1.0"),
        (STRANDS._replace(to=[]), r"length >= 1 - at `\$\.to`"),
        (STRANDS._replace(to=[[0.0, 0.0]]), "length 3"),
        (STRANDS._replace(to=[[0.0, 0.0, 2e3]]), "<= 1000"),
        (STRANDS._replace(to=[[0.0, 0.0, 0.1]] * 2), "one place in m, or one for each of the"),
    ],
)
def test_what_cannot_be_tied_is_refused_and_the_link_stays(link, tie, expected):
    with pytest.raises(LinkError, match=expected):
        link.tie(tie)
    assert link.step(None, DT).n_tetrahedra == 72 and len(link.loads()) == 0


def test_more_frames_than_there_may_be_are_refused(monkeypatch):
    server = TissueServer(block_tissue, port=0)
    monkeypatch.setattr("bridge.tcp.server.MAX_FRAMES", 1)
    threading.Thread(target=server.run, daemon=True).start()
    with contextlib.closing(TcpLink(server.address)) as other:
        other.tie(STRANDS)
        with pytest.raises(LinkError, match="there are 1 frames, and there may be no more"):
            other.attach(FrameAttachment("top", 100.0))


def test_a_frame_that_is_not_there_is_not_released(link):
    with pytest.raises(LinkError, match="there is no frame 0; there are 0"):
        link.release(0)


def asked(peer, sequence, kind, payload):
    """Return the text of the answer to a message from a bare socket."""
    peer.sendall(pack_frame(kind, sequence, payload))
    reader = FrameReader()
    while (frame := reader.take()) is None:
        reader.feed(peer.recv(1 << 16))
    return frame.payload.decode(errors="replace")


def test_a_server_refuses_poses_and_frames_that_no_client_of_ours_sends(server):
    with connected_client(server.address) as peer:
        hold = b'{"region": "top", "stiffness": 10.0}'
        asked(peer, 1, MessageKind.ATTACH, hold)
        bad = struct.pack("<13d", DT, *[np.nan] * 3, *np.eye(3).ravel())
        assert "frame 0 is not within" in asked(peer, 2, MessageKind.STEP, bad)
        flat = struct.pack("<13d", DT, *[0.0] * 12)
        assert "axes of frame 0 are no rotation" in asked(peer, 3, MessageKind.STEP, flat)
        none = pack_step(None, DT)
        assert "96 for each of 1 frames and 0 geoms" in asked(peer, 4, MessageKind.STEP, none)
        other = struct.pack("<q", 1)
        assert "there is no frame 1" in asked(peer, 5, MessageKind.RELEASE, other)
        both = b'{"region": "top", "nodes": [1], "stiffness": 10.0}'
        assert "give one of them" in asked(peer, 6, MessageKind.ATTACH, both)


def test_each_client_gets_a_tissue_that_nobody_holds(server):
    for _ in range(2):
        with contextlib.closing(link_once_free(server.address)) as link:
            assert isinstance(link, TcpLink) and len(link.loads()) == 0
            link.attach(FrameAttachment("top", 100.0))


@pytest.mark.parametrize("wrong", [1e308, -1e308, 1e10])
def test_a_frame_that_holds_with_an_impossible_stiffness_is_refused(server, wrong):
    with contextlib.closing(link_once_free(server.address)) as link:
        with pytest.raises(LinkError, match="the request to attach a frame cannot be read"):
            link.attach(FrameAttachment("top", wrong))
        assert link.loads() == []
        assert link.step(None, 1e-3).n_tetrahedra == 72
