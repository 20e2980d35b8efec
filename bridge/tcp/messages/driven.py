"""The messages about driven frames and geoms: what they are, where, and the loads on them."""

from collections.abc import Sequence
from typing import Annotated, Any, NamedTuple

import msgspec
import numpy as np

from bridge.driven import FrameAttachment, FrameLoad, FrameTie, GeomPoses, TissueRegion
from bridge.tcp.messages.encoding import MAP_BYTES, Count, FiniteFloat, Many, Message, Record
from bridge.tcp.wire import LARGEST_REPLY, MessageError
from tissue import (
    LARGEST_COORDINATE,
    LARGEST_STRENGTH,
    FloatArray,
    Geom,
    IntArray,
    Wrench,
    are_rotations,
)

MAX_FRAMES = 1 << 12
"""Largest number of frames: a thousand times that of two hands and what fixes an organ."""

MAX_GEOMS = 1 << 12
"""Largest number of geoms: a hundred times that of two arms."""

_LONGEST_NAME = 200
"""Longest name of a geom [characters]: it is for reports and errors."""

LOAD_BYTES = MAP_BYTES // 4
"""Largest length of the load on one frame [byte]: ten numbers and their names."""

LARGEST_LOADS = LOAD_BYTES * MAX_FRAMES
"""Largest length of the loads on all frames [byte]."""

_Coordinate = Annotated[float, msgspec.Meta(ge=-LARGEST_COORDINATE, le=LARGEST_COORDINATE)]
_Strength = Annotated[float, msgspec.Meta(ge=-LARGEST_STRENGTH, le=LARGEST_STRENGTH)]
_Size = Annotated[float, msgspec.Meta(gt=0.0, le=LARGEST_COORDINATE)]
_Limit = Annotated[float, msgspec.Meta(gt=0.0)]

WRENCH = Record(Wrench, force=(3,), torque=(3,), point=(3,))
"""Force, torque and reference point, as a part of messages."""


class _Places(NamedTuple):
    """Where a frame acts on tissue: one of these."""

    region: str | None = None
    """TissueRegion as text."""
    nodes: IntArray | None = None
    """Numbers of nodes, shape (n,)."""
    points: FloatArray | None = None
    """Places in the body at rest [m], shape (n, 3)."""


class _Region(Record):
    """A region, as a map with the name of its kind."""

    def __init__(self) -> None:
        super().__init__(_Places, nodes=("nodes",), points=("points", 3))

    def plain(self, value: Any) -> Any:
        """Return the map."""
        if isinstance(value, str):
            return super().plain(_Places(region=value))
        kind = "nodes" if value.dtype.kind in "iu" else "points"
        return super().plain(_Places()._replace(**{kind: value}))

    def value(self, plain: Any, lengths: dict[str, int]) -> TissueRegion:
        """Return the region that a map names."""
        region, nodes, points = super().value(plain, lengths)
        given = [each for each in (region, nodes, points) if each is not None]
        if len(given) != 1 or not len(given[0]):
            raise MessageError(
                "a frame acts either on a region, or on nodes, or on points; give one of them"
            )
        if nodes is not None and not (nodes.min() >= 0 and nodes.max() <= LARGEST_REPLY):
            raise MessageError(f"nodes {nodes.min()} to {nodes.max()}; wanted 0 to {LARGEST_REPLY}")
        if points is not None:
            expect_near(points, "a point")
        found: TissueRegion = given[0]
        return found


class _Geoms(NamedTuple):
    """A request to touch geoms."""

    geoms: Sequence[Geom]
    """The geoms."""
    poses: FloatArray
    """Pose of each at first: origin, and the rows of its rotation, shape (n, 12)."""


def expect_near(positions: FloatArray, what: str) -> None:
    """Refuse positions that are not finite, or far away.

    Raises:
        MessageError: there is one.
    """
    if not (np.abs(positions) <= LARGEST_COORDINATE).all():  # false for NaN
        raise MessageError(f"{what} is not within {LARGEST_COORDINATE:g} m")


def pose_rows(poses: GeomPoses) -> FloatArray:
    """Return the origin of each pose and the rows of its rotation, shape (n, 12)."""
    origins, rotations = poses
    return np.concatenate((origins, rotations.reshape(-1, 9)), axis=1)


