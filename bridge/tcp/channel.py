"""One end of a conversation: messages to frames and back, authenticated if there is a key."""

from collections.abc import Iterator

from bridge.tcp.authentication import TAG_BYTES, Authenticator
from bridge.tcp.wire import (
    LARGEST_FRAME,
    MORE,
    Frame,
    FrameReader,
    MessageError,
    MessageKind,
    pack_frame,
)

LARGEST_PART = LARGEST_FRAME - TAG_BYTES
"""Largest payload of a frame [byte], so that it fits with its authentication tag."""


class Channel:
    """Packs messages into frames, and reads frames from a stream, with or without tags."""

    def __init__(self, limit: int = LARGEST_FRAME) -> None:
        self._reader = FrameReader(limit)
        self._outgoing: Authenticator | None = None
        self._incoming: Authenticator | None = None
        self._plain_error_may_come = False
        self.feed = self._reader.feed
        """Append bytes from the socket."""

    @property
    def is_within_a_frame(self) -> bool:
        """Whether a part of a frame has arrived, so that the rest must follow."""
        return self._reader.is_within_a_frame

    @property
    def is_authenticated(self) -> bool:
        """Whether both directions have authentication tags."""
        return self._incoming is not None

    def limit_payload(self, limit: int) -> None:
        """Refuse frames with a payload of more than `limit` bytes from now on."""
        self._reader.limit = limit

    def authenticate(
        self, outgoing: bytes, incoming: bytes, *, plain_error_may_come: bool = False
    ) -> None:
        """Add tags to outgoing messages and require them on incoming ones from now on.

        Args:
            outgoing: Key of this end's messages.
            incoming: Key of the other end's messages.
            plain_error_may_come: Whether the first message may be an ERROR without a tag: a peer
                that does not have this key can refuse it in no other way.
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
        frame = self._reader.take()
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
