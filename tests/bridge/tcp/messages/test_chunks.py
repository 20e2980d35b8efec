import numpy as np
import pytest

from bridge.tcp.messages.chunks import pack_chunks, unpack_chunks
from bridge.tcp.wire import MessageError
from tests.bridge.bits import bits
from tissue import Chunks

CHUNKS = Chunks(np.array([[[0.0, -0.0, 0.1], [1.0, 2.0, 3.0]], [[-1.0, 0, 0], [0, 0, 0]]]), 0.25)


@pytest.mark.parametrize("n", [0, 1, 2])
def test_chunks_arrive_bit_for_bit(n):
    sent = Chunks(CHUNKS.boxes[:n], 0.25)
    assert bits(unpack_chunks(pack_chunks(sent))) == bits(sent)


@pytest.mark.parametrize(
    "boxes", [CHUNKS.boxes[:, ::-1], CHUNKS.boxes * np.nan, np.full((2, 2, 3), np.inf)]
)
def test_invalid_boxes_are_refused(boxes):
    with pytest.raises(MessageError, match="the box of a chunk is not finite or inverted"):
        unpack_chunks(pack_chunks(Chunks(boxes, 0.0)))


@pytest.mark.parametrize("fastest", [-1.0, np.nan, np.inf])
def test_an_invalid_speed_is_refused(fastest):
    with pytest.raises(MessageError, match="the fastest node moves at"):
        unpack_chunks(pack_chunks(CHUNKS._replace(fastest=fastest)))


def test_a_wrong_number_of_chunks_is_refused():
    packed = pack_chunks(CHUNKS)
    for payload in (packed[:-8], packed + bytes(48), packed[:4], b"\xff" * 16):
        with pytest.raises(MessageError):
            unpack_chunks(payload)
