"""The values inside the frames: a sweep, a result, a body, a description, an error.

Numbers travel as raw little-endian float64 and int64, so a result is the same bit for bit on both
sides. Only the description and an error, which have names and text, are msgpack. Nothing is
pickled. Decoding is not validation: every number is checked here, on the side that receives it.
"""

import math
import struct

import msgspec
import numpy as np
import numpy.typing as npt

from bridge.link import TissueDescription
from bridge.wire import LARGEST_REPLY, MessageError
from tissue.material import Material
from tissue.quality import Measures, QualityReport
from tissue.types import (
    BladeContacts,
    BladeSegment,
    BladeSweep,
    Energies,
    FloatArray,
    Profile,
    Snapshot,
    StepResult,
    Surface,
    Touch,
    Wrench,
)

LARGEST_ERROR = 1 << 16
"""[byte]. Text for a person to read."""
LARGEST_DESCRIPTION = 1 << 16
"""[byte]. A name and a dozen numbers."""
PIECES_BYTES = 8
"""[byte]. One integer."""
LARGEST_COORDINATE = 1e3
"""[m]. No body is larger; a blade farther away is a broken message."""
LONGEST_STEP = 1.0
"""[s]. A frame is a millisecond; a step of hours would keep the tissue busy for days."""
UNIT_TOLERANCE = 1e-6
"""How far the length of `forward` may be from 1."""


# ---- step ----------------------------------------------------------------------------------------

_NO_BLADE = struct.Struct("<d")
_BLADE = struct.Struct("<19d")


def pack_step(sweep: BladeSweep | None, dt: float) -> bytes:
    """Return a request: `dt`, and unless no blade is near: tip, heel, forward at t0 and at t1."""
    if sweep is None:
        return _NO_BLADE.pack(dt)
    return _BLADE.pack(dt, *np.concatenate((*sweep.t0, *sweep.t1)).tolist())


def unpack_step(payload: bytes) -> tuple[BladeSweep | None, float]:
    """Return the sweep and `dt` of a request.

    Raises:
        MessageError: a number is missing, not finite, or nothing that a blade can do.
    """
    if len(payload) == _NO_BLADE.size:
        return None, _checked_step(_NO_BLADE.unpack(payload)[0])
    if len(payload) != _BLADE.size:
        raise MessageError(
            f"a step request of {len(payload)} bytes; wanted {_NO_BLADE.size} or {_BLADE.size}"
        )
    dt, *numbers = _BLADE.unpack(payload)
    segments = [_segment(numbers[:9]), _segment(numbers[9:])]
    return BladeSweep(*segments), _checked_step(dt)


def _segment(numbers: list[float]) -> BladeSegment:
    # NaN is neither within limits nor near 1. Plain floats: a tenth of the time of array calls.
    if not all(-LARGEST_COORDINATE <= x <= LARGEST_COORDINATE for x in numbers[:6]):
        raise MessageError(f"the blade is not within {LARGEST_COORDINATE:g} m: {numbers[:6]}")
    if not abs(math.hypot(*numbers[6:]) - 1.0) <= UNIT_TOLERANCE:
        raise MessageError(f"forward is not a unit vector: {numbers[6:]}")
    return BladeSegment(*np.array(numbers).reshape(3, 3))


def _checked_step(dt: float) -> float:
    if not 0.0 < dt <= LONGEST_STEP:
        raise MessageError(f"a step of {dt} s; wanted more than 0 and at most {LONGEST_STEP:g}")
    return dt


_RESULT = struct.Struct("<30d8q")
_AT_T1 = 9 + 36
"""Floats of the wrench at t1 and of the stiffness."""
_OF_CONTACT = 11
"""Floats of each contact of the blade."""
MOST_BLADE_CONTACTS = 1 << 16
RESULT_BYTES = _RESULT.size + 8 * (
    _AT_T1 + _OF_CONTACT * MOST_BLADE_CONTACTS + len(Energies._fields)
)
"""At most."""


