"""Who may stay connected: the client while it is there, and newcomers before those who wait.

And how a server reports a request that fails.
"""

import contextlib
import os
import select
import signal
import socket
import subprocess
import sys
import threading
import time

import pytest

from bridge import DeviceClient, LinkError, TcpLink
from bridge.tcp import connection as client_connection
from bridge.tcp import peer
from bridge.tcp.address import N_PROBES, parse_address
from bridge.tcp.messages.step import pack_step
from bridge.tcp.messages.text import unpack_error
from bridge.tcp.server import TissueServer
from bridge.tcp.single_client import MAX_STRANGERS
from bridge.tcp.wire import MessageKind, pack_frame
from tests.bridge.bits import bits
from tests.bridge.conftest import ROOT
from tests.bridge.device.served_blade import served_blade
from tests.bridge.tcp.bare_sockets import (
    DT,
    HELLO,
    assert_serves,
    connected,
    connected_client,
    link_once_free,
    read_all,
    read_one,
)
from tests.bridge.tcp.serve_block import block_tissue
from tissue import TissueError

KEY = bytes(range(32))
SILENCE = 0.6
"""What a server in these tests allows [s], instead of a minute."""


@contextlib.contextmanager
def server_in_a_thread(**options):
    """Yield a server of the block in this process, where its limits can be changed."""
    server = TissueServer(block_tissue, **{"port": 0} | options)
    stops = threading.Event()

    def serve():
        while not stops.is_set():
            server._serve_once(0.02)

    thread = threading.Thread(target=serve)
    thread.start()
    try:
        yield server
    finally:
        stops.set()
        thread.join()
        server.close()


@pytest.fixture
def short_silence(monkeypatch):
    monkeypatch.setattr(peer, "SILENCE_SECONDS", SILENCE)
    monkeypatch.setattr(client_connection, "HEARTBEAT_SECONDS", SILENCE / 4.0)


# ---- connections that are no client --------------------------------------------------------------


def test_silent_connections_do_not_keep_a_client_out(server):
    with contextlib.ExitStack() as stack:
        for _ in range(4 * MAX_STRANGERS):
            stack.enter_context(connected(server.address))
        assert_serves(server)


def test_of_too_many_connections_the_oldest_has_to_go(server):
    with contextlib.ExitStack() as stack:
        peers = [stack.enter_context(connected(server.address)) for _ in range(MAX_STRANGERS + 1)]
        (frame,) = read_all(peers[0])
        assert f"{MAX_STRANGERS} connections without a client are open" in unpack_error(
            frame.payload
        )
        assert select.select(peers[1:], [], [], 0.05)[0] == []
    assert_serves(server)


def test_a_host_with_many_connections_does_not_cost_another_its_own(server):
    with contextlib.ExitStack() as stack:
        alone = socket.create_connection(
            parse_address(server.address), 5.0, source_address=("127.0.0.2", 0)
        )
        stack.enter_context(alone)
        for _ in range(3 * MAX_STRANGERS):
            stack.enter_context(connected(server.address))
        alone.sendall(HELLO)
        assert read_one(alone).kind == MessageKind.HELLO
    assert_serves(server)


