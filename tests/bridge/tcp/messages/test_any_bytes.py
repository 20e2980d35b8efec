"""Every decoder, given random bytes and messages with changed bytes."""

import functools

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from bridge.description import TissueDescription
from bridge.device.messages import (
    DEVICE_DESCRIPTION,
    SERVO,
    STATE,
    DeviceDescription,
    ServoRequest,
    unpack_servo,
)
from bridge.driven import (
    FrameAttachment,
    FrameLoad,
    FramePose,
    FrameTie,
    GeomLoads,
    GeomPoses,
)
from bridge.tcp.messages.body import (
    CHUNKS,
    CUT_FACES,
    CUT_REPORT,
    DEFORMATION,
    MATERIAL_POINTS,
    PIECES,
    POINTS_NOW,
    QUANTITY,
    SINCE,
    SNAPSHOT,
    SURFACE,
    VALUES,
    PointsAtRest,
    PointsNow,
)
from bridge.tcp.messages.driven import (
    ATTACHMENT,
    LOADS,
    NUMBER,
    TIE,
    pack_geoms,
    unpack_geoms,
)
from bridge.tcp.messages.step import RESULT, StepReply, pack_step, unpack_result, unpack_step
from bridge.tcp.messages.text import DESCRIPTION, pack_error, unpack_error
from bridge.tcp.wire import MessageError
from tests.bridge.device.served_blade import POSE
from tests.bridge.device.served_blade import STATE as BLADE
from tests.bridge.tcp.serve_block import block_tissue
from tissue import BladeSegment, BladeSweep, Geom, Wrench

LOADS_ON_TWO = tuple(FrameLoad(Wrench(*np.arange(9.0).reshape(3, 3)), n) for n in (7, 0))
WEDGE = np.array([[0.0, 0, 0], [0.01, 0, 0], [0, 0.01, 0], [0, 0, 0.01]])
GEOMS = [Geom("ball", "sphere", (0.01,), 0.3), Geom("wedge", "mesh", (), 0.0, WEDGE)]
PLACES = GeomPoses(np.array([[0.0, 0, 1], [0, 0, 2]]), np.tile(np.eye(3), (2, 1, 1)))
GEOM_LOADS = GeomLoads(*np.arange(12.0).reshape(2, 2, 3))
FRAMES = [FramePose(np.zeros(3), np.eye(3))]
N_MUTATIONS = 2000
"""Number of changed copies of each message."""


POINTS_OF_TWO = np.array([(0.01, 0.0, 0.02), (0.02, 0.01, 0.0)]), np.array([3, 0])
"""Two points, and tetrahedra."""


def cut_faces():
    """Return the faces of a cut through a block."""
    tissue = block_tissue()
    tissue.incise([[(0.009, y, z) for z in (-0.1, 0.1)] for y in (-0.1, 0.1)], (0.0, 1.0, 0.0))
    return tissue.cut_faces()


@functools.cache
def real_messages():
    """Return a message of each kind, from a real tissue, and its decoder."""
    tissue = block_tissue()
    edge = BladeSegment(np.array([0.01, 0, 0]), np.array([0.01, 0, 0.03]), np.array([0.0, 1, 0]))
    result = tissue.step(BladeSweep(edge, edge), 1e-3)
    described = TissueDescription("block", tissue.material, tissue.bounds, 72, 36)
    attachment = FrameAttachment(np.array([[0.0, 0.01, 0.02]]), 100.0, 1.0, 2.0, np.zeros(3))
    tie = FrameTie(np.array([3, 4]), np.array([[0.0, 0.1, 0.2]]), 100.0, 1e-6, 50.0, 1.0, 0.03)
    described_run = DeviceDescription("organ", 0.04, 0.2, 2.0)
    return {
        "step": (
            pack_step(BladeSweep(edge, edge), 1e-3, FRAMES, PLACES),
            lambda payload: unpack_step(payload, 1, 2),
        ),
        "geoms": (pack_geoms(GEOMS, PLACES), unpack_geoms),
        "attachment": (ATTACHMENT.pack(attachment), ATTACHMENT.unpack),
        "tie": (TIE.pack(tie), TIE.unpack),
        "loads": (LOADS.pack(LOADS_ON_TWO), LOADS.unpack),
        "number": (NUMBER.pack(1), NUMBER.unpack),
        "result": (
            RESULT.pack(StepReply(result, LOADS_ON_TWO, GEOM_LOADS, 3)),
            lambda payload: unpack_result(payload, 2),
        ),
        "snapshot": (SNAPSHOT.pack(tissue.snapshot()), SNAPSHOT.unpack),
        "deformation": (DEFORMATION.pack(tissue.deformation()), DEFORMATION.unpack),
        "since": (SINCE.pack(2), SINCE.unpack),
        "points": (MATERIAL_POINTS.pack(PointsAtRest(*POINTS_OF_TWO)), MATERIAL_POINTS.unpack),
        "positions": (POINTS_NOW.pack(PointsNow(*POINTS_OF_TWO)), POINTS_NOW.unpack),
        "cut faces": (CUT_FACES.pack(cut_faces()), CUT_FACES.unpack),
        "chunks": (CHUNKS.pack(tissue.chunks()), CHUNKS.unpack),
        "surface": (SURFACE.pack(tissue.surface()), SURFACE.unpack),
        "quantity": (QUANTITY.pack("strain"), QUANTITY.unpack),
        "values": (VALUES.pack(np.arange(9.0)), VALUES.unpack),
        "pieces": (PIECES.pack(1), PIECES.unpack),
        "cut report": (CUT_REPORT.pack(tissue.cut_report()), CUT_REPORT.unpack),
        "description": (DESCRIPTION.pack(described), DESCRIPTION.unpack),
        "error": (pack_error("no blade"), unpack_error),
        "servo": (SERVO.pack(ServoRequest(2.0, 1e-3, POSE, True)), unpack_servo),
        "state": (STATE.pack(BLADE), STATE.unpack),
        "run": (DEVICE_DESCRIPTION.pack(described_run), DEVICE_DESCRIPTION.unpack),
    }


