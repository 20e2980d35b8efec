"""One end of a conversation: messages to bytes and back, in parts where long, sealed with a key."""

from collections.abc import Iterator

from bridge.tcp.seal import SEAL_BYTES, Sealer
from bridge.tcp.wire import LARGEST_FRAME, MORE, Frame, FrameReader, Kind, MessageError, pack_frame

LARGEST_PART = LARGEST_FRAME - SEAL_BYTES
"""[byte]. Of a payload, so that it fits with its seal."""


class Channel:
    """Cuts messages into frames, and what comes in back into frames, with or without seals."""

    def __init__(self, limit: int = LARGEST_FRAME) -> None:
        self._reader = FrameReader(limit)
        self._outgoing: Sealer | None = None
        self._incoming: Sealer | None = None
        self._plain_error_may_come = False
        self.feed = self._reader.feed
        """Take what the socket gave."""

    @property
    def is_within_a_frame(self) -> bool:
        """Whether a part of a frame has come, so that the rest must follow."""
        return self._reader.is_within_a_frame

    @property
    def is_sealed(self) -> bool:
        """Whether both directions are sealed."""
        return self._incoming is not None

    def accept(self, limit: int) -> None:
        """Take frames with a payload of this many bytes at most from now on."""
        self._reader.limit = limit

    def seal(self, outgoing: bytes, incoming: bytes, *, plain_error_may_come: bool = False) -> None:
        """Seal what goes out and ask for seals on what comes in, with a key for each.

        Args:
            outgoing: Key of this end's messages.
            incoming: Key of the other end's.
            plain_error_may_come: Whether the first message may be an ERROR without a seal: who does
                not have this key can refuse it in no other way.
        """
        self._outgoing, self._incoming = Sealer(outgoing), Sealer(incoming)
        self._plain_error_may_come = plain_error_may_come

    def pack(self, kind: Kind, sequence: int, payload: bytes = b"") -> Iterator[bytes]:
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
        """Return the next frame, its seal broken, or None when it has not come completely.

        Raises:
            MessageError: it cannot be read, or its seal is wrong. The stream ends there.
        """
        frame = self._reader.take()
        if frame is None or self._incoming is None:
            return frame
        may_be_plain = self._plain_error_may_come and self._incoming.n_before == 0
        try:
            return self._incoming.opened(frame)
        except MessageError:
            if may_be_plain and frame.kind == Kind.ERROR:
                return frame
            raise

    def _frame(self, kind: int, sequence: int, payload: bytes | memoryview) -> bytes:
        if self._outgoing is not None:
            payload = self._outgoing.sealed(kind, sequence, payload)
        return pack_frame(kind, sequence, bytes(payload))
