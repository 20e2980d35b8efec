"""One end of a conversation: messages to frames and back, authenticated if there is a key."""

import hmac
import secrets
import struct
from collections.abc import Iterator
from typing import NamedTuple

from bridge.tcp.wire import (
    LARGEST_FRAME,
    MORE,
    PROTOCOL_VERSION,
    Frame,
    FrameReader,
    MessageError,
    MessageKind,
    pack_frame,
)

NONCE_BYTES = 32
"""Length of a nonce [byte]. It is random, so that no two conversations have the same keys."""

TAG_BYTES = 16
"""Length of the authentication tag at the end of a payload [byte]."""

LARGEST_PART = LARGEST_FRAME - TAG_BYTES
"""Largest payload of a frame [byte], so that it fits with its authentication tag."""


class Channel(FrameReader):
    """Packs messages into frames, and reads frames from a stream, with or without tags."""

    def __init__(self, limit: int = LARGEST_FRAME) -> None:
        super().__init__(limit)
        self._outgoing: Authenticator | None = None
        self._incoming: Authenticator | None = None
        self._plain_error_may_come = False

    @property
    def is_authenticated(self) -> bool:
        """Whether both directions have authentication tags."""
        return self._incoming is not None

    def authenticate(
        self, outgoing: bytes, incoming: bytes, *, plain_error_may_come: bool = False
    ) -> None:
        """Add tags to outgoing messages and require them on incoming ones from now on.

        Args:
            outgoing: Key of this end's messages.
            incoming: Key of the other end's messages.
            plain_error_may_come: Whether the first message may be an ERROR without a tag: a peer
                that does not have this key cannot refuse it otherwise.
        """
        self._outgoing, self._incoming = Authenticator(outgoing), Authenticator(incoming)
        self._plain_error_may_come = plain_error_may_come

    def pack(self, kind: MessageKind, sequence: int, payload: bytes = b"") -> Iterator[bytes]:
        """Yield the frames of a message: one, or as many as a long one needs."""
        if len(payload) <= LARGEST_PART:
            yield self._frame(kind, sequence, payload)
            return
        rest = memoryview(payload)
        while len(rest) > LARGEST_PART:
            yield self._frame(kind | MORE, sequence, rest[:LARGEST_PART])
            rest = rest[LARGEST_PART:]
        yield self._frame(kind, sequence, rest)

    def take(self) -> Frame | None:
        """Return the next frame, verified and without its tag, or None if it is incomplete.

        Raises:
            MessageError: it cannot be read, or its tag is wrong. The stream cannot be read further.
        """
        frame = super().take()
        if frame is None or self._incoming is None:
            return frame
        may_be_plain = self._plain_error_may_come and self._incoming.n_messages == 0
        try:
            return self._incoming.verified(frame)
        except MessageError:
            if may_be_plain and frame.kind == MessageKind.ERROR:
                return frame
            raise

    def _frame(self, kind: int, sequence: int, payload: bytes | memoryview) -> bytes:
        if self._outgoing is not None:
            payload = self._outgoing.with_tag(kind, sequence, payload)
        return pack_frame(kind, sequence, bytes(payload))


_HEADER = struct.Struct("<QHI")
"""Content of a tag before the payload: number of messages before, kind, sequence number."""


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
