"""The reply to a step: its result."""

import struct
from collections.abc import Sequence

import numpy as np

from bridge.driven import NO_GEOM_LOADS, FrameLoad, GeomLoads
from bridge.tcp.messages.counts import check_counts
from bridge.tcp.messages.geoms import (
    GEOM_LOAD_BYTES,
    MAX_GEOMS,
    pack_geom_loads,
    unpack_geom_loads,
)
from bridge.tcp.messages.led_frames import LOAD_BYTES, MAX_FRAMES, pack_loads, unpack_loads
from bridge.tcp.wire import MessageError
from tissue import (
    BodyContacts,
    Energies,
    FloatArray,
    RigidContacts,
    StageTimes,
    StepResult,
    Wrench,
)

MAX_CONTACTS = 1 << 16
"""Largest number of contacts of blade and geoms: a thousand times that of a scalpel in an organ."""

_HEAD = struct.Struct("<9q10d")
_N_FIXED = 9 + 9 + 36 + 3 + 6 + 3
"""Number of floats in the arrays of fixed length."""
_N_PER_CONTACT = 3 + 3 + 1 + 3 + 1 + 1
"""Number of floats of a contact."""
_N_ENERGIES = len(Energies._fields)
LARGEST_RESULT = (
    _HEAD.size
    + 8 * (_N_FIXED + _N_PER_CONTACT * MAX_CONTACTS + _N_ENERGIES)
    + LOAD_BYTES * MAX_FRAMES
    + GEOM_LOAD_BYTES * MAX_GEOMS
)
"""Largest reply to a step [byte]."""


def pack_result(
    result: StepResult,
    loads: Sequence[FrameLoad] = (),
    geom_loads: GeomLoads = NO_GEOM_LOADS,
) -> bytes:
    """Return a reply: the integers of a result, its single floats, its arrays.

    The contacts, of any number, the energies, which are optional, and the loads on frames and on
    the geoms that the client leads come last.
    """
    touch, contacts, energies = result.body_contacts, result.contacts, result.energies
    head = _HEAD.pack(
        result.n_tetrahedra,
        result.n_nodes,
        result.n_active,
        result.active_point_tetrahedron,
        result.n_substeps,
        touch.n_contacts,
        len(contacts.point),
        energies is not None,
        len(loads),
        result.anchored_length,
        result.cut_area,
        result.finished_area,
        result.work_of_blade,
        result.work_of_cutting,
        touch.penetration,
        touch.force,
        *result.stage_times,
    )
    # One call for all arrays: each one by itself takes as long as the rest of the message.
    arrays = np.concatenate(
        (
            *result.wrench,
            *result.wrench_t1,
            result.stiffness.ravel(),
            result.force_on_tissue,
            result.bounds.ravel(),
            touch.force_of_floor,
            contacts.point.ravel(),
            contacts.normal.ravel(),
            contacts.normal_force,
            contacts.friction.ravel(),
            contacts.cut_area,
            contacts.geom,
            energies or (),
        ),
        dtype="<f8",
    )
    of_geoms = pack_geom_loads(geom_loads) if len(geom_loads.forces) else b""
    return head + arrays.tobytes() + pack_loads(loads) + of_geoms


def unpack_result(
    payload: bytes, n_geoms: int = 0
) -> tuple[StepResult, list[FrameLoad], GeomLoads]:
    """Return the result in a reply, and the loads on frames and on `n_geoms` geoms.

    Physical quantities are passed on unchanged, NaN included: the coupling handles a tissue that
    has diverged, for both links.

    Raises:
        MessageError: the length is wrong, or a count is out of range.
    """
    if len(payload) < _HEAD.size:
        raise MessageError(f"a step reply of {len(payload)} bytes; wanted {_HEAD.size} at least")
    head = _HEAD.unpack_from(payload)
    n_tetrahedra, n_nodes, n_active, tip_tetrahedron, n_substeps, n_touching = head[:6]
    n, audited, n_frames = head[6:9]
    check_counts(n_nodes, n_tetrahedra)
    if not (0 <= n_active <= n_tetrahedra and -1 <= tip_tetrahedron < n_tetrahedra):
        raise MessageError(
            f"{n_active} active tetrahedra and tip in number {tip_tetrahedron}, of {n_tetrahedra}"
        )
    if n_substeps < 0 or n_touching < 0:
        raise MessageError(f"{n_substeps} substeps and {n_touching} contacts; wanted 0 or more")
    if not (0 <= n <= MAX_CONTACTS and audited in (0, 1) and 0 <= n_frames <= MAX_FRAMES):
        raise MessageError(
            f"{n} contacts of blade and geoms (at most {MAX_CONTACTS}), audit flag {audited} "
            f"(0 or 1), {n_frames} frames (at most {MAX_FRAMES})"
        )
    n_floats = _N_FIXED + _N_PER_CONTACT * n + _N_ENERGIES * audited
    of_frames = _HEAD.size + 8 * n_floats
    of_geoms = of_frames + LOAD_BYTES * n_frames
    wanted = of_geoms + GEOM_LOAD_BYTES * n_geoms
    if len(payload) != wanted:
        raise MessageError(f"a step reply of {len(payload)} bytes; wanted {wanted}")
    loads = unpack_loads(payload[of_frames:of_geoms], n_frames)
    geom_loads = unpack_geom_loads(payload, of_geoms, n_geoms)
    # a copy
    floats = np.frombuffer(payload, "<f8", n_floats, _HEAD.size).astype(np.float64)
    result = StepResult(
        wrench=Wrench(floats[0:3], floats[3:6], floats[6:9]),
        wrench_t1=Wrench(floats[9:12], floats[12:15], floats[15:18]),
        stiffness=floats[18:54].reshape(6, 6),
        contacts=_contacts(floats[_N_FIXED : _N_FIXED + _N_PER_CONTACT * n], n, n_geoms),
        force_on_tissue=floats[54:57],
        bounds=floats[57:63].reshape(2, 3),
        n_tetrahedra=n_tetrahedra,
        n_nodes=n_nodes,
        n_active=n_active,
        active_point_tetrahedron=tip_tetrahedron,
        anchored_length=head[9],
        cut_area=head[10],
        finished_area=head[11],
        work_of_blade=head[12],
        work_of_cutting=head[13],
        n_substeps=n_substeps,
        body_contacts=BodyContacts(n_touching, head[14], head[15], floats[63:66]),
        stage_times=StageTimes(*head[16:]),
        energies=Energies(*floats[-_N_ENERGIES:].tolist()) if audited else None,
    )
    return result, loads, geom_loads


def _contacts(floats: FloatArray, n: int, n_geoms: int) -> RigidContacts:
    """Return the contacts whose floats follow one another by quantity.

    Raises:
        MessageError: the number of a geom is none.
    """
    geom = floats[11 * n :]
    end = n_geoms or MAX_CONTACTS  # of geoms that the client does not lead it knows nothing
    if not ((geom >= -1) & (geom < end) & (geom == np.floor(geom))).all():
        raise MessageError(
            f"the geoms of contacts are {geom.tolist()}; wanted whole numbers from -1 to {end - 1}"
        )
    return RigidContacts(
        point=floats[: 3 * n].reshape(n, 3),
        normal=floats[3 * n : 6 * n].reshape(n, 3),
        normal_force=floats[6 * n : 7 * n],
        friction=floats[7 * n : 10 * n].reshape(n, 3),
        cut_area=floats[10 * n : 11 * n],
        geom=geom.astype(np.int64),
    )
