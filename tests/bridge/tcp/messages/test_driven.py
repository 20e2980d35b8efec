"""Requests to attach frames and touch geoms arrive bit for bit; what makes no sense is refused."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from bridge.driven import FrameAttachment, FrameTie, GeomPoses
from bridge.tcp.messages.driven import (
    ATTACHMENT,
    MAX_GEOMS,
    NUMBER,
    TIE,
    pack_geoms,
    unpack_geoms,
)
from bridge.tcp.wire import MessageError
from tests.bridge.bits import bits
from tests.bridge.changed_messages import changed, raw
from tissue import Geom

WEDGE = np.array([[0.0, 0.0, 0.0], [0.01, 0.0, 0.1 / 3.0], [0.0, 0.01, 0.0], [-0.0, 0.0, 0.01]])
GEOMS = (
    Geom("table", "plane"),
    Geom("ball", "sphere", (0.1,), 0.3),
    Geom("rod", "capsule", (0.01, 0.1 / 3.0), 0.1 / 7.0),
    Geom("can", "cylinder", (0.01, 0.02)),
    Geom("egg", "ellipsoid", (0.01, 0.02, 0.03)),
    Geom("board", "box", (0.01, 0.02, 0.03)),
    Geom("wedge \u00b5", "mesh", (), 0.2, WEDGE),
)
TURNED = Rotation.from_rotvec([[0.1 * i, 0.3, 1.0] for i in range(7)]).as_matrix()
POSES = GeomPoses(np.arange(21.0).reshape(7, 3) / 7.0, TURNED)
AT = np.array([[0.1, 0.2, 0.1 / 3.0]])


@pytest.mark.parametrize("where", ["top", np.array([3, 4]), AT])
def test_what_a_frame_acts_on_arrives_bit_for_bit(where):
    attachment = FrameAttachment(where, 500.0, 0.1 / 3.0, 2.0, AT[0])
    assert bits(ATTACHMENT.unpack(ATTACHMENT.pack(attachment))) == bits(attachment)
    tie = FrameTie(where, AT, 500.0, 1e-6, 50.0)
    assert bits(TIE.unpack(TIE.pack(tie))) == bits(tie)


def attachment_packed():
    return ATTACHMENT.pack(FrameAttachment("top", 500.0))


@pytest.mark.parametrize(
    ("change", "why"),
    [
        ({"where__region": None}, "either on a region, or on nodes, or on points"),
        ({"where__nodes": raw(1, dtype="<i8")}, "either on a region, or on nodes, or on points"),
        ({"where": {"nodes": raw(-1, dtype="<i8")}}, "nodes -1 to -1"),
        ({"where": {"points": raw(0.0, 0.0, 1e9)}}, "a point is not within 1000 m"),
        ({"stiffness": np.inf}, "stiffness"),
        ({"breaks_at": np.nan}, "breaks_at"),
        ({"origin": raw(0.0, 0.0)}, "origin has 16 bytes; wanted 24"),
        ({"origin": raw(0.0, 0.0, np.inf)}, "the origin of a frame is not within"),
    ],
)
def test_an_attachment_with_one_wrong_part_is_refused_by_name(change, why):
    assert ATTACHMENT.unpack(attachment_packed())
    with pytest.raises(MessageError, match=why):
        ATTACHMENT.unpack(changed(attachment_packed(), **change))


@pytest.mark.parametrize(
    ("change", "why"),
    [
        ({"to": b""}, "fibres without an end"),
        ({"to": raw(0.0, 0.0, 2e3)}, "the end of a fibre is not within"),
        ({"area": np.nan}, "area"),
    ],
)
def test_a_tie_with_one_wrong_part_is_refused_by_name(change, why):
    packed = TIE.pack(FrameTie("top", AT, 500.0, 1e-6, 50.0))
    with pytest.raises(MessageError, match=why):
        TIE.unpack(changed(packed, **change))


@pytest.mark.parametrize("number", [-1, 1 << 40, 0.5])
def test_what_is_no_number_of_a_frame_is_refused(number):
    assert NUMBER.unpack(NUMBER.pack(1)) == 1
    with pytest.raises(MessageError, match="number of a frame cannot be read"):
        NUMBER.unpack(NUMBER.pack(number))


def test_geoms_of_all_shapes_arrive_bit_for_bit():
    geoms, poses = unpack_geoms(pack_geoms(GEOMS, POSES))
    assert bits(tuple(map(tuple, geoms))) == bits(tuple(map(tuple, GEOMS)))
    assert bits(poses) == bits(POSES)


def test_no_geoms_arrive_as_none():
    geoms, poses = unpack_geoms(pack_geoms([], GeomPoses(np.zeros((0, 3)), np.zeros((0, 3, 3)))))
    assert geoms == () and poses.origins.shape == (0, 3) and poses.rotations.shape == (0, 3, 3)


def ball_packed(n=1):
    """Return a request with equal balls."""
    poses = GeomPoses(np.zeros((n, 3)), np.tile(np.eye(3), (n, 1, 1)))
    return pack_geoms([GEOMS[1]] * n, poses)


@pytest.mark.parametrize(
    ("change", "why"),
    [
        ({"geoms__0__size": [-0.01]}, r"> 0.0.*\$.geoms\[0\].size"),
        ({"geoms__0__size": [1e4]}, r"<= 1000.0.*\$.geoms\[0\].size"),
        ({"geoms__0__friction": np.inf}, r"friction"),
        ({"poses": raw(0, 0, 2000, 1, 0, 0, 0, 1, 0, 0, 0, 1)}, "geom 0 is not within 1000 m"),
        ({"poses": b""}, "0 poses of 1 geoms"),
        ({"poses": raw(0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, -1)}, "axes of geom 0 are no rotation"),
        ({"geoms__0__vertices": raw(1.0, 2.0)}, "vertices has 16 bytes"),
        (
            {"geoms__0__vertices": raw(0.0, np.nan, 0.0)},
            "vertex of the geom 'ball' is not",
        ),
        ({"geoms__0__name": "a" * 201}, r"length <= 200"),
        ({"geoms__0__name": "a\nb"}, "control character"),
        ({"geoms__0__colour": "red"}, "unknown field `colour`"),
    ],
)
def test_a_geom_with_one_wrong_part_is_refused(change, why):
    assert unpack_geoms(ball_packed())
    with pytest.raises(MessageError, match=why):
        unpack_geoms(changed(ball_packed(), **change))


def test_more_geoms_than_there_may_be_are_refused():
    with pytest.raises(MessageError, match=f"length <= {MAX_GEOMS}"):
        unpack_geoms(ball_packed(MAX_GEOMS + 1))
