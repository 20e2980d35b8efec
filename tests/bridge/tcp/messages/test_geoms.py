"""The request to touch geoms arrives bit for bit, and one that makes no sense is refused."""

import base64
import json

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from bridge import GeomPoses
from bridge.tcp.messages.geoms import MAX_GEOMS, pack_geoms, unpack_geoms
from bridge.tcp.wire import MessageError
from tests.bridge.bits import bits
from tissue import Geom

WEDGE = np.array([[0.0, 0.0, 0.0], [0.01, 0.0, 0.1 / 3.0], [0.0, 0.01, 0.0], [-0.0, 0.0, 0.01]])
GEOMS = [
    Geom("table", "plane"),
    Geom("ball", "sphere", (0.1,), 0.3),
    Geom("rod", "capsule", (0.01, 0.1 / 3.0), 0.1 / 7.0),
    Geom("can", "cylinder", (0.01, 0.02)),
    Geom("egg", "ellipsoid", (0.01, 0.02, 0.03)),
    Geom("board", "box", (0.01, 0.02, 0.03)),
    Geom("wedge \u00b5", "mesh", (), 0.2, WEDGE),
]
TURNED = Rotation.from_rotvec([[0.1 * i, 0.3, 1.0] for i in range(7)]).as_matrix()
POSES = GeomPoses(np.arange(21.0).reshape(7, 3) / 7.0, TURNED)


def test_geoms_of_all_shapes_arrive_bit_for_bit():
    geoms, poses = unpack_geoms(pack_geoms(GEOMS, POSES))
    assert bits(tuple(map(tuple, geoms))) == bits(tuple(map(tuple, GEOMS)))
    assert bits(poses) == bits(POSES)


def test_no_geoms_arrive_as_none():
    geoms, poses = unpack_geoms(b'{"geoms": []}')
    assert geoms == [] and poses.origins.shape == (0, 3) and poses.rotations.shape == (0, 3, 3)


def one(**changes):
    """Return a request with one good geom, of which something is changed."""
    good = {"name": "ball", "shape": "sphere", "size": [0.01], "friction": 0.1}
    placed = {"origin": [0, 0, 0], "rotation": [1, 0, 0, 0, 1, 0, 0, 0, 1]}
    return json.dumps({"geoms": [good | placed | changes]}).encode()


def packed(*numbers):
    return base64.b64encode(np.array(numbers, "<f8").tobytes()).decode()


@pytest.mark.parametrize(
    ("changes", "why"),
    [
        ({"size": [-0.01]}, r"> 0.0.*\$.geoms\[0\].size"),
        ({"size": [1e4]}, r"<= 1000.0.*\$.geoms\[0\].size"),
        ({"size": ["wide"]}, r"Expected `float`"),
        ({"friction": None}, r"Expected `float`.*friction"),
        ({"origin": [0, 0]}, r"length 3"),
        ({"origin": [0, 0, 2000]}, "geom 0 is not within 1000 m"),
        ({"rotation": [1, 0, 0, 0, 1, 0, 0, 0]}, r"length >= 9"),
        ({"rotation": [1, 0, 0, 0, 1, 0, 0, 0, -1]}, "axes of geom 0 are no rotation"),
        ({"rotation": [1, 0, 0, 0, 1, 0, 0, 0, 2]}, "axes of geom 0 are no rotation"),
        ({"vertices": "no base 64!"}, "base64"),
        ({"vertices": packed(1.0, 2.0)}, "vertices in 16 bytes; wanted 24 for each"),
        ({"vertices": packed(0.0, np.nan, 0.0)}, "a vertex that is not within 1000 m"),
        ({"vertices": packed(0.0, 0.0, 1e9)}, "a vertex that is not within 1000 m"),
        ({"name": "a" * 201}, r"length <= 200"),
        ({"name": "a\nb"}, "control character"),
        ({"colour": "red"}, "unknown field `colour`"),
    ],
)
def test_a_geom_with_one_wrong_thing_is_refused(changes, why):
    assert unpack_geoms(one())
    with pytest.raises(MessageError, match=why):
        unpack_geoms(one(**changes))


def test_more_geoms_than_there_may_be_are_refused():
    many = json.loads(one())["geoms"] * (MAX_GEOMS + 1)
    with pytest.raises(MessageError, match=f"length <= {MAX_GEOMS}"):
        unpack_geoms(json.dumps({"geoms": many}).encode())


@pytest.mark.parametrize("payload", [b"", b"{}", b"[]", b"\xff", b'{"geoms": 1}', b"\x00" * 48])
def test_what_is_no_list_of_geoms_is_refused(payload):
    with pytest.raises(MessageError, match="request to touch geoms cannot be read"):
        unpack_geoms(payload)


def test_a_number_that_no_double_holds_is_refused():
    with pytest.raises(MessageError, match="out of range"):
        unpack_geoms(one().replace(b'"friction": 0.1', b'"friction": 1e999'))
