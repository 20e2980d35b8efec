"""The tetrahedra around a node and an edge, against a search of all tetrahedra."""

import numpy as np
import pytest

from tests.support import bodies, naive
from tissue import block
from tissue.mesh.body import build_body
from tissue.mesh.star import LARGEST_STAR, edge_star, mean_node_size, no_visits, node_size, star

pytestmark = pytest.mark.kernel

MESHES = {"grid": block((2, 2, 2), (1.0, 1.0, 1.0)), "jittered": bodies.jittered(3, 4, size=1.0)}


@pytest.fixture(params=MESHES)
def mesh(request):
    return MESHES[request.param]


@pytest.fixture
def around(mesh):
    """Return the body, its visit marks and the scratch array of a search."""
    visits = no_visits(len(mesh.positions), len(mesh.tetrahedra))
    return build_body(mesh, None, None), visits, np.zeros(LARGEST_STAR, dtype=np.int64)


def test_the_star_of_a_node_is_every_tetrahedron_with_that_node(mesh, around):
    body, visits, out = around
    for node in range(len(mesh.positions)):
        n = star(body, visits, node, body.node_tetrahedron[node], out)
        assert len(set(out[:n])) == n
        assert set(out[:n].tolist()) == naive.star(mesh.tetrahedra, node)


def test_the_star_of_an_edge_is_every_tetrahedron_with_both_ends(mesh, around):
    body, visits, out = around
    for a, b in mesh.tetrahedra[:, :2]:
        n = edge_star(body, visits, a, b, out)
        both = naive.star(mesh.tetrahedra, a) & naive.star(mesh.tetrahedra, b)
        assert set(out[:n].tolist()) == both


def test_node_size_is_the_smallest_altitude_around(mesh, around):
    body, visits, out = around
    n_nodes = len(mesh.positions)
    sizes = [naive.node_size(mesh.positions, mesh.tetrahedra, node) for node in range(n_nodes)]
    assert [node_size(body, visits, k, out) for k in range(n_nodes)] == pytest.approx(sizes)
    assert mean_node_size(body, visits, out) == pytest.approx(np.mean(sizes))
