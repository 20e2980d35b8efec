import struct

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from bridge import GeomPoses
from bridge.driven import NO_GEOMS, FramePose
from bridge.tcp.messages.step import pack_step, unpack_step
from bridge.tcp.wire import MessageError
from tests.bridge.bits import bits
from tissue import BladeSegment, BladeSweep

coordinates = st.floats(-1000.0, 1000.0)


def rows(n, numbers):
    return st.lists(numbers, min_size=3 * n, max_size=3 * n).map(
        lambda values: np.array(values).reshape(n, 3)
    )


@st.composite
def sweeps(draw):
    tips = draw(rows(4, coordinates))
    forward = np.array([0.6, 0.0, 0.8])
    return BladeSweep(
        BladeSegment(tips[0], tips[1], forward), BladeSegment(tips[2], tips[3], -forward)
    )


@given(sweeps(), st.floats(1e-6, 1.0))
def test_a_sweep_arrives_bit_for_bit(sweep, dt):
    assert bits(unpack_step(pack_step(sweep, dt))[:2]) == bits((sweep, dt))


def test_no_blade_arrives_as_no_blade():
    assert unpack_step(pack_step(None, 1e-3)) == (None, 1e-3, [], NO_GEOMS)


POSES = [
    FramePose(np.array([0.1, 0.2, -0.3 * i]), Rotation.from_rotvec([0.1 * i, 0.3, 1.0]).as_matrix())
    for i in range(3)
]


@pytest.mark.parametrize("n", range(4))
@pytest.mark.parametrize("has_blade", [True, False])
def test_poses_of_frames_arrive_bit_for_bit(n, has_blade):
    edge = BladeSegment(np.zeros(3), np.array([0.0, 0.0, 0.1]), np.array([0.0, 1.0, 0.0]))
    sweep = BladeSweep(edge, edge) if has_blade else None
    found = unpack_step(pack_step(sweep, 1e-3, POSES[:n]), n)
    assert bits((found[0], tuple(found[2]))) == bits((sweep, tuple(POSES[:n])))


@pytest.mark.parametrize(("sent", "led"), [(0, 1), (1, 0), (2, 1), (1, 2), (3, 2)])
def test_poses_of_another_number_of_frames_are_refused(sent, led):
    with pytest.raises(MessageError, match=f"96 for each of {led} frames and 0 geoms that are led"):
        unpack_step(pack_step(None, 1e-3, POSES[:sent]), led)


GEOMS = GeomPoses(*(np.array(each) for each in zip(*POSES, strict=True)))


@pytest.mark.parametrize("n", range(4))
@pytest.mark.parametrize("has_blade", [True, False])
def test_poses_of_geoms_arrive_behind_those_of_frames_bit_for_bit(n, has_blade):
    edge = BladeSegment(np.zeros(3), np.array([0.0, 0.0, 0.1]), np.array([0.0, 1.0, 0.0]))
    sweep = BladeSweep(edge, edge) if has_blade else None
    found = unpack_step(pack_step(sweep, 1e-3, POSES[:n], GEOMS), n, 3)
    assert bits((found[0], tuple(found[2]), found[3])) == bits((sweep, tuple(POSES[:n]), GEOMS))


@pytest.mark.parametrize("n", [0, 2, 4])
def test_poses_of_another_number_of_geoms_are_refused(n):
    with pytest.raises(MessageError, match=f"96 for each of 0 frames and {n} geoms that are led"):
        unpack_step(pack_step(None, 1e-3, (), GEOMS), 0, n)


@pytest.mark.parametrize("place", range(12))
@pytest.mark.parametrize("bad", [np.nan, np.inf, 2e3])
def test_a_pose_of_a_geom_with_one_impossible_number_is_refused(place, bad):
    numbers = np.frombuffer(pack_step(None, 1e-3, (), GEOMS)).copy()
    numbers[1 + 12 + place] = bad
    with pytest.raises(MessageError, match=r"geom 1 (is not within|are no rotation)"):
        unpack_step(numbers.tobytes(), 0, 3)


def test_a_reflection_is_no_rotation():
    mirrored = np.diag([1.0, 1.0, -1.0])
    with pytest.raises(MessageError, match="axes of frame 0 are no rotation"):
        unpack_step(pack_step(None, 1e-3, [FramePose(np.zeros(3), mirrored)]), 1)


@pytest.mark.parametrize("place", range(12))
@pytest.mark.parametrize("bad", [np.nan, np.inf, 2e3])
def test_a_pose_with_one_impossible_number_is_refused(place, bad):
    numbers = [*POSES[0].origin, *POSES[0].rotation.ravel()]
    numbers[place] = bad
    payload = struct.pack("<13d", 1e-3, *numbers)
    with pytest.raises(
        MessageError, match=r"frame 0 is not within|axes of frame 0 are no rotation"
    ):
        unpack_step(payload, 1)


def step_numbers(**changes):
    """Return a good step request as 19 numbers, with some of them changed."""
    numbers = [1e-3, *[0.1] * 6, 0.0, 1.0, 0.0, *[0.2] * 6, 0.0, 1.0, 0.0]
    for place, value in changes.items():
        numbers[int(place[1:])] = value
    return struct.pack("<19d", *numbers)


@pytest.mark.parametrize("place", range(19))
@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf, 1e9, -1e4])
def test_a_step_with_one_impossible_number_is_refused(place, bad):
    assert unpack_step(step_numbers())
    with pytest.raises(MessageError):
        unpack_step(step_numbers(**{f"_{place}": bad}))


@pytest.mark.parametrize("dt", [0.0, -1e-3, 5e-324, 1e-310, 1.1, np.nan])
def test_a_step_of_no_time_or_too_much_is_refused(dt):
    with pytest.raises(MessageError, match="a step of"):
        unpack_step(struct.pack("<d", dt))