def is_finite(*values):
    return all(np.isfinite(value).all() for value in values)


IS_VALID = {
    "step": lambda value: (
        0.0 < value[1] <= 1.0
        and is_finite(
            *(np.array(each) for each in value[0] or ()),
            *(pose.origin for pose in value[2]),
            *value[3],
        )
    ),
    "snapshot": lambda value: (
        0 <= value.tetrahedra.min() <= value.tetrahedra.max() < len(value.positions)
    ),
    "deformation": lambda value: is_finite(*value) and value.stress.shape == value.strain.shape,
    "surface": lambda value: (
        0 <= value.triangles.min() <= value.triangles.max() < len(value.positions)
    ),
    "result": lambda value: (
        -1 <= value.result.active_point_tetrahedron < value.result.n_tetrahedra
        and all(load.n_points >= 0 for load in value.loads)
    ),
    "geoms": lambda value: is_finite(
        *value[1],
        *(each.vertices for each in value[0] if each.vertices is not None),
        *([*each.size, each.friction] for each in value[0]),
    ),
    "attachment": lambda value: is_finite(value.stiffness, value.damping) and len(value.where),
    "tie": lambda value: (
        is_finite(value.stiffness, value.area, value.toughness, value.damping)
        and np.abs(value.to).max() <= 1e3
        and len(value.where)
    ),
    "loads": lambda value: all(load.n_points >= 0 for load in value),
    "since": lambda value: value >= 0,
    "points": lambda value: is_finite(value.at_rest) and len(value.at_rest) == len(value.holders),
    "positions": lambda value: (
        len(value.positions) == len(value.holders) and value.holders.min(initial=0) >= 0
    ),
    "cut faces": lambda value: (
        is_finite(value.corners, value.areas, value.times)
        and len(value.corners) == len(value.labels) == len(value.areas)
        and value.areas.min(initial=0.0) >= 0.0
        and set(value.causes.tolist()) <= {0, 1, 2}
    ),
    "chunks": lambda value: is_finite(value.boxes) and 0.0 <= value.fastest < np.inf,
    "description": lambda value: is_finite(value.bounds) and value.material.density > 0.0,
    "error": str.isprintable,
    "quantity": lambda value: value in ("displacement", "strain", "stress"),
    "values": is_finite,
    "pieces": lambda value: value >= 0,
    "number": lambda value: value >= 0,
    "cut report": lambda value: value.now.altitude >= 0.0,
    "servo": lambda value: is_finite(value.stamp, value.period, *value.servo_cp),
    "state": lambda value: is_finite(value.time, *value.measured_cp, *value.measured_cf),
    "run": lambda value: value.scene.replace("_", "").replace("-", "").isalnum(),
}
"""Whether the values of a decoded message are in the ranges that its users rely on."""


def test_each_message_is_tried():
    assert real_messages().keys() == IS_VALID.keys()


@given(st.sampled_from(sorted(IS_VALID)), st.binary(max_size=400))
@example("error", b"\xa1\x80")  # not UTF-8
def test_random_bytes_raise_nothing_but_a_message_error(what, payload):
    _, unpack = real_messages()[what]
    try:
        value = unpack(payload)
    except MessageError as error:
        assert str(error)
    else:
        assert value is not None


@pytest.mark.parametrize("what", sorted(IS_VALID))
def test_a_changed_message_is_refused_or_decodes_to_valid_values(what):
    """Half of all changed numbers are still numbers: what is accepted must be valid."""
    packed, unpack = real_messages()[what]
    random = np.random.default_rng(0)
    n_refused = 0
    for _ in range(N_MUTATIONS):
        payload = bytearray(packed)
        for at in random.integers(0, len(payload), random.integers(1, 5)):
            payload[at] = random.integers(0, 256)
        length = len(payload) if random.random() < 0.8 else random.integers(0, len(payload))
        try:
            value = unpack(bytes(payload[:length]))
        except MessageError:
            n_refused += 1
        else:
            assert IS_VALID[what](value)
    assert n_refused > 0
