"""Links between tetrahedra, and walks through them."""

import numpy as np
import pytest

from tests.support import bodies, naive
from tissue import block
from tissue.core.vec3 import Vec3
from tissue.geometry.tetrahedron import barycentric_in, smallest_weight
from tissue.mesh.body import CUT, OUTER, build_body, build_links, grown_body, local_index, walk
from tissue.mesh.node_motion import forget_moved, is_motion_finite, none_moved, note_moved

pytestmark = pytest.mark.kernel

BLOCK = block((4, 1, 1), (4.0, 1.0, 1.0))


@pytest.mark.parametrize("mesh", [block((2, 1, 2), (1.0, 1.0, 1.0)), bodies.jittered(2, 1)])
def test_links_are_those_found_by_comparing_every_pair(mesh):
    np.testing.assert_array_equal(build_links(mesh.tetrahedra), naive.links(mesh.tetrahedra))


def test_a_face_of_three_tetrahedra_is_refused():
    with pytest.raises(ValueError, match="three or more"):
        build_links(np.array([[0, 1, 2, 3], [0, 1, 2, 4], [0, 1, 2, 5]]))


def test_each_node_refers_to_a_tetrahedron_that_contains_it():
    body = build_body(BLOCK, None, None)
    for node in range(len(BLOCK.positions)):
        assert local_index(body, body.node_tetrahedron[node], node) >= 0


def test_growing_keeps_the_content_and_adds_capacity():
    body = build_body(BLOCK, None, None)
    larger = grown_body(body, 100, 200)
    assert len(larger.rest) == len(larger.masses) == 100
    assert len(larger.links) == 200
    np.testing.assert_array_equal(larger.rest[: len(body.rest)], body.rest)
    assert (larger.n_nodes, larger.n_tetrahedra) == (body.n_nodes, body.n_tetrahedra)


def test_a_body_keeps_its_own_copy_of_the_mesh():
    mesh = block((1, 1, 1), (1.0, 1.0, 1.0))
    body = build_body(mesh, None, None)
    mesh.positions[:] = np.nan
    assert np.isfinite(body.rest).all()


@pytest.mark.parametrize("mesh", [BLOCK, bodies.jittered(3, 2, size=1.0)])
def test_a_walk_finds_the_tetrahedron_that_contains_a_point(mesh):
    body = build_body(mesh, None, None)
    random = np.random.default_rng(0)
    for share in random.random((100, 3)):
        p = Vec3(*(share * mesh.positions.max(axis=0)).tolist())
        weights = [
            smallest_weight(barycentric_in(p, body.rest, body.tetrahedra, t))
            for t in range(len(mesh.tetrahedra))
        ]
        found = walk(body, p, int(random.integers(len(mesh.tetrahedra))))
        assert found.inside
        assert weights[found.tetrahedron] == pytest.approx(max(weights), abs=1e-8)


def test_a_walk_that_leaves_through_the_skin_reports_it():
    body = build_body(BLOCK, None, None)
    found = walk(body, Vec3(9.0, 0.5, 0.5), 0)
    assert not found.inside
    assert found.link == OUTER


def test_a_walk_does_not_pass_a_cut():
    body = build_body(BLOCK, None, None)
    x = body.rest[body.tetrahedra, 0]
    for t, f in np.argwhere(body.links >= 0):
        if (np.delete(x[t], f) == 2.0).all():
            body.links[t, f] = CUT
    found = walk(body, Vec3(3.5, 0.5, 0.5), 0)
    assert not found.inside
    assert found.link == CUT
    assert x[found.tetrahedron].mean() < 2.0


def nodes(moved):
    return moved.nodes[: moved.n_nodes].tolist()


def test_each_node_is_listed_once_in_the_order_of_its_first_note():
    moved = none_moved(10)
    note_moved(moved, np.array([7, 3, 7, 1]), 3)
    note_moved(moved, np.array([3, 2]), 2)
    assert nodes(moved) == [7, 3, 2]


def test_a_forgotten_list_is_empty_and_can_be_filled_again():
    moved = none_moved(10)
    note_moved(moved, np.array([7, 3]), 2)
    forget_moved(moved)
    assert nodes(moved) == []
    note_moved(moved, np.array([3]), 1)
    assert nodes(moved) == [3]


MESH = bodies.jittered(2, 0)
N = len(MESH.positions)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 1e308])
@pytest.mark.parametrize("array", ["positions", "velocities"])
def test_a_number_is_found_if_it_is_not_finite(array, value):
    body = build_body(MESH, MESH.positions, np.zeros(N, np.bool_))
    assert is_motion_finite(body)
    numbers = getattr(body, array)
    for node in range(N):
        kept, numbers[node, node % 3] = numbers[node, node % 3], value
        assert is_motion_finite(body) == np.isfinite(value)
        numbers[node, node % 3] = kept


def test_what_is_behind_the_nodes_does_not_count():
    body = build_body(MESH, MESH.positions, np.zeros(N, np.bool_))
    body.n_nodes = N - 1
    body.velocities[N - 1] = np.nan
    assert is_motion_finite(body)
