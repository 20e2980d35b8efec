"""Frames of bytes between two processes; docs/wire.md tells the whole protocol.

A frame is a header of 24 bytes and a payload, little-endian:

    magic      4 bytes   b"SCUT"
    version    uint16    VERSION; both sides must speak the same
    kind       uint16    Kind, and MORE where another part of the same message follows
    sequence   uint32    a request's number, counted from 0; its reply carries the same
    length     uint32    of the payload, at most LARGEST_FRAME
    checksum   uint32    CRC-32 of the payload
    header     uint32    CRC-32 of the 20 bytes before, so that a broken length is never waited for
"""

import enum
import struct
import zlib
from typing import NamedTuple

MAGIC = b"SCUT"
VERSION = 3
"""3: keys; long replies in parts; wrench at t1, stiffness, contacts and energies of a step."""

LARGEST_FRAME = 1 << 20
"""[byte]. What one side must hold of the other's before it can be checked. A step is 152 bytes;
what is longer, a whole body, comes in parts."""
LARGEST_REPLY = 1 << 30
"""[byte], all parts. A snapshot of ten million tetrahedra is half of it. What a single reply may
have follows from the mesh: see `snapshot_bytes` and `surface_bytes` in `messages.body`."""
READ_BYTES = 1 << 16
"""How much to take from a socket at once [byte]. From 128 KiB on, every read would map fresh memory
from the system, which takes longer than the rest of a round trip."""
MORE = 0x8000
"""Bit of `kind`: another part of the same message follows."""


class MessageError(ValueError):
    """What was received is not what the protocol allows."""


class Kind(enum.IntEnum):
    """What a frame is. A reply has its request's kind, or is an ERROR or a CHALLENGE."""

    HELLO = 1
    STEP = 2
    SNAPSHOT = 3
    SURFACE = 4
    PIECES = 5
    ERROR = 6
    QUALITY = 7
    CHALLENGE = 8
    CHUNKS = 9


class Frame(NamedTuple):
    """One message, or a part of one."""

    kind: int
    """With MORE, if more follows."""
    sequence: int
    payload: bytes


_HEADER = struct.Struct("<4sHHIII")
_CHECKSUM = struct.Struct("<I")
HEADER_BYTES = _HEADER.size + _CHECKSUM.size


def pack_frame(kind: int, sequence: int, payload: bytes = b"") -> bytes:
    """Return the bytes of a frame."""
    header = _HEADER.pack(MAGIC, VERSION, kind, sequence, len(payload), zlib.crc32(payload))
    return header + _CHECKSUM.pack(zlib.crc32(header)) + payload


class FrameReader:
    """Cuts a stream of bytes into frames.

    After a MessageError the stream cannot be read any further: nobody knows where a frame begins.
    """

    def __init__(self, limit: int = LARGEST_FRAME) -> None:
        self.limit = limit
        """The largest payload to accept [byte]."""
        self._buffer = bytearray()

    @property
    def is_within_a_frame(self) -> bool:
        """Whether a part of a frame has come, so that the rest must follow."""
        return len(self._buffer) > 0

    def feed(self, data: bytes | memoryview) -> None:
        """Take what the socket gave."""
        self._buffer += data

    def take(self) -> Frame | None:
        """Return the next frame, or None when it has not come completely.

        Raises:
            MessageError: these are not our bytes, they are broken, of another version, or too many.
        """
        buffer = self._buffer
        if not buffer:
            return None
        if not MAGIC.startswith(buffer[:4]):
            raise MessageError(f"this is not scalpel-sim: it begins with {bytes(buffer[:16])!r}")
        if len(buffer) < HEADER_BYTES:
            return None
        _, version, kind, sequence, length, checksum = _HEADER.unpack_from(buffer)
        if version != VERSION:
            raise MessageError(
                f"the other side speaks version {version} of the protocol and this one "
                f"{VERSION}; use the same scalpel-sim on both"
            )
        if _CHECKSUM.unpack_from(buffer, _HEADER.size)[0] != zlib.crc32(buffer[: _HEADER.size]):
            raise MessageError("a header is broken: its checksum is wrong")
        if length > self.limit:
            raise MessageError(f"a message of {length} bytes; at most {self.limit} are allowed")
        if len(buffer) < HEADER_BYTES + length:
            return None
        payload = bytes(buffer[HEADER_BYTES : HEADER_BYTES + length])
        del buffer[: HEADER_BYTES + length]
        if zlib.crc32(payload) != checksum:
            raise MessageError("a message is broken: its checksum is wrong")
        return Frame(kind, sequence, payload)
