"""The request of a step, with the motions of blade, frames and geoms, and the reply to it."""

import math
from collections.abc import Sequence
from typing import Annotated, NamedTuple

import msgspec
import numpy as np

from bridge.driven import NO_GEOMS, FrameLoad, FramePose, GeomLoads, GeomPoses
from bridge.tcp.messages.driven import (
    LARGEST_LOADS,
    LOADS_ON_FRAMES,
    MAX_GEOMS,
    WRENCH,
    checked_poses,
    pose_rows,
)
from bridge.tcp.messages.encoding import MAP_BYTES, Count, Message, Record
from bridge.tcp.wire import MessageError
from tissue import (
    LARGEST_COORDINATE,
    AddedMass,
    BladeSegment,
    BladeSweep,
    BodyContacts,
    Energies,
    FloatArray,
    RigidContacts,
    StageTimes,
    StepResult,
)

MAX_CONTACTS = 1 << 16
"""Largest number of contacts of blade and geoms: a thousand times that of a scalpel in an organ."""

_CONTACT_BYTES = 8 * (3 + 3 + 1 + 3 + 1 + 1)

LARGEST_RESULT = 4 * MAP_BYTES + _CONTACT_BYTES * MAX_CONTACTS + LARGEST_LOADS + 48 * MAX_GEOMS
"""Largest reply to a step [byte]."""

_SHORTEST_STEP, _LONGEST_STEP = 1e-9, 1.0
"""Shortest and longest step [s]. A frame is a millisecond. A step of hours would take days, and in
one of 1e-310 s speeds are infinite."""

_UNIT_TOLERANCE = 1e-6
"""Largest difference of the length of `forward` from 1: the accuracy of single precision."""


class _Step(NamedTuple):
    """A request to advance."""

    dt: float
    """Length of the step [s]."""
    blade: FloatArray | None = None
    """Tip, heel and forward at t0, then at t1, shape (2, 3, 3); None: no blade is near."""
    frames: FloatArray | None = None
    """Pose of each driven frame at t1: origin, and the rows of its rotation, shape (n, 12)."""
    geoms: FloatArray | None = None
    """Pose of each driven geom, in the same form."""


class StepReply(NamedTuple):
    """Answer of the tissue to a step."""

    result: StepResult
    """Result of the step. Physical quantities are passed on unchanged, NaN included."""
    loads: Sequence[FrameLoad]
    """Loads on all frames."""
    geom_loads: GeomLoads
    """Loads on the driven geoms."""
    n_cut_faces: int
    """Number of faces that cuts have opened so far."""


def pack_step(
    sweep: BladeSweep | None,
    dt: float,
    poses: Sequence[FramePose] = (),
    geoms: GeomPoses = NO_GEOMS,
) -> bytes:
    """Return the request of a step; see `TissueLink.step`."""
    frames = None
    if poses:
        origins, rotations = zip(*poses, strict=True)
        frames = pose_rows(GeomPoses(np.array(origins), np.array(rotations)))
    return STEP.pack(
        _Step(
            dt,
            None if sweep is None else np.array([[*sweep.t0], [*sweep.t1]]),
            frames,
            pose_rows(geoms) if len(geoms.origins) else None,
        )
    )


def unpack_step(
    payload: bytes, n_driven: int = 0, n_geoms: int = 0
) -> tuple[BladeSweep | None, float, Sequence[FramePose], GeomPoses]:
    """Return the sweep, `dt`, and the poses of `n_driven` frames and `n_geoms` geoms in a request.

    Raises:
        MessageError: a number is missing, not finite, or out of range.
    """
    dt, blade, *rows = STEP.unpack(payload)
    if not _SHORTEST_STEP <= dt <= _LONGEST_STEP:
        raise MessageError(f"a step of {dt} s; wanted {_SHORTEST_STEP:g} to {_LONGEST_STEP:g}")
    sweep = None
    if blade is not None:
        _check_blade(blade)
        sweep = BladeSweep(BladeSegment(*blade[0]), BladeSegment(*blade[1]))
    of_frames, of_geoms = (np.zeros((0, 12)) if each is None else each for each in rows)
    if (len(of_frames), len(of_geoms)) != (n_driven, n_geoms):
        raise MessageError(
            f"poses of {len(of_frames)} frames and {len(of_geoms)} geoms; {n_driven} frames and "
            f"{n_geoms} geoms are driven"
        )
    frames = [FramePose(*pose) for pose in zip(*checked_poses(of_frames, "frame"), strict=True)]
    return sweep, dt, frames, checked_poses(of_geoms, "geom") if n_geoms else NO_GEOMS


