"""The link between two processes. The server is a real one, in a process of its own."""

import contextlib
import signal
import socket
import struct
import threading
import time
from types import SimpleNamespace

import numpy as np
import pytest

from bridge import Bridge, InProcessLink, LinkError, SceneView, TcpLink
from bridge.driven import FrameAttachment, FramePose
from bridge.tcp.address import parse_address
from bridge.tcp.messages.body import MAX_POINTS
from bridge.tcp.messages.step import RESULT, pack_step
from bridge.tcp.messages.text import pack_error, unpack_error
from bridge.tcp.peer import HANDSHAKE_BYTES
from bridge.tcp.server import TissueServer
from bridge.tcp.wire import PROTOCOL_VERSION, MessageKind, pack_frame
from tests.bridge.bits import bits
from tests.bridge.tcp.bare_sockets import (
    DT,
    HELLO,
    assert_serves,
    connected,
    connected_client,
    link_once_free,
    read_all,
)
from tests.bridge.tcp.serve_block import block_tissue as make_block
from tissue import BladeSegment, BladeSweep, CutFaces, RigidContacts


@pytest.fixture
def link(server):
    with contextlib.closing(link_once_free(server.address)) as link:
        yield link


def cut(link, upright):
    """Draw the blade halfway through the block; return all results without wall times."""
    bridge = Bridge(link)
    results = []
    for i in range(250):
        bridge.step(upright(0.009, -0.002 + 0.05 * DT * i), DT)
        result = bridge.result._replace(stage_times=None)
        results.append(result._replace(contacts=RigidContacts(*map(np.copy, result.contacts))))
    return results


def test_a_cut_over_tcp_is_the_same_as_in_process_bit_for_bit(link, upright):
    here = InProcessLink(make_block())
    results_here, results_there = cut(here, upright), cut(link, upright)
    assert results_here[-1].cut_area > 1e-5
    assert max(len(result.contacts.point) for result in results_here) > 3
    assert max(np.linalg.norm(result.stiffness) for result in results_here) > 1.0
    assert results_here[-1].energies.cutting > 0.0
    assert results_here[-1].n_tetrahedra > results_here[0].n_tetrahedra
    assert [bits(r) for r in results_here] == [bits(r) for r in results_there]
    assert bits(here.snapshot()) == bits(link.snapshot())
    assert bits(here.surface()) == bits(link.surface())
    for quantity in ("displacement", "strain", "stress"):
        values = link.surface_values(quantity)
        assert bits(here.surface_values(quantity)) == bits(values)
        assert len(values) == len(link.surface().positions) and values.max() > 0.0
    assert bits(here.deformation()) == bits(link.deformation())
    assert np.abs(link.deformation().stress).max() > 0.0
    assert bits(here.chunks()) == bits(link.chunks())
    assert here.n_pieces() == link.n_pieces()
    assert bits(here.cut_report()) == bits(link.cut_report())
    assert link.cut_report().n_cut_nodes > 0
    assert 5 < link.n_cut_faces == here.n_cut_faces
    assert bits(here.cut_faces()) == bits(link.cut_faces())


def test_cut_faces_are_sent_from_the_first_that_is_asked_for(link, upright):
    cut(link, upright)
    whole, n = link.cut_faces(), link.n_cut_faces
    for since in (0, n - 3, n):
        found = link.cut_faces(since=since)
        assert bits(found) == bits(CutFaces(*(each[since:] for each in whole)))
    with pytest.raises(ValueError, match=f"there is no face number {n + 1}: {n} were cut"):
        link.cut_faces(since=n + 1)
    assert link.describe().n_cut_faces == n


def test_material_points_are_where_they_are_in_process_bit_for_bit(link, upright):
    here = InProcessLink(make_block())
    cut(here, upright)
    cut(link, upright)
    at_rest = here.snapshot().rest_positions[:30] * 0.99 + 1e-4
    for holders in (np.full(30, -1), np.full(30, 3)):
        there = holders.copy()
        assert bits(link.positions_of(at_rest, there)) == bits(here.positions_of(at_rest, holders))
        assert there.tolist() == holders.tolist()
    with pytest.raises(LinkError, match="a material point is in none of the"):
        link.positions_of(at_rest, np.full(30, 10**6))
    with pytest.raises(LinkError, match=f"{MAX_POINTS + 1} material points; wanted {MAX_POINTS}"):
        link.positions_of(np.zeros((MAX_POINTS + 1, 3)), np.full(MAX_POINTS + 1, -1))