def checked_poses(rows: FloatArray, what: str) -> GeomPoses:
    """Return the poses in rows of shape (n, 12). Copies.

    Args:
        rows: The numbers of each pose.
        what: What has them: "frame" or "geom".

    Raises:
        MessageError: an origin is out of range, or a rotation is none.
    """
    origins, rotations = rows[:, :3].copy(), rows[:, 3:].reshape(-1, 3, 3).copy()
    for i, origin in enumerate(origins):
        expect_near(origin, f"the origin of {what} {i}")
    are_axes = are_rotations(rotations)
    if not are_axes.all():
        i = int(np.argmin(are_axes))
        raise MessageError(f"the axes of {what} {i} are no rotation: {rotations[i].tolist()}")
    return GeomPoses(origins, rotations)


def pack_geoms(geoms: Sequence[Geom], poses: GeomPoses) -> bytes:
    """Return the request to touch geoms; see `TissueLink.collide_with`."""
    return GEOMS.pack(_Geoms(geoms, pose_rows(poses)))


def unpack_geoms(payload: bytes) -> tuple[Sequence[Geom], GeomPoses]:
    """Return the geoms in a request, and their poses.

    Whether a shape has such sizes, and the tissue room for it, the tissue checks.

    Raises:
        MessageError: it cannot be read, a number is not finite or out of range, or a rotation is
            none.
    """
    geoms, rows = GEOMS.unpack(payload)
    return geoms, checked_poses(rows, "geom")


def _check_attachment(attachment: FrameAttachment) -> None:
    if attachment.origin is not None:
        expect_near(attachment.origin, "the origin of a frame")


def _check_tie(tie: FrameTie) -> None:
    if not len(tie.to):
        raise MessageError("fibres without an end")
    expect_near(tie.to, "the end of a fibre")


def _check_geoms(request: _Geoms) -> None:
    if len(request.geoms) != len(request.poses):
        raise MessageError(f"{len(request.poses)} poses of {len(request.geoms)} geoms")
    for geom in request.geoms:
        if not geom.name.isprintable():
            raise MessageError(f"the geom {geom.name!r} has a control character in its name")
        if geom.vertices is not None:
            expect_near(geom.vertices, f"a vertex of the geom {geom.name!r}")


ATTACHMENT: Message[FrameAttachment] = Message(
    Record(
        FrameAttachment,
        where=_Region(),
        stiffness=_Strength,
        damping=_Strength,
        breaks_at=_Limit,
        origin=(3,),
    ),
    "the request to attach a frame",
    _check_attachment,
)
"""The request to attach a frame."""

TIE: Message[FrameTie] = Message(
    Record(
        FrameTie,
        where=_Region(),
        to=("ends", 3),
        stiffness=_Strength,
        area=_Coordinate,
        toughness=_Strength,
        damping=_Strength,
        rest_length=_Coordinate,
        breaks_at=_Limit,
    ),
    "the request to tie a frame",
    _check_tie,
)
"""The request to tie a frame by fibres."""

NUMBER: Message[int] = Message(Count, "the number of a frame")
"""The request to release a frame."""

_LOAD = Record(FrameLoad, wrench=WRENCH, n_points=Count)

LOADS_ON_FRAMES = Many(_LOAD, MAX_FRAMES)
"""Loads on frames, as a part of messages. Physical quantities are passed on unchanged, NaN
included."""

LOAD: Message[FrameLoad] = Message(_LOAD, "the load on a frame")
"""The reply with the load on one frame."""

LOADS: Message[Sequence[FrameLoad]] = Message(LOADS_ON_FRAMES, "the loads on frames")
"""The reply with the loads on all frames."""

GEOMS: Message[_Geoms] = Message(
    Record(
        _Geoms,
        geoms=Many(
            Record(
                Geom,
                name=Annotated[str, msgspec.Meta(max_length=_LONGEST_NAME)],
                size=Annotated[tuple[_Size, ...], msgspec.Meta(max_length=3)],
                friction=FiniteFloat,
                vertices=("vertices", 3),
            ),
            MAX_GEOMS,
        ),
        poses=("geoms", 12),
    ),
    "the request to touch geoms",
    _check_geoms,
)
"""The request to touch geoms."""
