import struct

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge import GeomLoads
from bridge.driven import no_geom_loads
from bridge.tcp.messages.result import pack_result, unpack_result
from bridge.tcp.wire import MessageError
from tests.bridge.bits import bits
from tests.bridge.tcp.serve_block import block_tissue
from tissue import BodyContacts, Energies, RigidContacts, StageTimes, StepResult, Wrench

any_float = st.floats(allow_nan=True, allow_infinity=True)


counts = st.integers(0, 10**6)


def rows(n, numbers):
    return st.lists(numbers, min_size=3 * n, max_size=3 * n).map(
        lambda values: np.array(values).reshape(n, 3)
    )


@st.composite
def results(draw):
    vectors = draw(rows(7, any_float))
    n_tetrahedra = draw(counts)
    n_contacts = draw(st.integers(0, 3))
    return StepResult(
        wrench=Wrench(*vectors[:3]),
        wrench_t1=Wrench(*draw(rows(3, any_float))),
        stiffness=draw(rows(12, any_float)).reshape(6, 6),
        contacts=RigidContacts(
            draw(rows(n_contacts, any_float)),
            draw(rows(n_contacts, any_float)),
            draw(rows(n_contacts, any_float))[:, 0],
            draw(rows(n_contacts, any_float)),
            draw(rows(n_contacts, any_float))[:, 1],
            np.arange(n_contacts) - 1,
        ),
        force_on_tissue=vectors[3],
        bounds=vectors[4:6],
        n_tetrahedra=n_tetrahedra,
        n_nodes=draw(counts),
        n_active=draw(st.integers(0, n_tetrahedra)),
        active_point_tetrahedron=draw(st.integers(-1, n_tetrahedra - 1)),
        anchored_length=draw(any_float),
        cut_area=draw(any_float),
        finished_area=draw(any_float),
        work_of_blade=draw(any_float),
        work_of_cutting=draw(any_float),
        n_substeps=draw(counts),
        body_contacts=BodyContacts(draw(counts), draw(any_float), draw(any_float), vectors[6]),
        stage_times=StageTimes(*draw(st.tuples(any_float, any_float, any_float))),
        energies=draw(st.none() | st.builds(Energies, *[any_float] * len(Energies._fields))),
    )


@given(results())
def test_a_result_arrives_bit_for_bit_even_where_the_tissue_diverged(result):
    assert bits(unpack_result(pack_result(result))[0]) == bits(result)


def test_the_loads_on_geoms_arrive_bit_for_bit_even_where_the_tissue_diverged():
    loads = GeomLoads(np.array([[1.0, -0.0, np.nan], [0.1, 0.2, 0.3]]), np.full((2, 3), np.inf))
    packed = pack_result(block_tissue().step(None, 1e-3), (), loads)
    assert bits(unpack_result(packed, 2)[2]) == bits(loads)
    for n in (0, 1, 3):
        with pytest.raises(MessageError, match=f"{len(packed)} bytes; wanted"):
            unpack_result(packed, n)


@pytest.mark.parametrize(
    ("change", "why"),
    [
        ({"n_active": 4}, "4 active tetrahedra"),
        ({"active_point_tetrahedron": 3}, "tip in number 3"),
        ({"active_point_tetrahedron": -2}, "tip in number -2"),
        ({"n_tetrahedra": -1}, "-1 elements"),
        ({"n_substeps": -1}, "-1 substeps"),
        ({"body_contacts": BodyContacts(-1, 0.0, 0.0, np.zeros(3))}, "-1 contacts"),
    ],
)
def test_a_result_with_impossible_counts_is_refused(change, why):
    zeros = np.zeros(3)
    wrench, bounds, stage_times = (
        Wrench(zeros, zeros, zeros),
        np.zeros((2, 3)),
        StageTimes(0.0, 0.0, 0.0),
    )
    body_contacts = BodyContacts(0, 0.0, 0.0, zeros)
    none = np.zeros((0, 3))
    contacts = RigidContacts(none, none, np.zeros(0), none, np.zeros(0), np.zeros(0, int))
    at_t1 = (wrench, np.zeros((6, 6)), contacts)
    counts_and_floats = (3, 6, 1, 0, 0.0, 0.0, 0.0, 0.0, 0.0, 1)
    good = StepResult(
        wrench, *at_t1, zeros, bounds, *counts_and_floats, body_contacts, stage_times, None
    )
    with pytest.raises(MessageError, match=why):
        unpack_result(pack_result(good._replace(**change)))


@pytest.mark.parametrize(
    ("place", "value", "why"),
    [
        (6, -1, "-1 contacts of blade and geoms"),
        (6, 2**16 + 1, "65537 contacts"),
        (7, 2, "audit flag 2"),
    ],
)
def test_a_result_with_an_impossible_number_of_contacts_is_refused(place, value, why):
    packed = bytearray(pack_result(block_tissue().step(None, 1e-3)))
    struct.pack_into("<q", packed, 8 * place, value)
    with pytest.raises(MessageError, match=why):
        unpack_result(bytes(packed))


@pytest.mark.parametrize("geom", [-2.0, 0.5, float("nan"), float("inf")])
def test_a_contact_with_an_impossible_number_of_a_geom_is_refused(geom):
    one = (np.zeros((1, 3)), np.zeros((1, 3)), np.zeros(1), np.zeros((1, 3)), np.zeros(1))
    contacts = RigidContacts(*one, np.array([geom]))
    result = block_tissue().step(None, 1e-3)._replace(contacts=contacts)
    with pytest.raises(MessageError, match="geoms of contacts are"):
        unpack_result(pack_result(result))


def test_a_contact_with_a_geom_that_the_client_does_not_lead_is_refused():
    one = (np.zeros((1, 3)), np.zeros((1, 3)), np.zeros(1), np.zeros((1, 3)), np.zeros(1))
    contacts = RigidContacts(*one, np.array([2]))
    result = block_tissue().step(None, 1e-3)._replace(contacts=contacts)
    three, two = (pack_result(result, (), no_geom_loads(n)) for n in (3, 2))
    assert unpack_result(three, 3)[0].contacts.geom.tolist() == [2]
    with pytest.raises(MessageError, match=r"geoms of contacts are \[2.0\]; .* from -1 to 1"):
        unpack_result(two, 2)


def test_a_result_without_its_last_number_is_refused():
    packed = pack_result(block_tissue().step(None, 1e-3))
    with pytest.raises(MessageError, match=f"{len(packed) - 8} bytes; wanted {len(packed)}"):
        unpack_result(packed[:-8])
