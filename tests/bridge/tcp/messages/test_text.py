"""The description of a tissue arrives with every property, and an impossible one is refused."""

import msgspec
import numpy as np
import pytest

from bridge.description import NamedLabel, SceneView, TissueDescription
from bridge.device.messages import DEVICE_DESCRIPTION, DeviceDescription
from bridge.tcp.messages.text import (
    DESCRIPTION,
    LARGEST_DESCRIPTION,
    LARGEST_ERROR,
    LONGEST_LABEL,
    MAX_LABELS,
    MAX_VIEWS,
    pack_error,
    sent_labels,
    sent_scene_name,
    unpack_error,
)
from bridge.tcp.wire import MessageError
from tests.bridge.bits import bits
from tests.bridge.changed_messages import changed, raw
from tissue import BladeShape, Material

VIEW = SceneView("from above", (0.0, 0.0, 1.0), (0.1, 0.2, 0.3), (0.0, 1.0, 0.0), 38.0)
BOUNDS = np.array([[0.0, 0.0, 0.0], [1.0, 1.0, 1.0]])


def test_a_description_arrives_with_every_property_of_material_and_blade():
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
        prony=((0.3, 0.1), (0.2, 5.0)),
    )
    sent = TissueDescription(
        "slab",
        material,
        np.array([[0.0, 0.1, 0.2], [1, 2, 3]]),
        576,
        175,
        BladeShape(thickness=3e-4),
        -0.01,
        (VIEW, VIEW._replace(name="µ", eye=(-0.0, 1.0 / 3.0, 1e-300))),
        (NamedLabel(0, "fat"), NamedLabel(7, "Gefäß")),
    )
    received = DESCRIPTION.unpack(DESCRIPTION.pack(sent))
    assert bits(received.bounds) == bits(sent.bounds)
    assert received._replace(bounds=None) == sent._replace(bounds=None)


def test_names_of_labels_are_sent_short_and_printable_and_not_too_many():
    many = [NamedLabel(i, "\u00e9" * 500) for i in range(5000)]
    sent = sent_labels([NamedLabel(3, "a\x1b[2J"), *many])
    assert sent[0] == NamedLabel(3, "a\ufffd[2J")
    assert len(sent) == MAX_LABELS and len(sent[1].name) == LONGEST_LABEL
    views = [VIEW._replace(name="\u00e9" * 100)] * MAX_VIEWS
    description = TissueDescription("organ", Material(), BOUNDS, 1, 4, None, None, views, sent)
    payload = DESCRIPTION.pack(description)
    assert len(payload) <= LARGEST_DESCRIPTION
    assert DESCRIPTION.unpack(payload).labels == sent


def described(*views, scene="organ"):
    material = Material(law="neo_hookean", prony=((0.3, 0.1),))
    return DESCRIPTION.pack(TissueDescription(scene, material, BOUNDS, 1, 4, views=views))


@pytest.mark.parametrize(
    ("change", "why"),
    [
        ({"material__density": -1000.0}, "density"),
        ({"material__prony": [[2, 1]]}, "prony"),
        ({"bounds": raw(1, 1, 1, 0, 0, 0)}, "the lowest first"),
        ({"bounds": raw(*[np.nan] * 6)}, "finite corners"),
    ],
)
def test_an_impossible_description_is_refused(change, why):
    assert DESCRIPTION.unpack(described())
    with pytest.raises(MessageError, match=why):
        DESCRIPTION.unpack(changed(described(), **change))


def test_a_description_that_is_nested_too_deep_is_refused():
    packed = changed(described(), material__x="deep")
    deep = packed.replace(msgspec.msgpack.encode("deep"), b"\x91" * 100_000 + b"\xc0")
    with pytest.raises(MessageError, match=r"description cannot be read: .*recursion"):
        DESCRIPTION.unpack(deep)


def test_as_many_views_as_there_may_be_fit():
    longest = SceneView("\U0001f52a" * 40, *[(-1.0 / 3.0e-100,) * 3] * 3, 100.0 / 3.0)
    packed = described(*[longest] * MAX_VIEWS)
    assert len(packed) <= LARGEST_DESCRIPTION
    assert DESCRIPTION.unpack(packed).views == (longest,) * MAX_VIEWS


@pytest.mark.parametrize(
    ("views", "why"),
    [
        ([VIEW] * (MAX_VIEWS + 1), f"length <= {MAX_VIEWS}"),
        ([VIEW._replace(name="a\x1b[2J")], "a control character in its name"),
        ([VIEW._replace(name="a" * 101)], "length <= 100"),
        ([VIEW._replace(eye=(0.0, 0.0, np.nan))], "eye"),
        ([VIEW._replace(fov_degrees=180.0)], "< 180"),
    ],
)
def test_a_description_with_an_impossible_view_is_refused(views, why):
    with pytest.raises(MessageError, match=why):
        DESCRIPTION.unpack(described(*views))


@pytest.mark.parametrize("name", ["organ", "my_scene-2", "a" * 64])
def test_a_scene_name_is_sent_as_it_is(name):
    assert sent_scene_name(name) == name


@pytest.mark.parametrize(
    ("name", "sent"),
    [
        ("/etc/passwd", "_etc_passwd"),
        ("../../.ssh", "_______ssh"),
        ("C:\\x", "C__x"),
        ("a\n", "a_"),
        ("\x1b[31m", "__31m"),
        ("ä", "_"),
        ("a" * 65, "a" * 64),
        ("", "tissue"),
    ],
)
def test_no_scene_name_is_a_path_for_another_process(name, sent):
    assert sent_scene_name(name) == sent
    for message, packed in (
        (DESCRIPTION, described(scene=name)),
        (DEVICE_DESCRIPTION, DEVICE_DESCRIPTION.pack(DeviceDescription(name, 0.04, 0.2, 2.0))),
    ):
        with pytest.raises(MessageError, match=r"\$.scene"):
            message.unpack(packed)
        assert message.unpack(changed(packed, scene=sent)).scene == sent


def test_the_longest_error_fits():
    assert len(pack_error("\U0001f52a" * 10**6)) <= LARGEST_ERROR


def test_an_error_arrives_without_its_control_characters():
    assert unpack_error(pack_error("no blade: 3 µm")) == "no blade: 3 µm"
    assert unpack_error(b"gone\x1b[2J\n") == "gone\ufffd[2J\ufffd"


def test_an_error_is_no_messagepack_so_that_every_version_reads_it():
    with pytest.raises(msgspec.DecodeError):
        msgspec.msgpack.decode(pack_error("no blade"))
