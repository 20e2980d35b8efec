import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.tcp.wire import (
    HEADER_BYTES,
    LARGEST_FRAME,
    FrameReader,
    MessageError,
    MessageKind,
    pack_frame,
)

frames = st.tuples(st.sampled_from(MessageKind), st.integers(0, 2**32 - 1), st.binary(max_size=200))


def reader_of(data):
    reader = FrameReader()
    reader.feed(data)
    return reader


@given(st.lists(frames), st.integers(1, 50))
def test_frames_arrive_as_they_were_sent_however_the_stream_is_divided(sent, piece):
    stream = b"".join(pack_frame(*frame) for frame in sent)
    reader, received = FrameReader(), []
    for at in range(0, len(stream), piece):
        reader.feed(stream[at : at + piece])
        while (frame := reader.take()) is not None:
            received.append(tuple(frame))
    assert received == sent
    assert not reader.is_within_a_frame


@given(frames, st.data())
def test_a_frame_with_a_changed_byte_is_never_accepted(frame, data):
    stream = bytearray(pack_frame(*frame))
    at = data.draw(st.integers(0, len(stream) - 1))
    stream[at] ^= data.draw(st.integers(1, 255))
    with pytest.raises(MessageError):
        reader_of(bytes(stream)).take()


@given(frames, st.data())
def test_a_part_of_a_frame_is_waited_for(frame, data):
    stream = pack_frame(*frame)
    reader = reader_of(stream[: data.draw(st.integers(1, len(stream) - 1))])
    assert reader.take() is None
    assert reader.is_within_a_frame


@given(st.binary(min_size=1).filter(lambda data: not b"SCUT".startswith(data[:4])))
def test_bytes_of_another_protocol_are_refused_at_once(data):
    with pytest.raises(MessageError, match="not scalpel-sim"):
        reader_of(data).take()


def test_a_payload_over_the_limit_is_refused_before_it_arrives():
    stream = pack_frame(MessageKind.STEP, 0, bytes(LARGEST_FRAME + 1))
    with pytest.raises(MessageError, match="1048577 bytes; at most 1048576"):
        reader_of(stream[:HEADER_BYTES]).take()
