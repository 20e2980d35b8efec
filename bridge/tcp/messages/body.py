"""The replies that hold a whole body: a snapshot, a surface, the number of pieces."""

import math
import struct

import numpy as np
import numpy.typing as npt

from bridge.tcp.messages.counts import check_counts
from bridge.tcp.wire import MessageError
from tissue import FloatArray, Snapshot, Surface

PIECES_BYTES = 8
"""Length of a reply with the number of pieces [byte]: one integer."""

_COUNTS = struct.Struct("<2q")

_SNAPSHOT_NODE_BYTES = 3 * 8 + 3 * 8 + 3 * 8 + 8 + 1
_TETRAHEDRON_BYTES = 4 * 8
_SURFACE_VERTEX_BYTES = 3 * 8 + 3 * 8
_TRIANGLE_BYTES = 3 * 8 + 1


def snapshot_bytes(n_nodes: int, n_tetrahedra: int) -> int:
    """Return the length of a snapshot reply [byte]."""
    return _COUNTS.size + n_nodes * _SNAPSHOT_NODE_BYTES + n_tetrahedra * _TETRAHEDRON_BYTES


def surface_bytes(n_tetrahedra: int) -> int:
    """Return the largest length of a surface reply [byte]: every face of every tetrahedron."""
    n_triangles = 4 * n_tetrahedra
    return _COUNTS.size + n_triangles * (_TRIANGLE_BYTES + 3 * _SURFACE_VERTEX_BYTES)


def pack_snapshot(snapshot: Snapshot) -> bytes:
    """Return a reply: the numbers of nodes and tetrahedra, then the arrays in order."""
    return b"".join(
        (
            _COUNTS.pack(len(snapshot.positions), len(snapshot.tetrahedra)),
            _floats(snapshot.positions),
            _floats(snapshot.rest_positions),
            _floats(snapshot.velocities),
            _floats(snapshot.masses),
            _integers(snapshot.tetrahedra),
            _flags(snapshot.fixed),
        )
    )


def unpack_snapshot(payload: bytes) -> Snapshot:
    """Return the snapshot in a reply.

    Raises:
        MessageError: the lengths do not agree, a number is not finite, or a tetrahedron refers to
            a node that does not exist.
    """
    reader = _ArrayReader(payload)
    n_nodes, n_tetrahedra = reader.counts
    check_counts(n_nodes, n_tetrahedra)
    reader.expect(snapshot_bytes(n_nodes, n_tetrahedra))
    positions = reader.floats((n_nodes, 3), "positions")
    rest_positions = reader.floats((n_nodes, 3), "rest positions")
    velocities = reader.floats((n_nodes, 3), "velocities")
    masses = reader.floats((n_nodes,), "masses")
    tetrahedra = reader.indices((n_tetrahedra, 4), n_nodes, "tetrahedra")
    fixed = reader.flags(n_nodes, "fixed")
    return Snapshot(positions, rest_positions, velocities, masses, tetrahedra, fixed)


def pack_surface(surface: Surface) -> bytes:
    """Return a reply: the numbers of vertices and triangles, then the arrays in order."""
    return b"".join(
        (
            _COUNTS.pack(len(surface.positions), len(surface.triangles)),
            _floats(surface.positions),
            _floats(surface.rest_positions),
            _integers(surface.triangles),
            _flags(surface.is_cut),
        )
    )


def unpack_surface(payload: bytes) -> Surface:
    """Return the surface in a reply.

    Raises:
        MessageError: the lengths do not agree, a number is not finite, or a triangle refers to a
            vertex that does not exist.
    """
    reader = _ArrayReader(payload)
    n_vertices, n_triangles = reader.counts
    check_counts(n_vertices, n_triangles)
    reader.expect(_COUNTS.size + n_vertices * _SURFACE_VERTEX_BYTES + n_triangles * _TRIANGLE_BYTES)
    positions = reader.floats((n_vertices, 3), "positions")
    rest_positions = reader.floats((n_vertices, 3), "rest positions")
    triangles = reader.indices((n_triangles, 3), n_vertices, "triangles")
    return Surface(positions, rest_positions, triangles, reader.flags(n_triangles, "is_cut"))


def pack_pieces(n_pieces: int) -> bytes:
    """Return a reply: the number of pieces."""
    return struct.pack("<q", n_pieces)


def unpack_pieces(payload: bytes) -> int:
    """Return the number of pieces in a reply.

    Raises:
        MessageError: the number is missing or negative.
    """
    if len(payload) != PIECES_BYTES:
        raise MessageError(f"a number of pieces of {len(payload)} bytes; wanted {PIECES_BYTES}")
    n_pieces = int.from_bytes(payload, "little", signed=True)
    if n_pieces < 0:
        raise MessageError(f"a body of {n_pieces} pieces; wanted 0 or more")
    return n_pieces


def _floats(array: FloatArray) -> bytes:
    return np.ascontiguousarray(array, "<f8").tobytes()


def _integers(array: npt.NDArray[np.int64]) -> bytes:
    return np.ascontiguousarray(array, "<i8").tobytes()


def _flags(array: npt.NDArray[np.bool_]) -> bytes:
    return np.ascontiguousarray(array, np.uint8).tobytes()


class _ArrayReader:
    """Reads one array after the other from a payload. Arrays are copies."""

    def __init__(self, payload: bytes) -> None:
        if len(payload) < _COUNTS.size:
            raise MessageError(f"a body of {len(payload)} bytes; wanted {_COUNTS.size} at least")
        self.counts: tuple[int, int] = _COUNTS.unpack_from(payload)
        self._payload = payload
        self._at = _COUNTS.size

    def expect(self, n_bytes: int) -> None:
        """Check the length of the payload [byte]."""
        if len(self._payload) != n_bytes:
            raise MessageError(
                f"a body of {self.counts} points and elements in {len(self._payload)} bytes; "
                f"wanted {n_bytes}"
            )

    def floats(self, shape: tuple[int, ...], what: str) -> FloatArray:
        """Return the next array of float64, all finite."""
        array = self._take(shape, "<f8").astype(np.float64)
        if not np.isfinite(array).all():
            raise MessageError(f"{what} are not finite")
        return array

    def indices(self, shape: tuple[int, ...], n: int, what: str) -> npt.NDArray[np.int64]:
        """Return the next array of indices from 0 to n - 1."""
        array = self._take(shape, "<i8").astype(np.int64)
        if array.size and not (array.min() >= 0 and array.max() < n):
            raise MessageError(
                f"{what} refer to points {array.min()} to {array.max()}; there are {n}"
            )
        return array

    def flags(self, n: int, what: str) -> npt.NDArray[np.bool_]:
        """Return the next array of n flags."""
        array = self._take((n,), "u1")
        if array.size and array.max() > 1:
            raise MessageError(f"a flag of {what} is neither 0 nor 1")
        return array.astype(np.bool_)

    def _take(self, shape: tuple[int, ...], dtype: str) -> npt.NDArray[np.generic]:
        array = np.frombuffer(self._payload, dtype, math.prod(shape), self._at).reshape(shape)
        self._at += array.nbytes
        return array
