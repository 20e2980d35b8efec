import struct

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from bridge import messages
from bridge.link import TissueDescription
from bridge.wire import MessageError
from tests.bridge.bits import bits
from tissue.material import Material
from tissue.quality import Measures, QualityReport
from tissue.types import (
    BladeContacts,
    BladeSegment,
    BladeSweep,
    Energies,
    Profile,
    Snapshot,
    StepResult,
    Surface,
    Touch,
    Wrench,
)

any_float = st.floats(allow_nan=True, allow_infinity=True)
coordinates = st.floats(-1000.0, 1000.0)
counts = st.integers(0, 10**6)


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


@st.composite
def results(draw):
    vectors = draw(rows(7, any_float))
    n_tetrahedra = draw(counts)
    n_contacts = draw(st.integers(0, 3))
    return StepResult(
        wrench=Wrench(*vectors[:3]),
        wrench_t1=Wrench(*draw(rows(3, any_float))),
        stiffness=draw(rows(12, any_float)).reshape(6, 6),
        contacts=BladeContacts(
            draw(rows(n_contacts, any_float)),
            draw(rows(n_contacts, any_float)),
            draw(rows(n_contacts, any_float))[:, 0],
            draw(rows(n_contacts, any_float)),
            draw(rows(n_contacts, any_float))[:, 1],
        ),
        force_on_tissue=vectors[3],
        bounds=vectors[4:6],
        n_tetrahedra=n_tetrahedra,
        n_nodes=draw(counts),
        n_active=draw(st.integers(0, n_tetrahedra)),
        active_point_tetrahedron=draw(st.integers(-1, n_tetrahedra - 1)),
        anchored_length=draw(any_float),
        cut_area=draw(any_float),
        work_of_blade=draw(any_float),
        work_of_cutting=draw(any_float),
        n_substeps=draw(counts),
        touch=Touch(draw(counts), draw(any_float), draw(any_float), vectors[6]),
        profile=Profile(*draw(st.tuples(any_float, any_float, any_float))),
        energies=draw(st.none() | st.builds(Energies, *[any_float] * len(Energies._fields))),
    )


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


@given(sweeps(), st.floats(1e-6, 1.0))
def test_a_sweep_arrives_bit_for_bit(sweep, dt):
    assert bits(messages.unpack_step(messages.pack_step(sweep, dt))) == bits((sweep, dt))


def test_no_blade_arrives_as_no_blade():
    assert messages.unpack_step(messages.pack_step(None, 1e-3)) == (None, 1e-3)


@given(results())
def test_a_result_arrives_bit_for_bit_even_where_the_tissue_diverged(result):
    assert bits(messages.unpack_result(messages.pack_result(result))) == bits(result)


def test_a_snapshot_arrives_bit_for_bit():
    payload = messages.pack_snapshot(TETRAHEDRON)
    assert bits(messages.unpack_snapshot(payload)) == bits(TETRAHEDRON)
    assert len(payload) == messages.snapshot_bytes(n_nodes=4, n_tetrahedra=1)


def test_a_surface_arrives_bit_for_bit_and_within_the_bound():
    payload = messages.pack_surface(SKIN)
    assert bits(messages.unpack_surface(payload)) == bits(SKIN)
    assert len(payload) <= messages.surface_bytes(n_tetrahedra=1)


def test_what_arrives_may_be_written_to():
    snapshot = messages.unpack_snapshot(messages.pack_snapshot(TETRAHEDRON))
    surface = messages.unpack_surface(messages.pack_surface(SKIN))
    assert all(array.flags.writeable for array in (*snapshot, *surface))


def test_a_description_arrives_with_every_property_of_the_material():
    material = Material(
        young_modulus=12e3,
        density=1050.0,
        toughness=25.0,
        skin_toughness=40.0,
        toughness_exponent=0.5,
        toughness_speed=0.2,
        work_to_rupture=1e4,
        blade_friction=0.1,
        blade_viscosity=300.0,
        viscous_damping=4.0,
        retardation_time=1e-4,
        friction=0.2,
        law="neo_hookean",
        poisson_ratio=0.45,
    )
    sent = TissueDescription("slab", material, np.array([[0.0, 0.1, 0.2], [1, 2, 3]]), 576, 175)
    received = messages.unpack_description(messages.pack_description(sent))
    assert bits(received.bounds) == bits(sent.bounds)
    assert received._replace(bounds=None) == sent._replace(bounds=None)


def test_a_number_of_pieces_and_an_error_arrive():
    assert messages.unpack_pieces(messages.pack_pieces(2)) == 2
    assert messages.unpack_error(messages.pack_error("no blade: 3 µm")) == "no blade: 3 µm"


QUALITY = QualityReport(
    7, 1e-5, 3e-5, 3e-3, 4e-4, Measures(576, 3e-3, 900.0, 2e-3), Measures(800, 5e-4, 3e3, np.inf)
)


def test_a_quality_report_arrives_bit_for_bit():
    assert bits(messages.unpack_quality(messages.pack_quality(QUALITY))) == bits(QUALITY)


