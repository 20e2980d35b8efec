"""A stream with bytes changed, cut off or repeated never yields a frame that was not sent.

What servers and their clients make of such streams is in `test_mutated_frames`.
"""

import numpy as np

from bridge.tcp.messages.step import pack_step
from bridge.tcp.wire import Frame, FrameReader, MessageKind, pack_frame
from tests.bridge.tcp.bare_sockets import DT, HELLO
from tests.long.frame_mutations import damaged_bytes
from tests.support.battery import battery

SENT = (Frame(MessageKind.HELLO, 0, b""), Frame(MessageKind.STEP, 1, pack_step(None, DT)))


@battery(n_per_change=10_000, n_long=1_000_000)
def test_a_reader_of_damaged_frames_returns_frames_that_were_sent_or_raises(case):
    reader = FrameReader()
    reader.feed(damaged_bytes(HELLO + pack_frame(*SENT[1]), np.random.default_rng(case)))
    try:
        while (frame := reader.take()) is not None:
            assert frame in SENT
    except ValueError as error:
        assert str(error)
