"""A step and its reply arrive bit for bit, and what makes no sense in them is refused."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from bridge.driven import NO_GEOMS, FrameLoad, FramePose, GeomLoads, GeomPoses, no_geom_loads
from bridge.tcp.messages.step import (
    LARGEST_RESULT,
    MAX_CONTACTS,
    RESULT,
    StepReply,
    pack_step,
    unpack_result,
    unpack_step,
)
from bridge.tcp.wire import MessageError
from tests.bridge.bits import bits
from tests.bridge.changed_messages import changed, raw, with_number
from tests.bridge.tcp.serve_block import block_tissue
from tissue import BladeSegment, BladeSweep, Energies, RigidContacts, Wrench

any_float = st.floats(width=64)


def rows(n, numbers):
    return st.lists(numbers, min_size=3 * n, max_size=3 * n).map(
        lambda values: np.array(values).reshape(n, 3)
    )


@st.composite
def sweeps(draw):
    tips = draw(rows(4, st.floats(-1000.0, 1000.0)))
    forward = np.array([0.6, 0.0, 0.8])
    return BladeSweep(
        BladeSegment(tips[0], tips[1], forward), BladeSegment(tips[2], tips[3], -forward)
    )


EDGE = BladeSegment(np.zeros(3), np.array([0.0, 0.0, 0.1]), np.array([0.0, 1.0, 0.0]))
POSES = [
    FramePose(np.array([0.1, 0.2, -0.3 * i]), Rotation.from_rotvec([0.1 * i, 0.3, 1.0]).as_matrix())
    for i in range(3)
]
GEOMS = GeomPoses(*(np.array(each) for each in zip(*POSES, strict=True)))


@given(sweeps(), st.floats(1e-6, 1.0))
def test_a_sweep_arrives_bit_for_bit(sweep, dt):
    assert bits(unpack_step(pack_step(sweep, dt))[:2]) == bits((sweep, dt))


def test_no_blade_arrives_as_no_blade():
    assert unpack_step(pack_step(None, 1e-3)) == (None, 1e-3, [], NO_GEOMS)


@pytest.mark.parametrize("n", [0, 1, 3])
@pytest.mark.parametrize("sweep", [None, BladeSweep(EDGE, EDGE)])
def test_poses_of_frames_and_geoms_arrive_bit_for_bit(n, sweep):
    packed = pack_step(sweep, 1e-3, POSES[:n], GEOMS)
    found, _, poses, geoms = unpack_step(packed, n, 3)
    assert bits((found, tuple(poses), geoms)) == bits((sweep, tuple(POSES[:n]), GEOMS))


@pytest.mark.parametrize(("frames", "geoms"), [(0, 3), (2, 3), (1, 0), (1, 2)])
def test_poses_of_another_number_of_frames_or_geoms_are_refused(frames, geoms):
    with pytest.raises(MessageError, match=f"{frames} frames and {geoms} geoms are driven"):
        unpack_step(pack_step(None, 1e-3, POSES[:1], GEOMS), frames, geoms)


@pytest.mark.parametrize("path", ["frames", "geoms"])
@pytest.mark.parametrize("place", [0, 2, 3, 11])
@pytest.mark.parametrize("bad", [np.nan, np.inf, 2e3])
def test_a_pose_with_one_impossible_number_is_refused(path, place, bad):
    packed = with_number(pack_step(None, 1e-3, POSES, GEOMS), path, 12 + place, bad)
    with pytest.raises(MessageError, match=f"{path[:-1]} 1 (is not within|are no rotation)"):
        unpack_step(packed, 3, 3)


@pytest.mark.parametrize("place", [0, 5, 6, 8, 9, 17])
@pytest.mark.parametrize("bad", [np.nan, np.inf, -1e4])
def test_a_blade_with_one_impossible_number_is_refused(place, bad):
    packed = with_number(pack_step(BladeSweep(EDGE, EDGE), 1e-3), "blade", place, bad)
    with pytest.raises(MessageError, match=r"the blade is not within|forward is not a unit"):
        unpack_step(packed)


@pytest.mark.parametrize("dt", [0.0, -1e-3, 5e-324, 1e-310, 1.1, np.nan, np.inf])
def test_a_step_of_no_time_or_too_much_is_refused(dt):
    with pytest.raises(MessageError, match="a step of"):
        unpack_step(pack_step(None, dt))


def result_of(**changes):
    return block_tissue().step(None, 1e-3)._replace(**changes)


@st.composite
def replies(draw):
    """Return the reply of a tissue that has diverged: any number may be any float."""
    n, vectors = draw(st.integers(0, 3)), draw(rows(9, any_float))
    contacts = RigidContacts(
        *(draw(rows(n, any_float)) for _ in range(2)),
        draw(rows(n, any_float))[:, 0],
        draw(rows(n, any_float)),
        draw(rows(n, any_float))[:, 1],
        np.arange(n) - 1,
    )
    result = result_of(
        wrench=Wrench(*vectors[:3]),
        wrench_t1=Wrench(*vectors[3:6]),
        stiffness=draw(rows(12, any_float)).reshape(6, 6),
        contacts=contacts,
        force_on_tissue=vectors[6],
        bounds=vectors[7:9],
        cut_area=draw(any_float),
        work_of_blade=draw(any_float),
        energies=draw(st.none() | st.builds(Energies, *[any_float] * len(Energies._fields))),
    )
    loads = tuple(FrameLoad(Wrench(*draw(rows(3, any_float))), i) for i in range(n))
    return StepReply(
        result, loads, GeomLoads(draw(rows(3, any_float)), draw(rows(3, any_float))), n
    )


@given(replies())
def test_a_reply_arrives_bit_for_bit_even_where_the_tissue_diverged(reply):
    assert bits(unpack_result(RESULT.pack(reply), 3)) == bits(reply)


def packed_reply(n_geoms=0, **changes):
    loads = (FrameLoad(Wrench(*np.zeros((3, 3))), 7),)
    return RESULT.pack(StepReply(result_of(**changes), loads, no_geom_loads(n_geoms), 0))


def contacts(n, geom):
    none, zeros = np.zeros((n, 3)), np.zeros(n)
    return RigidContacts(none, none, zeros, none, zeros, np.full(n, geom))


def test_the_longest_reply_is_within_its_bound():
    packed = packed_reply(contacts=contacts(MAX_CONTACTS, -1))
    assert unpack_result(packed)
    assert len(packed) <= LARGEST_RESULT


@pytest.mark.parametrize(
    ("change", "why"),
    [
        ({"result__n_active": 73}, "73 active tetrahedra"),
        ({"result__active_point_tetrahedron": 72}, "tip in number 72"),
        ({"result__active_point_tetrahedron": -2}, "active_point_tetrahedron"),
        ({"result__stiffness": raw(*range(35))}, "stiffness has 280 bytes; wanted 288"),
        ({"result__contacts__normal": raw(0.0, 0.0, 0.0)}, "normal has 24 bytes; wanted 0"),
        ({"geom_loads__forces": raw(0.0, 0.0, 0.0)}, "torques has 0 bytes; wanted 24"),
    ],
)
def test_a_reply_with_one_impossible_part_is_refused_by_name(change, why):
    packed = packed_reply()
    assert unpack_result(packed)
    with pytest.raises(MessageError, match=why):
        unpack_result(changed(packed, **change))


def test_more_contacts_than_there_may_be_are_refused():
    with pytest.raises(MessageError, match=f"{MAX_CONTACTS + 1} contacts; at most"):
        unpack_result(packed_reply(contacts=contacts(MAX_CONTACTS + 1, -1)))


@pytest.mark.parametrize("n", [0, 1, 3])
def test_loads_on_another_number_of_geoms_are_refused(n):
    with pytest.raises(MessageError, match=f"the loads on 2 geoms; {n} are driven"):
        unpack_result(packed_reply(2), n)


@pytest.mark.parametrize(("geom", "n_geoms"), [(-2, 0), (MAX_CONTACTS, 0), (2, 2)])
def test_a_contact_with_a_geom_that_the_client_does_not_drive_is_refused(geom, n_geoms):
    assert unpack_result(packed_reply(3, contacts=contacts(1, 2)), 3)
    with pytest.raises(MessageError, match="the geoms of contacts are"):
        unpack_result(packed_reply(n_geoms, contacts=contacts(1, geom)), n_geoms)
