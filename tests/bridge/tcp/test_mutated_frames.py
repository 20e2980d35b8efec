"""Streams with bytes changed, cut off or repeated: none has any effect but an error.

The environment variable SCALPEL_SIM_MUTATIONS sets their number; a million takes an hour.
"""

import os
import socket
from pathlib import Path

import numpy as np
import pytest

from bridge.tcp.messages.result import unpack_result
from bridge.tcp.messages.step import pack_step
from bridge.tcp.wire import Frame, FrameReader, MessageKind, pack_frame
from tests.bridge.bits import bits
from tests.bridge.tcp.bare_sockets import (
    DT,
    HELLO,
    assert_serves,
    connected,
    connected_client,
    read_all,
)

N = int(os.environ.get("SCALPEL_SIM_MUTATIONS", "1000"))
STEP = pack_frame(MessageKind.STEP, 1, pack_step(None, DT))
GROWTH_ALLOWED = 4 << 20
"""Memory that the allocator of a running server may keep beyond its first thousand clients [byte].
A leak of one frame of 200 bytes in each mutation of the long setting would be 200 MB."""


def mutated(stream, random):
    """Return a stream with some bytes changed, and sometimes a part omitted or repeated."""
    changed = bytearray(stream)
    for at in random.integers(0, len(changed), random.integers(1, 5)):
        changed[at] ^= random.integers(1, 256)
    a, b = np.sort(random.integers(0, len(changed) + 1, 2))
    return bytes(
        [changed, changed, changed[:b], changed[:a] + changed[b:], changed[:b] + changed[a:]][
            random.integers(5)
        ]
    )


def answers(address, stream):
    """Return the frames that the server sends to a client that sends a stream and no more."""
    with connected(address) as peer:
        peer.sendall(stream)
        peer.shutdown(socket.SHUT_WR)
        return read_all(peer)


def outcome(frame):
    """Return the result of a step as bits, without its wall times."""
    return bits(unpack_result(frame.payload)[0]._replace(stage_times=None))


def resident_bytes(process):
    pages = int(Path(f"/proc/{process.pid}/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE")


@pytest.mark.skipif(
    not Path("/proc/self/statm").exists(), reason="reads the memory of a process from Linux"
)
def test_no_mutated_stream_has_an_effect_or_costs_memory(server):
    random = np.random.default_rng(0)
    with connected_client(server.address) as peer:
        peer.sendall(STEP)
        peer.shutdown(socket.SHUT_WR)
        good = outcome(read_all(peer)[-1])
    memory = 0
    for i in range(2 * N):
        for frame in answers(server.address, mutated(HELLO + STEP, random)):
            assert frame.kind in (MessageKind.HELLO, MessageKind.STEP, MessageKind.ERROR)
            if frame.kind == MessageKind.STEP:  # the change came after it, or was omitted
                assert outcome(frame) == good
        if i == N:
            memory = resident_bytes(server.process)
    assert resident_bytes(server.process) - memory < GROWTH_ALLOWED
    assert_serves(server)


def test_a_reader_of_mutated_frames_returns_frames_that_were_sent_or_raises():
    random = np.random.default_rng(1)
    sent = [Frame(MessageKind.HELLO, 0, b""), Frame(MessageKind.STEP, 1, pack_step(None, DT))]
    for _ in range(10 * N):
        reader = FrameReader()
        reader.feed(mutated(HELLO + STEP, random))
        try:
            while (frame := reader.take()) is not None:
                assert frame in sent
        except ValueError as error:
            assert str(error)
