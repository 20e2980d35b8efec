"""The reply with the boxes of the tissue's chunks, for the broad phase."""

import math
import struct

import numpy as np

from bridge.tcp.wire import LARGEST_FRAME, MessageError
from tissue import Chunks

_HEAD = struct.Struct("<qd")
_BOX_BYTES = 6 * 8
LARGEST_CHUNKS = LARGEST_FRAME
"""Largest reply [byte]: twenty thousand boxes, more than can be tested a thousand times a
second."""


def pack_chunks(chunks: Chunks) -> bytes:
    """Return a reply: the number of boxes, the speed of the fastest node, the corners."""
    head = _HEAD.pack(len(chunks.boxes), chunks.fastest)
    return head + np.ascontiguousarray(chunks.boxes, "<f8").tobytes()


def unpack_chunks(payload: bytes) -> Chunks:
    """Return the boxes in a reply.

    Raises:
        MessageError: the length is wrong, a number is not finite, or a box is inverted, which the
            collision library would accept silently.
    """
    if len(payload) < _HEAD.size:
        raise MessageError(f"chunks of {len(payload)} bytes; wanted {_HEAD.size} at least")
    n, fastest = _HEAD.unpack_from(payload)
    if n < 0 or len(payload) != _HEAD.size + _BOX_BYTES * n:
        raise MessageError(f"{n} chunks do not fit {len(payload)} bytes")
    boxes = np.frombuffer(payload, "<f8", offset=_HEAD.size).astype(np.float64).reshape(n, 2, 3)
    if not (np.isfinite(boxes).all() and (boxes[:, 0] <= boxes[:, 1]).all()):
        raise MessageError("the box of a chunk is not finite or inverted")
    if not 0.0 <= fastest < math.inf:
        raise MessageError(f"the fastest node moves at {fastest} m/s; wanted 0 or more, finite")
    return Chunks(boxes, fastest)
