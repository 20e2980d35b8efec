import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.tcp.channel import TAG_BYTES, Authenticator, direction_keys, new_nonce
from bridge.tcp.wire import Frame, MessageError, MessageKind

KEY = bytes(range(32))


def sent(payload, authenticator=None, kind=MessageKind.STEP, sequence=7):
    """Return the frame of a payload with its authentication tag."""
    return Frame(
        kind, sequence, (authenticator or Authenticator(KEY)).with_tag(kind, sequence, payload)
    )


@given(st.lists(st.binary(max_size=100), max_size=5))
def test_a_stream_of_messages_with_tags_is_verified_in_order(payloads):
    sender, receiver = Authenticator(KEY), Authenticator(KEY)
    assert [receiver.verified(sent(payload, sender)).payload for payload in payloads] == payloads


@given(st.binary(max_size=50), st.data())
def test_a_message_with_a_changed_byte_is_not_verified(payload, data):
    frame = sent(payload)
    changed = bytearray(frame.payload)
    changed[data.draw(st.integers(0, len(changed) - 1))] ^= data.draw(st.integers(1, 255))
    with pytest.raises(MessageError, match="authentication tag is wrong"):
        Authenticator(KEY).verified(frame._replace(payload=bytes(changed)))


@pytest.mark.parametrize(
    "change", [{"kind": MessageKind.SNAPSHOT}, {"sequence": 8}, {"payload": b""}]
)
def test_a_tag_does_not_verify_another_message(change):
    with pytest.raises(MessageError, match="authentication tag is wrong"):
        Authenticator(KEY).verified(sent(b"to cut")._replace(**change))


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


def test_a_tag_is_half_a_digest_of_what_the_documentation_says():
    """RFC 2104 and RFC 4868, computed step by step: two hashes around padded keys."""
    import hashlib
    import struct

    inner = bytes(b ^ 0x36 for b in KEY.ljust(64, b"\0"))
    outer = bytes(b ^ 0x5C for b in KEY.ljust(64, b"\0"))
    message = struct.pack("<QHI", 0, MessageKind.STEP, 7) + b"to cut"
    digest = hashlib.sha256(outer + hashlib.sha256(inner + message).digest()).digest()
    assert sent(b"to cut").payload == b"to cut" + digest[:TAG_BYTES]