@pytest.mark.parametrize(
    "change",
    [
        {"n_cut_nodes": -1},
        {"path_error_mean": np.nan},
        {"guard": -1e-9},
        {"now": QUALITY.now._replace(altitude=-np.inf)},
        {"initial": QUALITY.initial._replace(n_tetrahedra=0)},
    ],
)
def test_a_quality_report_of_no_body_is_refused(change):
    with pytest.raises(MessageError):
        messages.unpack_quality(messages.pack_quality(QUALITY._replace(**change)))


def test_the_longest_error_fits():
    assert len(messages.pack_error("\U0001f52a" * 10**6)) <= messages.LARGEST_ERROR


def step_numbers(**changes):
    """Return a good step request as 19 numbers, with some places changed."""
    numbers = [1e-3, *[0.1] * 6, 0.0, 1.0, 0.0, *[0.2] * 6, 0.0, 1.0, 0.0]
    for place, value in changes.items():
        numbers[int(place[1:])] = value
    return struct.pack("<19d", *numbers)


@pytest.mark.parametrize("place", range(19))
@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf, 1e9, -1e4])
def test_a_step_with_one_impossible_number_is_refused(place, bad):
    assert messages.unpack_step(step_numbers())
    with pytest.raises(MessageError):
        messages.unpack_step(step_numbers(**{f"_{place}": bad}))


@pytest.mark.parametrize("dt", [0.0, -1e-3, 1.1, np.nan])
def test_a_step_that_lasts_no_time_or_too_long_is_refused(dt):
    with pytest.raises(MessageError, match="a step of"):
        messages.unpack_step(struct.pack("<d", dt))


@pytest.mark.parametrize("index", [4, -1, 2**62])
def test_a_tetrahedron_or_triangle_that_names_no_node_is_refused(index):
    tetrahedra, triangles = np.array([[0, 1, 2, index]]), np.array([[0, 1, index], [0, 1, 3]])
    with pytest.raises(MessageError, match="tetrahedra name points"):
        messages.unpack_snapshot(
            messages.pack_snapshot(TETRAHEDRON._replace(tetrahedra=tetrahedra))
        )
    with pytest.raises(MessageError, match="triangles name points"):
        messages.unpack_surface(messages.pack_surface(SKIN._replace(triangles=triangles)))


@pytest.mark.parametrize("field", ["positions", "rest_positions", "velocities", "masses"])
def test_a_body_that_is_not_finite_is_refused(field):
    broken = getattr(TETRAHEDRON, field).copy()
    broken.flat[1] = np.nan
    with pytest.raises(MessageError, match="not finite"):
        messages.unpack_snapshot(messages.pack_snapshot(TETRAHEDRON._replace(**{field: broken})))


@pytest.mark.parametrize("counts", [(-1, 1), (4, -1), (4, 3), (2**62, 2**62), (2**63 - 1, 0)])
def test_a_count_that_lies_is_refused(counts):
    for pack, unpack in (
        (messages.pack_snapshot(TETRAHEDRON), messages.unpack_snapshot),
        (messages.pack_surface(SKIN), messages.unpack_surface),
    ):
        with pytest.raises(MessageError):
            unpack(struct.pack("<2q", *counts) + pack[16:])


@pytest.mark.parametrize(
    ("change", "why"),
    [
        ({"n_active": 4}, "4 active tetrahedra"),
        ({"active_point_tetrahedron": 3}, "tip in 3"),
        ({"active_point_tetrahedron": -2}, "tip in -2"),
        ({"n_tetrahedra": -1}, "-1 elements"),
        ({"n_substeps": -1}, "-1 substeps"),
        ({"touch": Touch(-1, 0.0, 0.0, np.zeros(3))}, "-1 contacts"),
    ],
)
def test_a_result_with_impossible_counts_is_refused(change, why):
    zeros = np.zeros(3)
    wrench, bounds, profile = Wrench(zeros, zeros, zeros), np.zeros((2, 3)), Profile(0.0, 0.0, 0.0)
    touch = Touch(0, 0.0, 0.0, zeros)
    none = np.zeros((0, 3))
    contacts = BladeContacts(none, none, np.zeros(0), none, np.zeros(0))
    at_t1 = (wrench, np.zeros((6, 6)), contacts)
    counts_and_floats = (3, 6, 1, 0, 0.0, 0.0, 0.0, 0.0, 1)
    good = StepResult(wrench, *at_t1, zeros, bounds, *counts_and_floats, touch, profile, None)
    with pytest.raises(MessageError, match=why):
        messages.unpack_result(messages.pack_result(good._replace(**change)))


def test_a_description_of_no_real_material_is_refused():
    bounds = np.array([[0.0, 0.0, 0.0], [1.0, 1.0, 1.0]])
    packed = messages.pack_description(TissueDescription("", Material(), bounds, 1, 4))
    density = struct.pack(">d", 1000.0)
    with pytest.raises(MessageError, match="density"):
        messages.unpack_description(packed.replace(density, struct.pack(">d", np.nan)))


@given(
    st.sampled_from(
        ["step", "result", "snapshot", "surface", "pieces", "quality", "description", "error"],
    ),
    st.binary(max_size=400),
)
@example("error", b"\xa1\x80")  # a string that is no UTF-8
def test_random_bytes_never_give_another_exception_than_ours(what, payload):
    try:
        value = getattr(messages, f"unpack_{what}")(payload)
    except MessageError as error:
        assert str(error)
    else:
        assert value is not None
