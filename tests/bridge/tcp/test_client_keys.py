"""A server with a key, and clients with the same key, another key, or none."""

import contextlib
import socket
import threading

import pytest

from bridge import LinkError, TcpLink
from bridge.tcp.address import parse_address
from bridge.tcp.channel import NONCE_BYTES, TAG_BYTES, Channel, direction_keys, new_nonce
from bridge.tcp.messages.step import pack_step
from bridge.tcp.messages.text import unpack_error
from bridge.tcp.server import TissueServer
from bridge.tcp.wire import FrameReader, MessageKind, pack_frame
from tests.bridge.conftest import ServerProcess
from tests.bridge.tcp.bare_sockets import DT, assert_serves, connected, read_all, read_one
from tests.bridge.tcp.serve_block import block_tissue

KEY, OTHER_KEY = bytes(range(32)), bytes(32)


@pytest.fixture(scope="module")
def server():
    running = ServerProcess("0.0.0.0", KEY)
    running.address = f"127.0.0.1:{parse_address(running.address)[1]}"
    yield running
    assert running.process.poll() is None, "the server did not survive its clients"
    running.end(15)


def test_a_client_with_the_key_is_served_and_receives_the_whole_body(server):
    assert_serves(server, KEY)
    with contextlib.closing(TcpLink(server.address, key=KEY)) as link:
        assert len(link.snapshot().positions) == len(block_tissue().snapshot().positions)
        assert link.n_pieces() == 1


def test_a_client_with_another_key_is_refused(server):
    with pytest.raises(LinkError, match="refused: your key is not the one of this server"):
        TcpLink(server.address, key=OTHER_KEY)
    assert_serves(server, KEY)


def test_a_client_without_a_key_is_refused(server):
    with pytest.raises(LinkError, match="refused: this server requires a key"):
        TcpLink(server.address)
    assert_serves(server, KEY)


def test_a_client_with_a_key_does_not_trust_a_server_without_one(start_server):
    server = start_server()
    with pytest.raises(LinkError, match="this server has none"):
        TcpLink(server.address, key=KEY)


def test_a_server_that_cannot_prove_that_it_has_the_key_is_refused(listener):
    """It sends a challenge, but cannot compute the tag of its next message."""
    address = listener(
        pack_frame(MessageKind.CHALLENGE, 0, bytes(NONCE_BYTES)),
        pack_frame(MessageKind.HELLO, 1, bytes(300)),
    )
    with pytest.raises(LinkError, match="authentication tag is wrong"):
        TcpLink(address, key=KEY)


def test_a_challenge_of_the_wrong_length_is_refused(listener):
    with pytest.raises(LinkError, match="a challenge of 5 bytes; wanted 32"):
        TcpLink(listener(pack_frame(MessageKind.CHALLENGE, 0, b"prove")), key=KEY)


@pytest.fixture
def listener():
    """Return a function that starts a server which gives these answers, one to each message."""
    with socket.create_server(("127.0.0.1", 0)) as listening, contextlib.ExitStack() as stack:

        def start(*answers):
            def talk():
                connection, _ = listening.accept()
                stack.enter_context(connection)
                for answer in answers:
                    connection.recv(1 << 16)
                    connection.sendall(answer)

            threading.Thread(target=talk, daemon=True).start()
            return f"127.0.0.1:{listening.getsockname()[1]}"

        yield start


def client_with_key(address):
    """Return a bare socket that the server has accepted as its client, and its channel."""
    peer, channel, nonce = connected(address), Channel(), new_nonce()
    peer.sendall(pack_frame(MessageKind.HELLO, 0, nonce))
    keys = direction_keys(KEY, nonce, read_one(peer).payload)
    channel.authenticate(keys.to_server, keys.to_client)
    peer.sendall(b"".join(channel.pack(MessageKind.HELLO, 1)))
    assert next_frame(peer, channel).kind == MessageKind.HELLO
    return peer, channel


def next_frame(peer, channel):
    while (frame := channel.take()) is None:
        data = peer.recv(1 << 16)
        assert data, "the server has closed the connection"
        channel.feed(data)
    return frame


def test_a_recorded_step_is_not_executed_twice(server):
    peer, channel = client_with_key(server.address)
    with peer:
        step = b"".join(channel.pack(MessageKind.STEP, 2, pack_step(None, DT)))
        peer.sendall(step)
        assert next_frame(peer, channel).kind == MessageKind.STEP
        peer.sendall(step)
        refusal = next_frame(peer, channel)
        assert refusal.kind == MessageKind.ERROR and "authentication tag is wrong" in unpack_error(
            refusal.payload
        )
        assert peer.recv(1) == b""
    assert_serves(server, KEY)


def test_a_recorded_handshake_opens_no_second_conversation(server):
    nonce = new_nonce()
    with connected(server.address) as peer:
        peer.sendall(pack_frame(MessageKind.HELLO, 0, nonce))
        keys = direction_keys(KEY, nonce, read_one(peer).payload)
        channel = Channel()
        channel.authenticate(keys.to_server, keys.to_client)
        proof = b"".join(channel.pack(MessageKind.HELLO, 1))
    with connected(server.address) as peer:
        peer.sendall(pack_frame(MessageKind.HELLO, 0, nonce) + proof)
        challenge, refusal = read_all(peer)
    assert challenge.kind == MessageKind.CHALLENGE
    assert "your key is not" in unpack_error(refusal.payload)
    assert_serves(server, KEY)


@pytest.mark.parametrize("where", ["magic", "kind", "sequence", "payload", "tag"])
def test_a_step_that_was_changed_in_transit_is_not_executed(server, where):
    """The attacker computes the checksums again, but has no key."""
    peer, channel = client_with_key(server.address)
    with peer:
        (step,) = channel.pack(MessageKind.STEP, 2, pack_step(None, DT))
        reader = FrameReader()
        reader.feed(step)
        kind, sequence, payload = reader.take()
        changed = {
            "magic": b"SCUX" + step[4:],
            "kind": pack_frame(MessageKind.PIECES, sequence, payload),
            "sequence": pack_frame(kind, sequence + 1, payload),
            "payload": pack_frame(kind, sequence, pack_step(None, 0.5) + payload[-TAG_BYTES:]),
            "tag": pack_frame(kind, sequence, payload[:-1] + bytes([payload[-1] ^ 1])),
        }[where]
        peer.sendall(changed)
        refusal = next_frame(peer, channel)
        assert refusal.kind == MessageKind.ERROR
        assert peer.recv(1) == b""
    assert_serves(server, KEY)


# ---- other machines ------------------------------------------------------------------------------


@pytest.mark.parametrize("host", ["0.0.0.0", "::"])
def test_a_host_that_others_can_reach_needs_a_key(host):
    with pytest.raises(ValueError, match=r"is open to other machines, and that takes a key"):
        TissueServer(block_tissue, host=host, port=0)
    with TissueServer(block_tissue, host=host, port=0, key=KEY) as server:
        assert parse_address(server.address)[1] > 0


def test_another_machine_is_not_contacted_without_a_key():
    with pytest.raises(ValueError, match=r"192\.0\.2\.1:8766 is another machine.* --key FILE"):
        TcpLink("192.0.2.1:8766")
