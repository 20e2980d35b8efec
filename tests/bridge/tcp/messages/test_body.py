"""Replies about the whole body: within their bounds of length, and refused where impossible."""

import numpy as np
import pytest

from bridge.tcp.messages.body import (
    CHUNKS,
    CUT_REPORT,
    PIECES,
    QUANTITY,
    SNAPSHOT,
    SURFACE,
    VALUES,
    snapshot_bytes,
    surface_bytes,
    values_bytes,
)
from bridge.tcp.messages.encoding import MAP_BYTES
from bridge.tcp.wire import MessageError
from tests.bridge.bits import bits
from tissue import Chunks, CutReport, MeshMeasures, Snapshot, Surface

TETRAHEDRON = Snapshot(
    positions=np.array([[0.0, 0.0, -0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]),
    rest_positions=np.full((4, 3), 0.1),
    velocities=np.full((4, 3), -0.2),
    masses=np.array([1.0, 2.0, 3.0, 4.0]),
    added_masses=np.array([0.1, 0.0, 0.0, 0.0]),
    tetrahedra=np.array([[0, 1, 2, 3]]),
    fixed=np.array([True, False, False, True]),
    labels=np.array([2]),
)
SKIN = Surface(
    positions=TETRAHEDRON.positions,
    rest_positions=TETRAHEDRON.rest_positions,
    triangles=np.array([[0, 2, 1], [0, 1, 3]]),
    is_cut=np.array([False, True]),
)
BOXES = Chunks(np.array([[[0.0, -0.0, 0.1], [1.0, 2.0, 3.0]], [[-1.0, 0, 0], [0, 0, 0]]]), 0.25)
REPORT = CutReport(
    7,
    1e-5,
    3e-5,
    3e-3,
    4e-4,
    MeshMeasures(576, 3e-3, 900.0, 2e-3, 0.0, 0.0, 0.0),
    MeshMeasures(800, 5e-4, 3e3, np.inf, 5e-4, 1e-3, 0.25),
)


@pytest.mark.parametrize(
    ("message", "value", "limit"),
    [
        (SNAPSHOT, TETRAHEDRON, snapshot_bytes(4, 1)),
        (SURFACE, SKIN, surface_bytes(1)),
        (SURFACE, SKIN._replace(labels=np.array([3, 0])), surface_bytes(1)),
        (CHUNKS, BOXES, MAP_BYTES),
        (CHUNKS, Chunks(BOXES.boxes[:0], 0.25), MAP_BYTES),
        (CUT_REPORT, REPORT, MAP_BYTES),
        (PIECES, 2, MAP_BYTES),
        (QUANTITY, "strain", MAP_BYTES),
        (VALUES, np.array([0.0, -0.0, 1e-300, 5.0]), values_bytes(4)),
    ],
)
def test_a_reply_arrives_bit_for_bit_and_within_its_bound(message, value, limit):
    payload = message.pack(value)
    assert bits(message.unpack(payload)) == bits(value)
    assert len(payload) <= limit


def with_nan(array):
    broken = array.copy()
    broken.flat[1] = np.nan
    return broken


@pytest.mark.parametrize(
    ("message", "value", "why"),
    [
        *(
            (SNAPSHOT, TETRAHEDRON._replace(tetrahedra=np.array([[0, 1, 2, i]])), "refer to points")
            for i in (4, -1, 2**62)
        ),
        (SURFACE, SKIN._replace(triangles=np.array([[0, 1, 4], [0, 1, 3]])), "refer to points"),
        *(
            (SNAPSHOT, TETRAHEDRON._replace(**{name: with_nan(getattr(TETRAHEDRON, name))}), "fin")
            for name in ("positions", "rest_positions", "velocities", "masses", "added_masses")
        ),
        (SURFACE, SKIN._replace(positions=with_nan(SKIN.positions)), "not finite"),
        (VALUES, np.array([1.0, np.inf]), "not finite"),
        (CHUNKS, Chunks(BOXES.boxes[:, ::-1], 0.0), "box of a chunk is not finite or inverted"),
        (CHUNKS, Chunks(BOXES.boxes * np.nan, 0.0), "box of a chunk is not finite or inverted"),
        *(
            (CHUNKS, BOXES._replace(fastest=speed), "the fastest node moves at")
            for speed in (-1.0, np.nan, np.inf)
        ),
        (CUT_REPORT, REPORT._replace(n_cut_nodes=-1), "n_cut_nodes"),
        (CUT_REPORT, REPORT._replace(path_error_mean=np.nan), "path_error_mean"),
        (CUT_REPORT, REPORT._replace(guard=-1e-9), "guard"),
        (
            CUT_REPORT,
            REPORT._replace(now=REPORT.now._replace(n_tetrahedra=0)),
            "without a tet",
        ),
        (QUANTITY, "heat", "Invalid enum value 'heat'"),
    ],
)
def test_an_impossible_reply_is_refused_by_name(message, value, why):
    with pytest.raises(MessageError, match=why):
        message.unpack(message.pack(value))
