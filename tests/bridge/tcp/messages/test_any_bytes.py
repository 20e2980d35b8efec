"""Every decoder, given random bytes and messages with changed bytes."""

import functools

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from bridge import GeomLoads, GeomPoses
from bridge.driven import FrameAttachment, FrameLoad, FramePose, FrameTie
from bridge.link import TissueDescription
from bridge.tcp.messages.body import (
    pack_pieces,
    pack_snapshot,
    pack_surface,
    unpack_pieces,
    unpack_snapshot,
    unpack_surface,
)
from bridge.tcp.messages.chunks import pack_chunks, unpack_chunks
from bridge.tcp.messages.cut_report import pack_cut_report, unpack_cut_report
from bridge.tcp.messages.geoms import pack_geoms, unpack_geoms
from bridge.tcp.messages.led_frames import (
    pack_attachment,
    pack_loads,
    pack_number,
    pack_tie,
    unpack_attachment,
    unpack_loads,
    unpack_number,
    unpack_tie,
)
from bridge.tcp.messages.result import pack_result, unpack_result
from bridge.tcp.messages.step import pack_step, unpack_step
from bridge.tcp.messages.text import pack_description, pack_error, unpack_description, unpack_error
from bridge.tcp.messages.values import (
    pack_quantity,
    pack_values,
    unpack_quantity,
    unpack_values,
)
from bridge.tcp.wire import MessageError
from tests.bridge.tcp.serve_block import block_tissue
from tissue import BladeSegment, BladeSweep, Geom, Wrench

LOADS = [FrameLoad(Wrench(*np.arange(9.0).reshape(3, 3)), n) for n in (7, 0)]
WEDGE = np.array([[0.0, 0, 0], [0.01, 0, 0], [0, 0.01, 0], [0, 0, 0.01]])
GEOMS = [Geom("ball", "sphere", (0.01,), 0.3), Geom("wedge", "mesh", (), 0.0, WEDGE)]
PLACES = GeomPoses(np.array([[0.0, 0, 1], [0, 0, 2]]), np.tile(np.eye(3), (2, 1, 1)))
GEOM_LOADS = GeomLoads(*np.arange(12.0).reshape(2, 2, 3))
N_MUTATIONS = 2000
"""Number of changed copies of each message."""


@functools.cache
def real_messages():
    """Return a message of each kind, from a real tissue, and its decoder."""
    tissue = block_tissue()
    edge = BladeSegment(np.array([0.01, 0, 0]), np.array([0.01, 0, 0.03]), np.array([0.0, 1, 0]))
    result = tissue.step(BladeSweep(edge, edge), 1e-3)
    described = TissueDescription("block", tissue.material, tissue.bounds, 72, 36)
    return {
        "step": (pack_step(BladeSweep(edge, edge), 1e-3), unpack_step),
        "step with a frame": (
            pack_step(None, 1e-3, [FramePose(np.zeros(3), np.eye(3))]),
            lambda payload: unpack_step(payload, 1),
        ),
        "step with geoms": (
            pack_step(None, 1e-3, (), PLACES),
            lambda payload: unpack_step(payload, 0, 2),
        ),
        "geoms": (pack_geoms(GEOMS, PLACES), unpack_geoms),
        "hold": (
            pack_attachment(FrameAttachment([[0.0, 0.01, 0.02]], 100.0, 1.0, 2.0, (0, 0, 0.1))),
            unpack_attachment,
        ),
        "tie": (
            pack_tie(FrameTie([3, 4], [[0.0, 0.1, 0.2]], 100.0, 1e-6, 50.0, 1.0, 0.03, 2.0)),
            unpack_tie,
        ),
        "loads": (pack_loads(LOADS), lambda payload: unpack_loads(payload, 2)),
        "number": (pack_number(1), lambda payload: unpack_number(payload, 2)),
        "result": (
            pack_result(result, LOADS, GEOM_LOADS),
            lambda payload: unpack_result(payload, 2),
        ),
        "snapshot": (pack_snapshot(tissue.snapshot()), unpack_snapshot),
        "chunks": (pack_chunks(tissue.chunks()), unpack_chunks),
        "surface": (pack_surface(tissue.surface()), unpack_surface),
        "quantity": (pack_quantity("strain"), unpack_quantity),
        "values": (pack_values(np.arange(9.0)), unpack_values),
        "pieces": (pack_pieces(1), unpack_pieces),
        "cut report": (pack_cut_report(tissue.cut_report()), unpack_cut_report),
        "description": (pack_description(described), unpack_description),
        "error": (pack_error("no blade"), unpack_error),
    }


NAMES = (
    *("chunks", "cut report", "description", "error", "geoms", "hold", "loads", "number"),
    *("pieces", "quantity", "result", "snapshot", "step", "step with a frame"),
    *("step with geoms", "surface", "tie", "values"),
)


def test_each_message_is_tried():
    assert sorted(real_messages()) == list(NAMES)


@given(st.sampled_from(NAMES), st.binary(max_size=400))
@example("error", b"\xa1\x80")  # not UTF-8
def test_random_bytes_raise_nothing_but_a_message_error(what, payload):
    _, unpack = real_messages()[what]
    try:
        value = unpack(payload)
    except MessageError as error:
        assert str(error)
    else:
        assert value is not None


@pytest.mark.parametrize("what", NAMES)
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
            assert is_valid(what, value)
    assert n_refused > 0


def is_valid(what, value):
    """Return whether the values of a decoded message are in the ranges that its users rely on."""
    if what in ("step", "step with a frame", "step with geoms"):
        sweep, dt, poses, geoms = value
        if not all(np.isfinite(pose.origin).all() for pose in poses):
            return False
        if not all(np.isfinite(each).all() for each in geoms):
            return False
        return 0.0 < dt <= 1.0 and (sweep is None or np.isfinite(np.array(sweep)).all())
    if what == "snapshot":
        return value.tetrahedra.min() >= 0 and value.tetrahedra.max() < len(value.positions)
    if what == "surface":
        return value.triangles.min() >= 0 and value.triangles.max() < len(value.positions)
    if what == "result":
        value, loads, _ = value
        return (
            all(load.n_points >= 0 for load in loads)
            and -1 <= value.active_point_tetrahedron < value.n_tetrahedra
        )
    if what == "geoms":
        geoms, poses = value
        given = [each.vertices for each in geoms if each.vertices is not None]
        numbers = [*poses, *given, *([*each.size, each.friction] for each in geoms)]
        return all(np.isfinite(each).all() for each in numbers)
    if what == "hold":
        return np.isfinite([value.stiffness, value.damping]).all() and bool(value.where)
    if what == "tie":
        numbers = (value.stiffness, value.area, value.toughness, value.damping)
        return np.isfinite(numbers).all() and np.abs(value.to).max() <= 1e3 and bool(value.where)
    if what == "loads":
        return all(load.n_points >= 0 for load in value)
    if what == "chunks":
        return np.isfinite(value.boxes).all() and 0.0 <= value.fastest < np.inf
    if what == "description":
        return np.isfinite(value.bounds).all() and value.material.density > 0.0
    if what == "error":
        return value.isprintable()
    if what == "quantity":
        return value in ("displacement", "strain", "stress")
    if what == "values":
        return np.isfinite(value).all()
    return what == "cut report" or value >= 0
