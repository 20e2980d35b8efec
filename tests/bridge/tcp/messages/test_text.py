import numpy as np
import pytest

from bridge.link import SceneView, TissueDescription
from bridge.tcp.messages.text import (
    LARGEST_DESCRIPTION,
    LARGEST_ERROR,
    MAX_VIEWS,
    pack_description,
    pack_error,
    unpack_description,
    unpack_error,
)
from bridge.tcp.wire import MessageError
from tests.bridge.bits import bits
from tissue import BladeShape, Material

VIEW = SceneView("from above", (0.0, 0.0, 1.0), (0.1, 0.2, 0.3), (0.0, 1.0, 0.0), 38.0)


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
    )
    received = unpack_description(pack_description(sent))
    assert bits(received.bounds) == bits(sent.bounds)
    assert received._replace(bounds=None) == sent._replace(bounds=None)


def test_the_longest_error_fits():
    assert len(pack_error("\U0001f52a" * 10**6)) <= LARGEST_ERROR


@pytest.mark.parametrize("density", [b"-1000.0", b"null", b"1e999", b'"heavy"'])
def test_a_description_of_an_impossible_material_is_refused(density):
    bounds = np.array([[0.0, 0.0, 0.0], [1.0, 1.0, 1.0]])
    packed = pack_description(TissueDescription("organ", Material(density=1000.0), bounds, 1, 4))
    assert unpack_description(packed)
    with pytest.raises(MessageError, match=r"density|out of range"):
        unpack_description(packed.replace(b'"density":1000.0', b'"density":' + density))


@pytest.mark.parametrize(
    "series", [b"null", b"[0.3]", b'[["a", 0.1]]', b"[[0.3, 0.1, 1]]", b"[[2, 1]]"]
)
def test_a_description_of_an_impossible_prony_series_is_refused(series):
    bounds = np.array([[0.0, 0.0, 0.0], [1.0, 1.0, 1.0]])
    material = Material(law="neo_hookean", prony=((0.3, 0.1),))
    packed = pack_description(TissueDescription("organ", material, bounds, 1, 4))
    assert unpack_description(packed).material == material
    with pytest.raises(MessageError, match=r"prony|\$\.material"):
        unpack_description(packed.replace(b'"prony":[[0.3,0.1]]', b'"prony":' + series))


def described(*views):
    bounds = np.array([[0.0, 0.0, 0.0], [1.0, 1.0, 1.0]])
    return pack_description(TissueDescription("organ", Material(), bounds, 1, 4, views=views))


def test_as_many_views_as_there_may_be_fit():
    longest = SceneView("\U0001f52a" * 40, *[(-1.0 / 3.0e-100,) * 3] * 3, 100.0 / 3.0)
    packed = described(*[longest] * MAX_VIEWS)
    assert len(packed) <= LARGEST_DESCRIPTION
    assert unpack_description(packed).views == (longest,) * MAX_VIEWS


@pytest.mark.parametrize(
    ("views", "why"),
    [
        ([VIEW] * (MAX_VIEWS + 1), f"length <= {MAX_VIEWS}"),
        ([VIEW._replace(name="a\x1b[2J")], "a control character in its name"),
        ([VIEW._replace(name="a" * 101)], "length <= 100"),
        ([VIEW._replace(eye=(0.0, 0.0, np.nan))], "got `null`"),
        ([VIEW._replace(up=(0.0, 0.0))], "length 3"),
        ([VIEW._replace(fov_degrees=180.0)], "< 180"),
        ([VIEW._replace(fov_degrees=0.0)], "> 0"),
    ],
)
def test_a_description_with_an_impossible_view_is_refused(views, why):
    with pytest.raises(MessageError, match=why):
        unpack_description(described(*views))


def test_an_error_arrives_without_its_control_characters():
    assert unpack_error(pack_error("no blade: 3 µm")) == "no blade: 3 µm"
    assert unpack_error(b"gone\x1b[2J\n") == "gone\ufffd[2J\ufffd"