def test_the_description_is_that_of_the_tissue_that_is_served(link):
    here = InProcessLink(make_block(), "block").describe()
    there = link.describe()
    assert bits(here.bounds) == bits(there.bounds)
    assert here._replace(bounds=None) == there._replace(bounds=None)


def test_a_second_client_is_refused_and_the_first_continues(server, link):
    with pytest.raises(
        LinkError, match=r"the client 127\.0\.0\.1:\d+ has the tissue, and only one"
    ):
        TcpLink(server.address)
    assert link.step(None, DT).n_tetrahedra == 72


def test_an_invalid_request_is_refused_before_it_reaches_the_tissue(link, upright):
    before = bits(link.snapshot())
    segment = upright(0.009, 0.01)
    invalid = segment._replace(tip=np.array([0.0, np.nan, 0.0]))
    with pytest.raises(LinkError, match="the blade is not within 1000 m"):
        link.step(BladeSweep(segment, invalid), DT)
    with pytest.raises(LinkError, match=r"a step of -1\.0 s"):
        link.step(None, -1.0)
    assert bits(link.snapshot()) == before
    assert link.step(None, DT).n_tetrahedra == 72


def test_what_the_tissue_refuses_is_a_refused_request(link, upright):
    # The link accepts a blade without length; the tissue does not.
    point = upright(0.009, 0.01)
    point = BladeSegment(point.tip, point.tip, point.forward)
    with pytest.raises(LinkError, match="refused: the blade at the start of the step"):
        link.step(BladeSweep(point, point), DT)
    assert link.step(None, DT).n_tetrahedra == 72


# ---- hostile clients: each is followed by one that must be served --------------------------------


@pytest.mark.parametrize(
    ("garbage", "answer"),
    [
        (b"GET / HTTP/1.1\r\n\r\n", "is not scalpel-sim"),
        (bytes(100), "is not scalpel-sim"),
        (pack_frame(MessageKind.STEP, 0, pack_step(None, DT)), "the first message must be a HELLO"),
        (HELLO[:4] + b"\x63\x00" + HELLO[6:], "uses version 99"),
        (HELLO[:4] + b"\x0a\x00" + HELLO[6:], "uses version 10 of the protocol and this one 12"),
        (HELLO[:-1] + b"\x00", "its checksum is wrong"),
        (pack_frame(MessageKind.HELLO, 0, bytes(HANDSHAKE_BYTES + 1)), "at most 48 are allowed"),
    ],
    ids=[
        "http",
        "zeros",
        "no hello",
        "other version",
        "version before",
        "bad checksum",
        "oversize",
    ],
)
def test_garbage_is_answered_with_the_reason_and_ends_the_connection(server, garbage, answer):
    with connected(server.address) as peer:
        peer.sendall(garbage[:1000])
        (frame,) = read_all(peer)
    assert frame.kind == MessageKind.ERROR
    assert answer in unpack_error(frame.payload)
    assert_serves(server)


@pytest.mark.parametrize(
    "join", [connected, connected_client], ids=["before the hello", "as the client"]
)
@pytest.mark.parametrize("part", [1, 10, 30])
def test_half_a_message_ends_the_connection_after_a_timeout(server, join, part):
    with join(server.address) as peer:
        peer.sendall(pack_frame(MessageKind.STEP, 1, pack_step(None, DT))[:part])
        last = read_all(peer)[-1]
    assert "silent for too long" in unpack_error(last.payload)
    assert_serves(server)


def test_a_message_sent_byte_by_byte_does_not_keep_its_connection(server):
    with connected(server.address) as peer, contextlib.suppress(OSError):
        started = time.monotonic()
        for byte in pack_frame(MessageKind.SNAPSHOT, 0, bytes(1000)):
            peer.sendall(bytes([byte]))
            time.sleep(0.02)
    assert time.monotonic() - started < 5.0
    assert_serves(server)


