"""Message authentication: a tag on each message, by a key that both sides share.

Without the key, messages cannot be forged, altered, replayed, dropped or reordered undetected.

Both sides draw a nonce; from the shared key and both nonces each direction gets a key of its own.
So a message is not valid in another conversation, nor when it is sent back. A tag is HMAC-SHA256
(RFC 2104), truncated to half its length as in RFC 4868, over the number of messages before it in
its direction, its kind, its sequence number and its payload.

Nothing is encrypted: an eavesdropper can read the poses of the blade and the forces.
"""

import hmac
import secrets
import struct
from typing import NamedTuple

from bridge.tcp.wire import PROTOCOL_VERSION, Frame, MessageError

NONCE_BYTES = 32
"""Length of a nonce [byte]. It is random, so that no two conversations have the same keys."""
TAG_BYTES = 16
"""Length of the authentication tag at the end of a payload [byte]."""

_HEADER = struct.Struct("<QHI")
"""What a tag covers before the payload: number of messages before, kind, sequence number."""


class DirectionKeys(NamedTuple):
    """The keys of one conversation, one for each direction."""

    to_server: bytes
    """Key of the client's messages."""
    to_client: bytes
    """Key of the server's messages."""


def new_nonce() -> bytes:
    """Return random bytes that are used only once."""
    return secrets.token_bytes(NONCE_BYTES)


def direction_keys(key: bytes, client_nonce: bytes, server_nonce: bytes) -> DirectionKeys:
    """Return the keys of one conversation."""
    nonces = client_nonce + server_nonce
    return DirectionKeys(
        hmac.digest(key, b"scalpel-sim %d to server" % PROTOCOL_VERSION + nonces, "sha256"),
        hmac.digest(key, b"scalpel-sim %d to client" % PROTOCOL_VERSION + nonces, "sha256"),
    )


class Authenticator:
    """Adds the tags of one direction to messages, or verifies them, in the order of the stream."""

    def __init__(self, key: bytes) -> None:
        self._keyed = hmac.new(key, digestmod="sha256")  # copied for each tag, in half the time
        self._n_messages = 0

    @property
    def n_messages(self) -> int:
        """Number of messages so far."""
        return self._n_messages

    def with_tag(self, kind: int, sequence: int, payload: bytes | memoryview) -> bytes:
        """Return a payload with its tag at the end."""
        tag = self._tag(kind, sequence, payload)
        self._n_messages += 1
        return bytes(payload) + tag

    def verified(self, frame: Frame) -> Frame:
        """Return a frame without its tag.

        Raises:
            MessageError: the tag is wrong.
        """
        split = max(len(frame.payload) - TAG_BYTES, 0)
        payload, tag = frame.payload[:split], frame.payload[split:]
        if not hmac.compare_digest(tag, self._tag(frame.kind, frame.sequence, payload)):
            raise MessageError(
                "a message's authentication tag is wrong: its sender does not have the key, or the "
                "message was altered, replayed, reordered or follows one that was dropped"
            )
        self._n_messages += 1
        return frame._replace(payload=payload)

    def _tag(self, kind: int, sequence: int, payload: bytes | memoryview) -> bytes:
        code = self._keyed.copy()
        code.update(_HEADER.pack(self._n_messages, kind, sequence))
        code.update(payload)
        return code.digest()[:TAG_BYTES]
