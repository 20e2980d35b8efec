"""The replies about the body: snapshot, surface, pieces, chunks, accuracy of the cuts."""

import math
from typing import Annotated, NamedTuple

import msgspec
import numpy as np

from bridge.tcp.messages.driven import expect_near
from bridge.tcp.messages.encoding import (
    MAP_BYTES,
    Array,
    Count,
    Message,
    Record,
    expect_finite,
)
from bridge.tcp.wire import LARGEST_FRAME, MessageError
from tissue import (
    Chunks,
    CutFaces,
    CutReport,
    Deformation,
    FloatArray,
    IntArray,
    MeshMeasures,
    Snapshot,
    Surface,
    SurfaceQuantity,
)

LARGEST_CHUNKS = LARGEST_FRAME
"""Largest reply with chunks [byte]: twenty thousand boxes, more than can be tested a thousand times
a second."""

_NODE_BYTES = 3 * 8 + 3 * 8 + 3 * 8 + 8 + 8 + 1
_TETRAHEDRON_BYTES = 4 * 8 + 8
_VERTEX_BYTES = 3 * 8 + 3 * 8
_TRIANGLE_BYTES = 3 * 8 + 1 + 8

_FACE_BYTES = 9 * 8 + 8 + 2 * 8 + 8 + 8

_POINT_BYTES = 3 * 8 + 8

MAX_POINTS = 1 << 12
"""Largest number of material points in a request: a line of a metre in steps of 0.25 mm. Each
that is new is looked for in all tetrahedra."""

_N_CAUSES = 3
"""Number of causes of a cut face: see `tissue.CutFaces`."""


class PointsAtRest(NamedTuple):
    """Material points whose positions are asked for."""

    at_rest: FloatArray
    """Where they are in the body at rest [m], shape (n, 3)."""
    holders: IntArray
    """Tetrahedron that held each when it was looked up last, or -1; shape (n,)."""


class PointsNow(NamedTuple):
    """The positions of material points."""

    positions: FloatArray
    """Where they are now [m], shape (n, 3)."""
    holders: IntArray
    """Tetrahedron that holds each, shape (n,)."""


_Natural = Annotated[float, msgspec.Meta(ge=0.0)]
"""A float that is not negative; infinity is the time step of a body that cannot move."""


def snapshot_bytes(n_nodes: int, n_tetrahedra: int) -> int:
    """Return the largest length of a snapshot [byte]."""
    return MAP_BYTES + n_nodes * _NODE_BYTES + n_tetrahedra * _TETRAHEDRON_BYTES


def deformation_bytes(n_tetrahedra: int) -> int:
    """Return the largest length of the stress and strain of tetrahedra [byte]."""
    return MAP_BYTES + 2 * 9 * 8 * n_tetrahedra


def surface_bytes(n_tetrahedra: int) -> int:
    """Return the largest length of a surface [byte]: every face of every tetrahedron."""
    return MAP_BYTES + 4 * n_tetrahedra * (_TRIANGLE_BYTES + 3 * _VERTEX_BYTES)


def cut_faces_bytes(n_faces: int) -> int:
    """Return the length of a list of cut faces [byte], at most."""
    return MAP_BYTES + n_faces * _FACE_BYTES


def positions_bytes(n_points: int) -> int:
    """Return the length of the positions of material points [byte], at most."""
    return MAP_BYTES + n_points * _POINT_BYTES


def values_bytes(n_nodes: int) -> int:
    """Return the largest length of the values on a surface [byte]: every node is a vertex."""
    return MAP_BYTES + 8 * n_nodes


def _check_snapshot(snapshot: Snapshot) -> None:
    expect_finite(*snapshot[:5])
    _expect_indices(snapshot.tetrahedra, len(snapshot.masses), "tetrahedra")


def _check_surface(surface: Surface) -> None:
    expect_finite(*surface[:2])
    _expect_indices(surface.triangles, len(surface.positions), "triangles")


def _check_chunks(chunks: Chunks) -> None:
    """Refuse boxes that the collision library would accept silently."""
    boxes, fastest = chunks
    if not (np.isfinite(boxes).all() and (boxes[:, 0] <= boxes[:, 1]).all()):
        raise MessageError("the box of a chunk is not finite or inverted")
    if not 0.0 <= fastest < math.inf:
        raise MessageError(f"the fastest node moves at {fastest} m/s; wanted 0 or more, finite")