@pytest.mark.parametrize("sent", [b"", HELLO, HELLO + HELLO[:7]], ids=["silent", "client", "half"])
@pytest.mark.parametrize("how", ["closes", "resets"])
def test_a_peer_that_disconnects_frees_its_place(server, sent, how):
    peer = connected(server.address)
    peer.sendall(sent)
    if how == "resets":
        peer.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    peer.close()
    assert_serves(server)


def test_a_client_that_never_reads_loses_its_place(server):
    with connected_client(server.address) as peer:
        peer.settimeout(5.0)
        with pytest.raises((ConnectionError, TimeoutError)):
            for sequence in range(1, 10**6):
                peer.sendall(pack_frame(MessageKind.SNAPSHOT, sequence))
    assert_serves(server)


def test_a_flood_of_requests_is_answered_in_order(server):
    n = 500
    requests = [pack_frame(MessageKind.STEP, 1 + i, pack_step(None, DT)) for i in range(n)]
    with connected_client(server.address) as peer:
        peer.sendall(b"".join(requests))
        peer.shutdown(socket.SHUT_WR)
        assert [frame.sequence for frame in read_all(peer)] == list(range(1, n + 1))
    assert_serves(server)


def test_strangers_that_flood_the_server_do_not_change_a_cut(server, upright):
    """They connect, send nothing, garbage, half a HELLO or a whole one, and leave or stay."""
    with contextlib.closing(link_once_free(server.address)) as alone:
        expected = [bits(result) for result in cut(alone, upright)]
    done = threading.Event()

    def flood():
        talk = [b"", b"GET / HTTP/1.1\r\n\r\n", HELLO, HELLO[:9], bytes(1 << 20)]
        with contextlib.ExitStack() as staying:
            for i in range(10**6):
                if done.is_set():
                    return
                with contextlib.suppress(OSError):
                    stranger = connected(server.address)
                    stranger.sendall(talk[i % len(talk)])
                    if i % 7:
                        stranger.close()
                    else:
                        staying.callback(stranger.close)

    with contextlib.closing(link_once_free(server.address)) as link:
        flooding = threading.Thread(target=flood)
        flooding.start()
        try:
            found = [bits(result) for result in cut(link, upright)]
        finally:
            done.set()
            flooding.join()
    assert found == expected
    assert_serves(server)


def test_an_old_request_is_not_executed_twice(server):
    with connected_client(server.address) as peer:
        step = pack_frame(MessageKind.STEP, 1, pack_step(None, DT))
        peer.sendall(step + step)
        peer.shutdown(socket.SHUT_WR)
        assert [frame.kind for frame in read_all(peer)] == [MessageKind.STEP, MessageKind.ERROR]
    assert_serves(server)


# ---- errors that a client gets -------------------------------------------------------------------


@pytest.fixture
def impostor():
    """Return a function that starts a server which sends fixed bytes to its first client."""
    listener = socket.create_server(("127.0.0.1", 0))
    done = threading.Event()

    def start(answer):
        def talk():
            connection, _ = listener.accept()
            with connection:
                connection.recv(1 << 16)
                connection.sendall(answer)
                done.wait(5.0 if not answer else 0.0)

        threading.Thread(target=talk, daemon=True).start()
        return f"127.0.0.1:{listener.getsockname()[1]}"

    yield start
    done.set()
    listener.close()


@pytest.mark.parametrize(
    ("answer", "message"),
    [
        (b"HTTP/1.1 400 Bad Request\r\n\r\n", "is not scalpel-sim"),
        (HELLO[:4] + b"\x63\x00" + HELLO[6:], f"uses version 99 .* this one {PROTOCOL_VERSION}"),
        (pack_frame(MessageKind.HELLO, 0, b"\x00"), "description cannot be read"),
        (pack_frame(MessageKind.STEP, 0), "a reply of kind 2"),
        (pack_frame(MessageKind.ERROR, 0, pack_error("go away")), "refused: go away"),
        (HELLO[:10], "the other side has closed it"),
    ],
    ids=["http", "other version", "no description", "wrong kind", "refusal", "half a frame"],
)
def test_a_server_of_another_kind_is_one_clear_error(impostor, answer, message):
    with pytest.raises(LinkError, match=message):
        TcpLink(impostor(answer))


