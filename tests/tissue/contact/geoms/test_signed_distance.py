"""Distances from geoms, against their definition: the nearest of many points of the surface."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from tissue import Geom
from tissue.contact.geoms.geom_arrays import new_geoms, place_geoms
from tissue.contact.geoms.signed_distance import deepest_point, distance_to
from tissue.core.vec3 import Vec3

pytestmark = pytest.mark.kernel

ROUNDING = 5e-9
"""Errors of distances [m]: an ellipsoid takes points 1e-9 of its size off planes of symmetry."""

TETRAHEDRON = np.array([[0, 0, 0], [0.02, 0, 0], [0, 0.03, 0], [0, 0, 0.04]])

GEOMS = {
    "plane": Geom("a", "plane"),
    "sphere": Geom("a", "sphere", (0.02,)),
    "capsule": Geom("a", "capsule", (0.01, 0.03)),
    "cylinder": Geom("a", "cylinder", (0.02, 0.01)),
    "ellipsoid": Geom("a", "ellipsoid", (0.01, 0.02, 0.04)),
    "box": Geom("a", "box", (0.01, 0.02, 0.03)),
    "mesh": Geom("a", "mesh", vertices=TETRAHEDRON),
}

coordinate = st.floats(-0.05, 0.05)

anywhere = st.tuples(coordinate, coordinate, coordinate)

N = 24

WEIGHTS = np.array([(i, j, N - i - j) for i in range(N + 1) for j in range(N + 1 - i)]) / N


def distance(geom, x):
    """Distance and normal in the frame of the geom."""
    found = distance_to(new_geoms([geom]), 0, Vec3(*map(float, x)))
    return found.distance, np.array(found.normal)


def is_inside(geom, x):
    """Whether points are in a geom, shape (n,), from the definition of the shape."""
    x, size = np.atleast_2d(x), np.array(geom.size)
    match geom.shape:
        case "plane":
            return x[:, 2] < 0.0
        case "sphere":
            return (x**2).sum(axis=1) < size[0] ** 2
        case "capsule":
            z = x[:, 2] - np.clip(x[:, 2], -size[1], size[1])
            return x[:, 0] ** 2 + x[:, 1] ** 2 + z**2 < size[0] ** 2
        case "cylinder":
            return (np.hypot(x[:, 0], x[:, 1]) < size[0]) & (np.abs(x[:, 2]) < size[1])
        case "ellipsoid":
            return ((x / size) ** 2).sum(axis=1) < 1.0
        case "box":
            return (np.abs(x) < size).all(axis=1)
    sides = ConvexHull(geom.vertices).equations
    return (x @ sides[:, :3].T + sides[:, 3] < 0.0).all(axis=1)


@pytest.mark.parametrize("shape", GEOMS)
@given(x=anywhere)
@settings(max_examples=60, deadline=None)
def test_a_point_is_inside_where_its_distance_is_negative(shape, x):
    geom = GEOMS[shape]
    far, _ = distance(geom, x)
    if abs(far) > 1e-9:
        assert is_inside(geom, x)[0] == (far < 0.0)


@pytest.mark.parametrize("shape", GEOMS)
@given(x=anywhere)
@settings(max_examples=60, deadline=None)
def test_the_normal_leads_to_the_surface_by_the_distance(shape, x):
    """From outside a mesh it leads to the nearest of the planes, which the hull may not reach."""
    far, normal = distance(GEOMS[shape], x)
    assert np.linalg.norm(normal) == pytest.approx(1.0, abs=1e-12)
    if far < 0.0 or shape != "mesh":
        there, _ = distance(GEOMS[shape], np.array(x) - far * normal)
        assert there == pytest.approx(0.0, abs=ROUNDING)


@pytest.mark.parametrize("shape", GEOMS)
@given(x=anywhere, y=anywhere, share=st.floats(0.0, 1.0))
@settings(max_examples=60, deadline=None)
def test_the_distance_is_convex_and_no_steeper_than_the_way(shape, x, y, share):
    a, b = np.array(x), np.array(y)
    (at_a, _), (at_b, _) = distance(GEOMS[shape], a), distance(GEOMS[shape], b)
    between, _ = distance(GEOMS[shape], a + share * (b - a))
    assert between <= (1.0 - share) * at_a + share * at_b + ROUNDING
    assert abs(at_a - at_b) <= np.linalg.norm(a - b) + ROUNDING


def test_a_flat_ellipsoid_has_its_least_distance_across():
    far, normal = distance(Geom("a", "ellipsoid", (0.1, 0.01, 0.001)), (0.0, 0.0, 0.0002))
    assert far == pytest.approx(-0.0008, rel=1e-6)
    assert normal == pytest.approx([0.0, 0.0, 1.0], abs=1e-6)


def test_a_hull_has_each_flat_side_once():
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
    assert len(new_geoms([Geom("a", "mesh", vertices=corners)]).plane) == 6


def test_a_geom_is_where_it_was_placed():
    geoms, turned = new_geoms([GEOMS["box"]]), Rotation.from_rotvec([0.3, -0.8, 0.5])
    geoms.origin_t0[0], geoms.turn[0], geoms.shift[0] = (
        (0.1, 0.0, 0.0),
        turned.as_rotvec(),
        (0, 1, 0),
    )
    place_geoms(geoms, 1.0)
    x = np.array([0.12, 1.03, 0.01])
    own = turned.inv().apply(x - [0.1, 1.0, 0.0])
    far, normal = distance(GEOMS["box"], own)
    found = distance_to(geoms, 0, Vec3(*x))
    assert found.distance == pytest.approx(far, abs=1e-15)
    assert np.array(found.normal) == pytest.approx(turned.apply(normal), abs=1e-12)


def triangles(seed, n):
    """Triangles with edges of some centimetres around the geoms."""
    return np.random.default_rng(seed).uniform(-0.03, 0.03, (n, 3, 3))


@pytest.mark.parametrize("shape", GEOMS)
def test_no_point_of_the_triangle_is_deeper_by_more_than_half_a_percent_of_an_edge(shape):
    geoms = new_geoms([GEOMS[shape]])
    for corners in triangles(1, 25):
        found = deepest_point(geoms, 0, *(Vec3(*corner) for corner in corners))
        weights = np.array(found.weights)
        others = [distance_to(geoms, 0, Vec3(*x)).distance for x in WEIGHTS @ corners]
        longest = np.linalg.norm(corners - np.roll(corners, 1, axis=0), axis=1).max()
        assert found.distance <= min(others) + 0.005 * longest
        assert weights.sum() == pytest.approx(1.0)
        assert weights.min() >= -1e-12
        at = distance_to(geoms, 0, Vec3(*(weights @ corners)))
        assert at.distance == pytest.approx(found.distance, abs=1e-12)


def test_the_centre_of_a_geom_has_a_distance_and_a_normal():
    for geom in GEOMS.values():
        far, normal = distance(geom, (0.0, 0.0, 0.0))
        assert np.isfinite(far)
        assert np.linalg.norm(normal) == pytest.approx(1.0)
