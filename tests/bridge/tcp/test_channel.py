import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.tcp.channel import (
    LARGEST_PART,
    Authenticator,
    Channel,
    direction_keys,
    new_nonce,
)
from bridge.tcp.wire import (
    HEADER_BYTES,
    LARGEST_FRAME,
    MORE,
    Frame,
    MessageError,
    MessageKind,
    pack_frame,
)

KEYS = direction_keys(bytes(32), b"mine", b"theirs")


def ends(keys=KEYS):
    """Return the channels of a client and a server, authenticated by these keys, or plain."""
    client, server = Channel(), Channel()
    if keys is not None:
        client.authenticate(keys.to_server, keys.to_client, plain_error_may_come=True)
        server.authenticate(keys.to_client, keys.to_server)
    return client, server


def received(channel, stream):
    """Return all frames in a stream of bytes."""
    channel.feed(b"".join(stream))
    frames = []
    while (frame := channel.take()) is not None:
        frames.append(frame)
    return frames


@pytest.mark.parametrize("keys", [None, KEYS], ids=["plain", "authenticated"])
@given(
    st.lists(st.tuples(st.sampled_from(MessageKind), st.integers(0, 99), st.binary(max_size=99)))
)
def test_messages_arrive_as_they_were_sent(keys, messages):
    client, server = ends(keys)
    stream = [frame for message in messages for frame in client.pack(*message)]
    assert received(server, stream) == messages


@pytest.mark.parametrize("keys", [None, KEYS], ids=["plain", "authenticated"])
@pytest.mark.parametrize("n", [LARGEST_PART, LARGEST_PART + 1, 3 * LARGEST_PART])
def test_a_long_message_comes_in_parts_of_a_mebibyte_at_most(keys, n):
    client, server = ends(keys)
    payload = bytes(range(256)) * (n // 256 + 1)
    stream = list(server.pack(MessageKind.SNAPSHOT, 3, payload[:n]))
    assert max(map(len, stream)) <= HEADER_BYTES + LARGEST_FRAME
    frames = received(client, stream)
    assert [bool(frame.kind & MORE) for frame in frames] == [True] * (len(frames) - 1) + [False]
    assert b"".join(frame.payload for frame in frames) == payload[:n]


def test_a_message_without_a_tag_is_refused_where_tags_are_required():
    for end in ends():
        with pytest.raises(MessageError, match="authentication tag is wrong"):
            received(end, [pack_frame(MessageKind.STEP, 1, bytes(100))])


def test_a_message_that_is_sent_back_is_refused():
    client, _ = ends()
    with pytest.raises(MessageError, match="authentication tag is wrong"):
        received(client, client.pack(MessageKind.STEP, 1, b"to cut"))


def test_only_the_first_answer_to_a_client_may_be_an_error_without_a_tag():
    refusal = pack_frame(MessageKind.ERROR, 1, b"another key")
    client, server = ends()
    assert received(client, [refusal]) == [Frame(MessageKind.ERROR, 1, b"another key")]
    client, server = ends()
    received(client, server.pack(MessageKind.HELLO, 1))
    with pytest.raises(MessageError, match="authentication tag is wrong"):
        received(client, [refusal])


KEY = bytes(range(32))


def sent(payload, authenticator=None, kind=MessageKind.STEP, sequence=7):
    """Return the frame of a payload with its authentication tag."""
    return Frame(
        kind, sequence, (authenticator or Authenticator(KEY)).with_tag(kind, sequence, payload)
    )


@given(st.binary(max_size=50), st.data())
def test_a_message_with_a_changed_byte_is_not_verified(payload, data):
    frame = sent(payload)
    changed = bytearray(frame.payload)
    changed[data.draw(st.integers(0, len(changed) - 1))] ^= data.draw(st.integers(1, 255))
    with pytest.raises(MessageError, match="authentication tag is wrong"):
        Authenticator(KEY).verified(frame._replace(payload=bytes(changed)))


def test_a_repeated_or_omitted_message_is_detected():
    sender, receiver = Authenticator(KEY), Authenticator(KEY)
    first, second = sent(b"1", sender), sent(b"2", sender)
    with pytest.raises(MessageError):
        receiver.verified(second)
    receiver.verified(first)
    with pytest.raises(MessageError):
        receiver.verified(first)
    assert receiver.verified(second).payload == b"2"


def test_each_direction_of_each_conversation_has_its_own_key():
    nonces = [new_nonce() for _ in range(4)]
    keys = [*direction_keys(KEY, *nonces[:2]), *direction_keys(KEY, *nonces[2:])]
    keys += direction_keys(bytes(32), *nonces[:2])
    assert len(set(keys)) == len(keys) == 6