def test_a_reply_about_other_frames_than_there_are_breaks_the_link(monkeypatch):
    server = TissueServer(make_block, port=0)
    threading.Thread(target=server.run, daemon=True).start()
    with contextlib.closing(TcpLink(server.address)) as link:
        link.attach(FrameAttachment("top", 100.0))
        of_none = SimpleNamespace(pack=lambda reply: RESULT.pack(reply._replace(loads=())))
        monkeypatch.setattr("bridge.tcp.server.RESULT", of_none)
        at = FramePose(np.array([0.01, 0.01, 0.02]), np.eye(3))
        with pytest.raises(LinkError, match="loads on 0 frames; there are 1"):
            link.step(None, DT, [at])


def test_a_server_that_does_not_answer_is_an_error_after_the_timeout(impostor):
    with pytest.raises(LinkError, match=r"did not answer within 0\.2 s"):
        TcpLink(impostor(b""), timeout=0.2)


def test_a_missing_server_is_one_clear_error():
    with socket.create_server(("127.0.0.1", 0)) as listener:
        port = listener.getsockname()[1]
    with pytest.raises(LinkError, match=f"no tissue is served at 127.0.0.1:{port}; start one"):
        TcpLink(f"127.0.0.1:{port}")


def test_an_unknown_host_is_one_clear_error():
    with pytest.raises(LinkError, match=r"no-such-host\.invalid:8766 cannot be reached"):
        TcpLink("no-such-host.invalid:8766")


@pytest.mark.parametrize(
    "address", ["", "localhost", ":80", "localhost:", "a:b", "a:65536", "a:-1"]
)
def test_an_invalid_address_is_refused(address):
    with pytest.raises(ValueError, match="is not an address; wanted HOST:PORT"):
        TcpLink(address)


def test_an_ipv6_address_is_written_in_brackets():
    assert parse_address("[::1]:8766") == ("::1", 8766)


def test_the_death_of_the_server_is_one_clear_error_and_closes_the_link(start_server):
    server = start_server()
    link = TcpLink(server.address)
    server.end(signal.SIGKILL)
    with pytest.raises(LinkError, match="broke"):
        link.step(None, DT)
    with pytest.raises(LinkError, match="is closed"):
        link.step(None, DT)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_the_server_ends_cleanly_on_a_signal_even_with_a_client(start_server, number):
    server = start_server()
    link = TcpLink(server.address)
    link.step(None, DT)
    assert server.end(number) == 0
    link.close()


def test_after_an_interrupted_request_replies_still_match_their_requests(link, monkeypatch):
    def interrupt(*_):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(link._connection, "_answer_to", interrupt)
        with pytest.raises(KeyboardInterrupt):
            link.snapshot()
    assert link.n_pieces() == 1
    assert link.step(None, DT).n_tetrahedra == 72


# ---- where a server listens ----------------------------------------------------------------------


def test_more_views_than_a_client_takes_are_refused():
    view = SceneView("", (0.0, 0.0, 1.0), (0.0, 0.0, 0.0), (0.0, 1.0, 0.0), 38.0)
    with pytest.raises(ValueError, match="has 257 views; a client takes 256"):
        TissueServer(make_block, port=0, views=[view] * 257)


@pytest.mark.parametrize("port", [-1, 65536])
def test_an_invalid_port_is_refused(port):
    with pytest.raises(ValueError, match=f"port {port} does not exist"):
        TissueServer(make_block, port=port)


def test_a_port_that_is_in_use_is_refused(server):
    port = parse_address(server.address)[1]
    with pytest.raises(
        LinkError, match=f"cannot listen at 127.0.0.1:{port}: Address already in use"
    ):
        TissueServer(make_block, port=port)
