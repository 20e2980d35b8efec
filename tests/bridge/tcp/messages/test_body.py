import struct

import numpy as np
import pytest

from bridge.tcp.messages.body import (
    PIECES_BYTES,
    pack_pieces,
    pack_snapshot,
    pack_surface,
    snapshot_bytes,
    surface_bytes,
    unpack_pieces,
    unpack_snapshot,
    unpack_surface,
)
from bridge.tcp.wire import MessageError
from tests.bridge.bits import bits
from tissue import Snapshot, Surface

TETRAHEDRON = Snapshot(
    positions=np.array([[0.0, 0.0, -0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]),
    rest_positions=np.full((4, 3), 0.1),
    velocities=np.full((4, 3), -0.2),
    masses=np.array([1.0, 2.0, 3.0, 4.0]),
    tetrahedra=np.array([[0, 1, 2, 3]]),
    fixed=np.array([True, False, False, True]),
)


SKIN = Surface(
    positions=TETRAHEDRON.positions,
    rest_positions=TETRAHEDRON.rest_positions,
    triangles=np.array([[0, 2, 1], [0, 1, 3]]),
    is_cut=np.array([False, True]),
)


def test_a_snapshot_arrives_bit_for_bit():
    payload = pack_snapshot(TETRAHEDRON)
    assert bits(unpack_snapshot(payload)) == bits(TETRAHEDRON)
    assert len(payload) == snapshot_bytes(n_nodes=4, n_tetrahedra=1)


def test_a_surface_arrives_bit_for_bit_and_within_the_bound():
    payload = pack_surface(SKIN)
    assert bits(unpack_surface(payload)) == bits(SKIN)
    assert len(payload) <= surface_bytes(n_tetrahedra=1)


def test_received_arrays_are_writable():
    snapshot = unpack_snapshot(pack_snapshot(TETRAHEDRON))
    surface = unpack_surface(pack_surface(SKIN))
    assert all(array.flags.writeable for array in (*snapshot, *surface))


@pytest.mark.parametrize("index", [4, -1, 2**62])
def test_a_tetrahedron_or_triangle_without_such_a_node_is_refused(index):
    tetrahedra, triangles = np.array([[0, 1, 2, index]]), np.array([[0, 1, index], [0, 1, 3]])
    with pytest.raises(MessageError, match="tetrahedra refer to points"):
        unpack_snapshot(pack_snapshot(TETRAHEDRON._replace(tetrahedra=tetrahedra)))
    with pytest.raises(MessageError, match="triangles refer to points"):
        unpack_surface(pack_surface(SKIN._replace(triangles=triangles)))


@pytest.mark.parametrize("field", ["positions", "rest_positions", "velocities", "masses"])
def test_a_body_that_is_not_finite_is_refused(field):
    broken = getattr(TETRAHEDRON, field).copy()
    broken.flat[1] = np.nan
    with pytest.raises(MessageError, match="not finite"):
        unpack_snapshot(pack_snapshot(TETRAHEDRON._replace(**{field: broken})))


@pytest.mark.parametrize("counts", [(-1, 1), (4, -1), (4, 3), (2**62, 2**62), (2**63 - 1, 0)])
def test_a_wrong_count_is_refused(counts):
    for packed, unpack in (
        (pack_snapshot(TETRAHEDRON), unpack_snapshot),
        (pack_surface(SKIN), unpack_surface),
    ):
        with pytest.raises(MessageError):
            unpack(struct.pack("<2q", *counts) + packed[16:])


def test_a_number_of_pieces_arrives_and_an_invalid_one_is_refused():
    assert unpack_pieces(pack_pieces(2)) == 2
    for payload in (pack_pieces(-1), b"", bytes(PIECES_BYTES + 1)):
        with pytest.raises(MessageError, match="pieces"):
            unpack_pieces(payload)