def pack_result(result: StepResult) -> bytes:
    """Return a reply: floats of a result in the order of its fields, integers, then its arrays."""
    touch = result.touch
    vectors = (*result.wrench, result.force_on_tissue, *result.bounds, touch.force_of_floor)
    contacts = result.contacts
    numbers = _RESULT.pack(
        *np.concatenate(vectors).tolist(),
        result.anchored_length,
        result.cut_area,
        result.work_of_blade,
        result.work_of_cutting,
        touch.penetration,
        touch.force,
        *result.profile,
        result.n_tetrahedra,
        result.n_nodes,
        result.n_active,
        result.active_point_tetrahedron,
        result.n_substeps,
        touch.n_contacts,
        len(contacts.point),
        result.energies is not None,
    )
    energies = () if result.energies is None else result.energies
    arrays = (*result.wrench_t1, result.stiffness, *contacts, np.array(energies))
    return numbers + b"".join(_floats(array) for array in arrays)


def unpack_result(payload: bytes) -> StepResult:
    """Return the result in a reply.

    The numbers of the physics are passed on as they are, NaN too: what becomes of a tissue that
    diverged is decided in one place for both links, the coupling.

    Raises:
        MessageError: the length is wrong, or a count is negative or too large.
    """
    if len(payload) < _RESULT.size:
        raise MessageError(f"a step reply of {len(payload)} bytes; wanted {_RESULT.size} or more")
    fields = _RESULT.unpack(payload[: _RESULT.size])
    rows = np.array(fields[:21]).reshape(7, 3)
    length, area, work, work_of_cutting, penetration, force = fields[21:27]
    n_tetrahedra, n_nodes, n_active, point_tetrahedron, n_substeps, n_contacts = fields[30:36]
    _check_counts(n_nodes, n_tetrahedra)
    if not (0 <= n_active <= n_tetrahedra and -1 <= point_tetrahedron < n_tetrahedra):
        raise MessageError(
            f"{n_active} active tetrahedra and tip in {point_tetrahedron}, of {n_tetrahedra}"
        )
    if n_substeps < 0 or n_contacts < 0:
        raise MessageError(f"{n_substeps} substeps and {n_contacts} contacts")
    n_blade_contacts, has_energies = fields[36:]
    if not 0 <= n_blade_contacts <= MOST_BLADE_CONTACTS or has_energies not in (0, 1):
        raise MessageError(f"{n_blade_contacts} contacts of the blade, energies {has_energies}")
    n_floats = _AT_T1 + _OF_CONTACT * n_blade_contacts + has_energies * len(Energies._fields)
    if len(payload) != _RESULT.size + 8 * n_floats:
        raise MessageError(
            f"a step reply of {len(payload)} bytes; wanted {_RESULT.size + 8 * n_floats}"
        )
    floats = np.frombuffer(payload, "<f8", offset=_RESULT.size)
    widths = np.array([3, 3, 3, 36, *(n_blade_contacts * w for w in (3, 3, 1, 3, 1))])
    *parts, rest = np.split(floats, widths.cumsum())
    point, normal, normal_force, friction, cut_area = parts[4:]
    return StepResult(
        wrench=Wrench(*rows[:3]),
        wrench_t1=Wrench(*parts[:3]),
        stiffness=parts[3].reshape(6, 6),
        contacts=BladeContacts(
            point.reshape(-1, 3),
            normal.reshape(-1, 3),
            normal_force,
            friction.reshape(-1, 3),
            cut_area,
        ),
        force_on_tissue=rows[3],
        bounds=rows[4:6],
        n_tetrahedra=n_tetrahedra,
        n_nodes=n_nodes,
        n_active=n_active,
        active_point_tetrahedron=point_tetrahedron,
        anchored_length=length,
        cut_area=area,
        work_of_blade=work,
        work_of_cutting=work_of_cutting,
        n_substeps=n_substeps,
        touch=Touch(n_contacts, penetration, force, rows[6]),
        profile=Profile(*fields[27:30]),
        energies=Energies(*rest.tolist()) if has_energies else None,
    )


