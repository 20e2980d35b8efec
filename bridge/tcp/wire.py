"""Frames of bytes between two processes; docs/wire.md describes the whole protocol.

A frame is a header of 24 bytes and a payload, little-endian:

    magic      4 bytes   b"SCUT"
    version    uint16    PROTOCOL_VERSION; the same on both sides
    kind       uint16    MessageKind, plus MORE where another part of the same message follows
    sequence   uint32    number of a request, counted from 0, and of its reply
    length     uint32    length of the payload, at most LARGEST_FRAME
    checksum   uint32    CRC-32 of the payload
    header     uint32    CRC-32 of the 20 bytes before, so that a corrupt length is detected
"""

import enum
import struct
import zlib
from typing import NamedTuple

MAGIC = b"SCUT"
PROTOCOL_VERSION = 12
"""Version of the protocol. 3 added keys, long replies in parts, and the wrench at t1, stiffness,
contacts and energies of a step; 6 added driven frames; 7 added driven geoms
and ties; 8 added values at the surface; 9 made contents
MessagePack; 10 added stress and strain of tetrahedra;
11 added labels of surfaces; 12 added the list of cut faces and positions of material points."""

LARGEST_FRAME = 1 << 20
"""Largest payload of a frame [byte], which must be kept before it can be checked. A step request
has some 200 bytes, and 96 for each driven frame and geom; a whole body comes in parts."""
LARGEST_REPLY = 1 << 30
"""Largest reply, all parts [byte]. A snapshot of ten million tetrahedra is half of it. The limit of
a single reply follows from the mesh: see `snapshot_bytes` and `surface_bytes` in
`messages.body`."""
READ_BYTES = 1 << 16
"""Size of a read from a socket [byte]. From 128 KiB on each read would map new memory from the
system, which takes longer than the rest of a round trip."""
MORE = 0x8000
"""Bit of `kind`: another part of the same message follows."""


class MessageError(ValueError):
    """A received message violates the protocol."""


class MessageKind(enum.IntEnum):
    """Kind of a message. A reply has the kind of its request, or is an ERROR or a CHALLENGE."""

    HELLO = 1
    STEP = 2
    SNAPSHOT = 3
    SURFACE = 4
    PIECES = 5
    ERROR = 6
    QUALITY = 7
    CHALLENGE = 8
    CHUNKS = 9
    ATTACH = 10
    RELEASE = 11
    FRAMES = 12
    COLLIDE = 13
    TIE = 14
    VALUES = 15
    SERVO = 16
    MEASURED = 17
    END = 18
    DEFORMATION = 19
    CUT_FACES = 20
    POSITIONS = 21


class Frame(NamedTuple):
    """One message, or a part of one."""

    kind: int
    """`MessageKind`, plus MORE if another part follows."""
    sequence: int
    """Number of the request, in its reply too."""
    payload: bytes
    """Content, at most `LARGEST_FRAME` bytes."""


_HEADER = struct.Struct("<4sHHIII")
_CHECKSUM = struct.Struct("<I")
HEADER_BYTES = _HEADER.size + _CHECKSUM.size


def pack_frame(kind: int, sequence: int, payload: bytes = b"") -> bytes:
    """Return the bytes of a frame."""
    header = _HEADER.pack(
        MAGIC, PROTOCOL_VERSION, kind, sequence, len(payload), zlib.crc32(payload)
    )
    return header + _CHECKSUM.pack(zlib.crc32(header)) + payload


class FrameReader:
    """Reads frames from a stream of bytes.

    After a MessageError the stream cannot be read further: the start of the next frame is unknown.
    """

    def __init__(self, limit: int = LARGEST_FRAME) -> None:
        self.limit = limit
        """The largest payload to accept [byte]."""
        self._buffer = bytearray()

    @property
    def is_within_a_frame(self) -> bool:
        """Whether a part of a frame has arrived, so that the rest must follow."""
        return len(self._buffer) > 0

    def feed(self, data: bytes | memoryview) -> None:
        """Append bytes from the socket."""
        self._buffer += data

    def take(self) -> Frame | None:
        """Return the next frame, or None if it is incomplete.

        Raises:
            MessageError: the bytes are not of this protocol or version, corrupt, or too many.
        """
        buffer = self._buffer
        if not buffer:
            return None
        if not MAGIC.startswith(buffer[:4]):
            raise MessageError(
                f"the other side is not scalpel-sim: its data begin with {bytes(buffer[:16])!r}"
            )
        if len(buffer) < HEADER_BYTES:
            return None
        _, version, kind, sequence, length, checksum = _HEADER.unpack_from(buffer)
        if version != PROTOCOL_VERSION:
            raise MessageError(
                f"the other side uses version {version} of the protocol and this one "
                f"{PROTOCOL_VERSION}; use the same scalpel-sim on both"
            )
        if _CHECKSUM.unpack_from(buffer, _HEADER.size)[0] != zlib.crc32(buffer[: _HEADER.size]):
            raise MessageError("a header is corrupt: its checksum is wrong")
        if length > self.limit:
            raise MessageError(f"a message of {length} bytes; at most {self.limit} are allowed")
        if len(buffer) < HEADER_BYTES + length:
            return None
        payload = bytes(buffer[HEADER_BYTES : HEADER_BYTES + length])
        del buffer[: HEADER_BYTES + length]
        if zlib.crc32(payload) != checksum:
            raise MessageError("a message is corrupt: its checksum is wrong")
        return Frame(kind, sequence, payload)