def _check_cut_faces(faces: CutFaces) -> None:
    expect_finite(faces.corners, faces.areas, faces.times)
    if (faces.areas < 0.0).any():
        raise MessageError("a cut face has an area below 0")
    if not ((faces.causes >= 0) & (faces.causes < _N_CAUSES)).all():
        raise MessageError(f"a cut face has no cause from 0 to {_N_CAUSES - 1}")


def _check_points(points: PointsAtRest) -> None:
    n = len(points.at_rest)
    if n > MAX_POINTS:
        raise MessageError(f"{n} material points; wanted {MAX_POINTS} at most")
    expect_near(points.at_rest, "a material point")


def _check_positions(points: PointsNow) -> None:
    if (points.holders < 0).any():
        raise MessageError("a material point without a tetrahedron")


def _check_cut_report(report: CutReport) -> None:
    if not (report.initial.n_tetrahedra and report.now.n_tetrahedra):
        raise MessageError("a body without a tetrahedron")


def _expect_indices(indices: IntArray, n: int, what: str) -> None:
    """Refuse indices that are not from 0 to n - 1."""
    if indices.size and not (indices.min() >= 0 and indices.max() < n):
        raise MessageError(
            f"{what} refer to points {indices.min()} to {indices.max()}; there are {n}"
        )


_MEASURES = Record(
    MeshMeasures,
    n_tetrahedra=Count,
    **dict.fromkeys(MeshMeasures._fields[1:], _Natural),
)

SNAPSHOT: Message[Snapshot] = Message(
    Record(
        Snapshot,
        positions=("nodes", 3),
        rest_positions=("nodes", 3),
        velocities=("nodes", 3),
        masses=("nodes",),
        added_masses=("nodes",),
        tetrahedra=("tetrahedra", 4),
        fixed=("nodes",),
        labels=("tetrahedra",),
    ),
    "the snapshot",
    _check_snapshot,
)
"""The reply with the state of the whole body."""

DEFORMATION: Message[Deformation] = Message(
    Record(Deformation, stress=("tetrahedra", 3, 3), strain=("tetrahedra", 3, 3)),
    "stress and strain",
    lambda deformation: expect_finite(*deformation),
)
"""The reply with stress and strain of each tetrahedron."""

SURFACE: Message[Surface] = Message(
    Record(
        Surface,
        positions=("vertices", 3),
        rest_positions=("vertices", 3),
        triangles=("triangles", 3),
        is_cut=("triangles",),
        labels=("triangles",),
    ),
    "the surface",
    _check_surface,
)
"""The reply with the boundary triangles."""

QUANTITY: Message[SurfaceQuantity] = Message(SurfaceQuantity, "the name of a quantity")
"""The request for a quantity at the vertices of the surface."""

VALUES: Message[FloatArray] = Message(
    Array(np.float64, ("vertices",), "the array"), "values on the surface", expect_finite
)
"""The reply to it."""

CHUNKS: Message[Chunks] = Message(
    Record(Chunks, boxes=("chunks", 2, 3)), "the chunks of the body", _check_chunks
)
"""The reply with boxes that hold the body, for the broad phase."""

PIECES: Message[int] = Message(Count, "the number of pieces")
"""The reply with the number of connected pieces."""

SINCE: Message[int] = Message(Count, "the number of the first cut face")
"""The request for cut faces."""

CUT_FACES: Message[CutFaces] = Message(
    Record(
        CutFaces,
        corners=("faces", 3, 3),
        areas=("faces",),
        labels=("faces", 2),
        causes=("faces",),
        times=("faces",),
    ),
    "the list of cut faces",
    _check_cut_faces,
)
"""The reply with faces that cuts have opened, in order."""

MATERIAL_POINTS: Message[PointsAtRest] = Message(
    Record(PointsAtRest, at_rest=("points", 3), holders=("points",)),
    "the material points",
    _check_points,
)
"""The request for the positions of material points."""

POINTS_NOW: Message[PointsNow] = Message(
    Record(PointsNow, positions=("points", 3), holders=("points",)),
    "the positions of material points",
    _check_positions,
)
"""The reply to it."""

CUT_REPORT: Message[CutReport] = Message(
    Record(
        CutReport,
        n_cut_nodes=Count,
        initial=_MEASURES,
        now=_MEASURES,
        **dict.fromkeys(CutReport._fields[1:5], _Natural),
    ),
    "the report about the cuts",
    _check_cut_report,
)
"""The reply with the path error of the cuts, and their effect on the mesh."""
