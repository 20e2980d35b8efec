"""Links between tetrahedra, and walks through them."""

import numpy as np
import pytest

from tests.support import bodies, naive
from tissue import block
from tissue.core.vec3 import Vec3
from tissue.geometry.tetrahedron import barycentric_in, smallest_weight
from tissue.mesh.body import CUT, OUTER, build_body, build_links, grown_body, local_index, walk

pytestmark = pytest.mark.kernel

BLOCK = block((4, 1, 1), (4.0, 1.0, 1.0))


def test_every_face_of_a_single_tetrahedron_is_outer():
    assert (build_links(bodies.unit_tetrahedron().tetrahedra) == OUTER).all()


def test_two_tetrahedra_are_linked_across_their_face():
    assert build_links(bodies.two_tetrahedra().tetrahedra).tolist() == [
        [4 * 1 + 0, OUTER, OUTER, OUTER],
        [4 * 0 + 0, OUTER, OUTER, OUTER],
    ]


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
