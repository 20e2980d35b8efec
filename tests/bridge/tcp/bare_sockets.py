"""Bare sockets to a tissue server, and the check that it still serves after each of them."""

import contextlib
import socket
import time

from bridge import LinkError, TcpLink
from bridge.tcp.address import parse_address
from bridge.tcp.wire import FrameReader, MessageKind, pack_frame

DT = 1e-3
HELLO = pack_frame(MessageKind.HELLO, 0)


def connected(address):
    """Return a bare socket to the server, through which a test can send anything."""
    return socket.create_connection(parse_address(address), 5.0)


def read_all(connection):
    """Return the frames that the other side sends until it closes the connection."""
    reader, frames = FrameReader(), []
    with contextlib.suppress(ConnectionResetError):
        while data := connection.recv(1 << 16):
            reader.feed(data)
            while (frame := reader.take()) is not None:
                frames.append(frame)
    return frames


def read_one(connection):
    """Return the next frame."""
    reader = FrameReader()
    while (frame := reader.take()) is None:
        reader.feed(connection.recv(1 << 16))
    return frame


def link_once_free(address, key=None):
    """Return a link, as soon as the server has noticed that the last client has left."""
    for _ in range(200):
        try:
            return TcpLink(address, 10.0, key=key)
        except LinkError as error:
            assert "has the tissue" in str(error), error
            time.sleep(0.02)
    raise AssertionError("the server never released its client")


def connected_client(address):
    """Return a bare socket that the server has accepted as its client."""
    for _ in range(200):
        peer = connected(address)
        peer.sendall(HELLO)
        if read_one(peer).kind == MessageKind.HELLO:
            return peer
        peer.close()
        time.sleep(0.02)
    raise AssertionError("the server never released its client")


def assert_serves(server, key=None):
    with contextlib.closing(link_once_free(server.address, key)) as link:
        assert link.step(None, DT).n_tetrahedra == 72