def unpack_result(payload: bytes, n_geoms: int = 0) -> StepReply:
    """Return the reply to a step.

    Raises:
        MessageError: it cannot be read, a count is out of range, or there are loads on another
            number of geoms than `n_geoms`.
    """
    reply = RESULT.unpack(payload)
    n, geom = len(reply.geom_loads.forces), reply.result.contacts.geom
    if n != n_geoms:
        raise MessageError(f"a step reply with the loads on {n} geoms; {n_geoms} are driven")
    end = n_geoms or MAX_CONTACTS  # of geoms that another client drives it knows nothing
    if not ((geom >= -1) & (geom < end)).all():
        raise MessageError(f"the geoms of contacts are {geom.tolist()}; wanted -1 to {end - 1}")
    return reply


def _check_blade(blade: FloatArray) -> None:
    # The comparisons are false for NaN.
    if not (np.abs(blade[:, :2]) <= LARGEST_COORDINATE).all():
        raise MessageError(f"the blade is not within {LARGEST_COORDINATE:g} m: {blade.tolist()}")
    for forward in blade[:, 2].tolist():
        if not abs(math.hypot(*forward) - 1.0) <= _UNIT_TOLERANCE:
            raise MessageError(f"forward is not a unit vector: {forward}")


def _check_reply(reply: StepReply) -> None:
    result = reply.result
    n = result.n_tetrahedra
    if not (result.n_active <= n and result.active_point_tetrahedron < n):
        raise MessageError(
            f"{result.n_active} active tetrahedra and tip in number "
            f"{result.active_point_tetrahedron}, of {n}"
        )
    if len(result.contacts.geom) > MAX_CONTACTS:
        raise MessageError(f"{len(result.contacts.geom)} contacts; at most {MAX_CONTACTS}")


STEP: Message[_Step] = Message(
    Record(_Step, blade=(2, 3, 3), frames=("frames", 12), geoms=("geoms", 12)),
    "the request of a step",
)
"""The request of a step."""

RESULT: Message[StepReply] = Message(
    Record(
        StepReply,
        result=Record(
            StepResult,
            wrench=WRENCH,
            wrench_t1=WRENCH,
            stiffness=(6, 6),
            contacts=Record(
                RigidContacts,
                point=("contacts", 3),
                normal=("contacts", 3),
                normal_force=("contacts",),
                friction=("contacts", 3),
                cut_area=("contacts",),
                geom=("contacts",),
            ),
            force_on_tissue=(3,),
            bounds=(2, 3),
            n_tetrahedra=Count,
            n_nodes=Count,
            n_active=Count,
            active_point_tetrahedron=Annotated[int, msgspec.Meta(ge=-1)],
            n_substeps=Count,
            body_contacts=Record(BodyContacts, n_contacts=Count, force_of_floor=(3,)),
            stage_times=Record(StageTimes),
            added_mass=Record(
                AddedMass,
                momentum=(3,),
                angular_momentum=(3,),
                impulse=(3,),
                angular_impulse=(3,),
            ),
            energies=Record(Energies),
            cutting_of_labels=("labels",),
            force_of_labels=("labels",),
        ),
        loads=LOADS_ON_FRAMES,
        geom_loads=Record(GeomLoads, forces=("geoms", 3), torques=("geoms", 3)),
        n_cut_faces=Count,
    ),
    "the reply to a step",
    _check_reply,
)
"""The reply to a step."""