# ---- the whole body ------------------------------------------------------------------------------

_COUNTS = struct.Struct("<2q")

_SNAPSHOT_NODE_BYTES = 3 * 8 + 3 * 8 + 3 * 8 + 8 + 1
_TETRAHEDRON_BYTES = 4 * 8
_SURFACE_VERTEX_BYTES = 3 * 8 + 3 * 8
_TRIANGLE_BYTES = 3 * 8 + 1


def snapshot_bytes(n_nodes: int, n_tetrahedra: int) -> int:
    """Return the length of a snapshot reply [byte]."""
    return _COUNTS.size + n_nodes * _SNAPSHOT_NODE_BYTES + n_tetrahedra * _TETRAHEDRON_BYTES


def surface_bytes(n_tetrahedra: int) -> int:
    """Return the most that a surface reply can have [byte]: every face of every tetrahedron."""
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
        MessageError: the lengths do not agree, a number is not finite, or a tetrahedron names a
            node that is not there.
    """
    reader = _ArrayReader(payload)
    n_nodes, n_tetrahedra = reader.counts
    _check_counts(n_nodes, n_tetrahedra)
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
        MessageError: the lengths do not agree, a number is not finite, or a triangle names a
            vertex that is not there.
    """
    reader = _ArrayReader(payload)
    n_vertices, n_triangles = reader.counts
    _check_counts(n_vertices, n_triangles)
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
        MessageError: it is missing or negative.
    """
    if len(payload) != PIECES_BYTES:
        raise MessageError(f"a number of pieces of {len(payload)} bytes; wanted {PIECES_BYTES}")
    n_pieces = int.from_bytes(payload, "little", signed=True)
    if n_pieces < 0:
        raise MessageError(f"{n_pieces} pieces")
    return n_pieces


_QUALITY = struct.Struct("<10d3q")
QUALITY_BYTES = _QUALITY.size


def pack_quality(report: QualityReport) -> bytes:
    """Return a reply: the floats of a report in the order of its fields, then its integers."""
    return _QUALITY.pack(
        report.path_error_mean,
        report.path_error_largest,
        report.node_size,
        report.guard,
        *report.initial[1:],
        *report.now[1:],
        report.n_cut_nodes,
        report.initial.n_tetrahedra,
        report.now.n_tetrahedra,
    )


def unpack_quality(payload: bytes) -> QualityReport:
    """Return the report in a reply.

    Raises:
        MessageError: the length is wrong, a number is negative or none, or there is no tetrahedron.
    """
    if len(payload) != _QUALITY.size:
        raise MessageError(f"a quality report of {len(payload)} bytes; wanted {_QUALITY.size}")
    numbers = _QUALITY.unpack(payload)
    n_cut_nodes, n_initial, n_now = numbers[10:]
    _check_counts(n_cut_nodes, min(n_initial, n_now) - 1)
    if not all(number >= 0.0 for number in numbers[:10]):  # infinite: a step of what cannot move
        raise MessageError(f"a quality report of {numbers[:10]}")
    return QualityReport(
        n_cut_nodes,
        numbers[0],
        numbers[1],
        numbers[2],
        numbers[3],
        Measures(n_initial, *numbers[4:7]),
        Measures(n_now, *numbers[7:10]),
    )


def _check_counts(n_points: int, n_elements: int) -> None:
    """Refuse counts that no reply could hold, before anything is computed from them."""
    if not (0 <= n_points <= LARGEST_REPLY and 0 <= n_elements <= LARGEST_REPLY):
        raise MessageError(f"{n_points} points and {n_elements} elements")


def _floats(array: FloatArray) -> bytes:
    return np.ascontiguousarray(array, "<f8").tobytes()


def _integers(array: npt.NDArray[np.int64]) -> bytes:
    return np.ascontiguousarray(array, "<i8").tobytes()


def _flags(array: npt.NDArray[np.bool_]) -> bytes:
    return np.ascontiguousarray(array, np.uint8).tobytes()


class _ArrayReader:
    """Takes one array after the other out of a payload. Arrays are copies."""

    def __init__(self, payload: bytes) -> None:
        if len(payload) < _COUNTS.size:
            raise MessageError(f"a body of {len(payload)} bytes; wanted {_COUNTS.size} at least")
        self.counts: tuple[int, int] = _COUNTS.unpack_from(payload)
        self._payload = payload
        self._at = _COUNTS.size

    def expect(self, n_bytes: int) -> None:
        """Refuse a payload of another length."""
        if len(self._payload) != n_bytes:
            raise MessageError(
                f"a body of {self.counts} points and elements in {len(self._payload)} bytes; "
                f"wanted {n_bytes}"
            )

    def floats(self, shape: tuple[int, ...], what: str) -> FloatArray:
        array = self._take(shape, "<f8").astype(np.float64)
        if not np.isfinite(array).all():
            raise MessageError(f"{what} are not finite")
        return array

    def indices(self, shape: tuple[int, ...], n: int, what: str) -> npt.NDArray[np.int64]:
        array = self._take(shape, "<i8").astype(np.int64)
        if array.size and not (array.min() >= 0 and array.max() < n):
            raise MessageError(f"{what} name points {array.min()} to {array.max()} of {n}")
        return array

    def flags(self, n: int, what: str) -> npt.NDArray[np.bool_]:
        array = self._take((n,), "u1")
        if array.size and array.max() > 1:
            raise MessageError(f"{what} is neither 0 nor 1")
        return array.astype(np.bool_)

    def _take(self, shape: tuple[int, ...], dtype: str) -> npt.NDArray[np.generic]:
        array = np.frombuffer(self._payload, dtype, math.prod(shape), self._at).reshape(shape)
        self._at += array.nbytes
        return array


# ---- names and text ------------------------------------------------------------------------------


class _Description(msgspec.Struct, forbid_unknown_fields=True):
    scene: str
    material: Material
    bounds: tuple[tuple[float, float, float], tuple[float, float, float]]
    n_tetrahedra: int
    n_nodes: int


_description_decoder = msgspec.msgpack.Decoder(_Description)


def pack_description(description: TissueDescription) -> bytes:
    """Return the reply to a HELLO."""
    low, high = description.bounds.tolist()
    return msgspec.msgpack.encode(
        _Description(
            description.scene,
            description.material,
            (tuple(low), tuple(high)),
            description.n_tetrahedra,
            description.n_nodes,
        )
    )


def unpack_description(payload: bytes) -> TissueDescription:
    """Return the description in the reply to a HELLO.

    Raises:
        MessageError: a field is missing, of another type, or out of range.
    """
    try:
        found = _description_decoder.decode(payload)
    except (msgspec.DecodeError, UnicodeDecodeError) as error:
        raise MessageError(f"the tissue's description cannot be read: {error}") from error
    bounds = np.array(found.bounds)
    if not (np.isfinite(bounds).all() and (bounds[0] <= bounds[1]).all()):
        raise MessageError(f"the tissue's bounds are {bounds.tolist()} m")
    _check_counts(found.n_nodes, found.n_tetrahedra)
    return TissueDescription(found.scene, found.material, bounds, found.n_tetrahedra, found.n_nodes)


def pack_error(message: str) -> bytes:
    """Return the reply to what could not be done: one line for a person to read."""
    return msgspec.msgpack.encode(message[: LARGEST_ERROR // 8])


def unpack_error(payload: bytes) -> str:
    """Return the line in an ERROR.

    Raises:
        MessageError: it is no text.
    """
    try:
        return msgspec.msgpack.decode(payload, type=str)
    except (msgspec.DecodeError, UnicodeDecodeError) as error:
        raise MessageError(f"an error that cannot be read: {error}") from error