@pytest.mark.parametrize("talk", [b"", HELLO[:9]], ids=["silent", "half a message"])
def test_connections_that_prove_no_key_do_not_keep_out_a_client_that_has_it(start_server, talk):
    """While it shakes hands, half as many come as must come for it to lose its place."""
    server = start_server(key=KEY)
    with contextlib.ExitStack() as strangers:

        def come(n):
            """Take places, all of which have been taken, so that others lose theirs."""
            for _ in range(n):
                with contextlib.suppress(OSError):
                    strangers.enter_context(connected(server.address)).sendall(talk)

        come(MAX_STRANGERS)
        for _ in range(20):
            newcomers = threading.Thread(target=come, args=(MAX_STRANGERS // 2,))
            newcomers.start()
            try:
                assert_serves(server, KEY)
            finally:
                newcomers.join()


# ---- a client that went away ---------------------------------------------------------------------


def test_a_client_that_asks_now_and_then_keeps_its_place(short_silence):
    with server_in_a_thread() as server, connected_client(server.address) as client:
        for sequence in range(1, 7):
            time.sleep(SILENCE / 2.0)
            client.sendall(pack_frame(MessageKind.STEP, sequence, pack_step(None, DT)))
            assert read_one(client).kind == MessageKind.STEP


@pytest.mark.parametrize("key", [None, KEY], ids=["no key", "key"])
def test_a_link_that_pauses_keeps_its_place_and_the_tissue_its_state(short_silence, key):
    with (
        server_in_a_thread(key=key) as server,
        contextlib.closing(TcpLink(server.address, key=key)) as link,
    ):
        link.step(None, DT)
        before = bits(link.snapshot())
        time.sleep(4.0 * SILENCE)
        assert bits(link.snapshot()) == before
        assert link.step(None, DT).n_tetrahedra == 72


def test_a_device_that_pauses_keeps_its_place(short_silence):
    with served_blade() as (_, address), DeviceClient(address) as client:
        time.sleep(4.0 * SILENCE)
        assert client.measured().time == 1.25


def test_a_process_that_is_stopped_loses_its_place(short_silence):
    program = "import bridge, sys, time; link = bridge.TcpLink(sys.argv[1]); time.sleep(60)"
    with server_in_a_thread() as server:
        client = subprocess.Popen([sys.executable, "-c", program, server.address], cwd=ROOT)
        try:
            while server._client is None:
                time.sleep(0.02)
            client.send_signal(signal.SIGSTOP)
            with contextlib.closing(link_once_free(server.address)) as link:
                assert link.n_pieces() == 1
        finally:
            client.kill()
            client.wait()


def test_a_link_that_nobody_holds_leaves_its_place():
    with server_in_a_thread() as server:
        link = TcpLink(server.address)
        assert link.n_pieces() == 1
        del link
        with contextlib.closing(link_once_free(server.address)) as other:
            assert other.n_pieces() == 1


def test_a_link_whose_server_died_in_a_pause_says_so(short_silence):
    with server_in_a_thread() as server:
        link = TcpLink(server.address)
    time.sleep(2.0 * SILENCE)
    with pytest.raises(LinkError, match=r"broke|is closed"):
        link.step(None, DT)
    with contextlib.suppress(LinkError):
        link.close()


@pytest.mark.skipif(not hasattr(socket, "TCP_KEEPIDLE"), reason="another system's options")
def test_both_ends_ask_whether_the_other_machine_is_still_there():
    with (
        server_in_a_thread() as server,
        contextlib.closing(TcpLink(server.address)) as link,
    ):
        for end in (server._client.socket, link._connection._socket):
            assert end.getsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE) == 1
            assert end.getsockopt(socket.IPPROTO_TCP, socket.TCP_KEEPIDLE) == 10
            assert end.getsockopt(socket.IPPROTO_TCP, socket.TCP_KEEPINTVL) == 5
            assert end.getsockopt(socket.IPPROTO_TCP, socket.TCP_KEEPCNT) == N_PROBES


# ---- Ctrl-C while waiting ------------------------------------------------------------------------


@pytest.fixture
def silent_server():
    """Yield the address of a server that accepts connections and never answers."""
    with socket.create_server(("127.0.0.1", 0)) as listener:
        yield f"127.0.0.1:{listener.getsockname()[1]}"


def test_ctrl_c_ends_the_wait_for_an_answer_at_once(silent_server):
    program = "import bridge, sys; print('asks', flush=True); bridge.TcpLink(sys.argv[1])"
    client = subprocess.Popen(
        [sys.executable, "-c", program, silent_server],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert client.stdout.readline() == "asks\n"
    time.sleep(1.0)
    begun = time.monotonic()
    client.send_signal(signal.SIGINT)
    _, errors = client.communicate(timeout=20.0)
    assert time.monotonic() - begun < 2.0
    assert client.returncode != 0 and "KeyboardInterrupt" in errors


def test_an_owner_that_is_told_to_stop_ends_the_wait_for_an_answer(start_server):
    server = start_server()
    with contextlib.closing(TcpLink(server.address)) as link:
        os.kill(server.process.pid, signal.SIGSTOP)
        stops = threading.Event()
        threading.Timer(0.3, stops.set).start()

        def check():
            if stops.is_set():
                raise LinkError("told to stop")

        link.while_waiting = check
        begun = time.monotonic()
        with pytest.raises(LinkError, match="told to stop"):
            link.step(None, DT)
        assert 0.2 < time.monotonic() - begun < 2.0
        os.kill(server.process.pid, signal.SIGCONT)
        assert link.n_pieces() == 1  # the link is whole


def test_a_request_that_was_sent_in_part_ends_the_link(silent_server):
    from bridge.tcp.connection import Connection, Served

    served = Served("the tissue", "no tissue is served", "start one")
    connection = Connection(silent_server, served, 10.0, None)

    def interrupt():
        raise KeyboardInterrupt

    connection.while_waiting = interrupt
    with pytest.raises(LinkError, match="is closed"):
        for _ in range(100):  # until the system takes no more
            with contextlib.suppress(KeyboardInterrupt):
                connection.request(MessageKind.COLLIDE, bytes(1 << 19), 0, bytes)


# ---- requests that fail --------------------------------------------------------------------------

REASON = "TissueError: the motion became unstable"


def fail_twice(server, monkeypatch):
    """Ask a tissue that fails for what it cannot say, as a new client."""

    def fail():
        raise TissueError(REASON.partition(": ")[2])

    with contextlib.closing(link_once_free(server.address)) as link:
        monkeypatch.setattr(server._link, "n_pieces", fail)
        for _ in range(2):
            with pytest.raises(LinkError, match=REASON):
                link.n_pieces()


def test_why_requests_fail_is_logged_once_for_each_client(monkeypatch, caplog):
    with server_in_a_thread() as server:
        for _ in range(2):
            fail_twice(server, monkeypatch)
    errors = [each.getMessage() for each in caplog.records if each.levelname == "ERROR"]
    assert len(errors) == 2
    assert all(each.endswith(f" failed: {REASON}") for each in errors)
