"""Forces on a few nodes from the tetrahedra around them are those from all tetrahedra."""

import numpy as np
import pytest

from tests import bodies
from tissue import Material
from tissue.core.jit import kernel
from tissue.core.simd import store_point
from tissue.elasticity.elasticity import Elasticity
from tissue.elasticity.internal_forces import deform, internal_force
from tissue.integrators.local.element_subsets import deform_patch, find_patch, new_patch, reach_of
from tissue.integrators.node_rings import add_focus, begin_search, new_rings, search
from tissue.mesh.body import build_body
from tissue.mesh.star import no_visits

pytestmark = pytest.mark.kernel

MESH = bodies.jittered_grid(3, 0)
N_NODES, N_TETRAHEDRA = len(MESH.positions), len(MESH.tetrahedra)
MATERIALS = {
    "springs": Material(),
    "springs and volumes": Material(poisson_ratio=0.4),
    "tetrahedra": Material(law="neo_hookean", poisson_ratio=0.45),
}


@kernel
def elastic_forces(elastic, body, nodes, n, out):
    for i in range(n):
        force = internal_force(elastic, nodes[i], body.positions, body.velocities, 0.0)
        store_point(out, nodes[i], force)


@pytest.fixture(params=MATERIALS)
def shaken(request):
    """Return a body with random displacements, and its elastic arrays."""
    body = build_body(MESH, None, None)
    elastic = Elasticity(MATERIALS[request.param], body, no_visits(N_NODES, N_TETRAHEDRA)).arrays
    body.positions[:] += np.random.default_rng(0).uniform(-1e-3, 1e-3, (N_NODES, 3))
    return elastic, body


def all_forces(elastic, body):
    out = np.zeros((N_NODES, 3))
    deform(elastic, body, body.positions)
    elastic_forces(elastic, body, np.arange(N_NODES), N_NODES, out)
    return out


def rings_around(elastic, node, last_ring):
    rings = new_rings(N_NODES)
    begin_search(rings)
    add_focus(rings, node)
    search(rings, elastic.springs, last_ring)
    return rings


def patch_of(elastic, rings, moving, affected):
    patch = new_patch(N_NODES, N_TETRAHEDRA)
    find_patch(patch, elastic, rings, moving, affected)
    return patch


@pytest.mark.parametrize("node", [0, 21, 40])
def test_the_force_on_a_node_needs_only_its_patch(shaken, node):
    """All values outside the patch are zero."""
    elastic, body = shaken
    expected = all_forces(elastic, body)[node]
    for name in ("dilated", "pressure", "forces"):
        getattr(elastic.solid, name)[:] = 0.0
    patch = patch_of(elastic, rings_around(elastic, node, 1), 1, 0)
    deform_patch(patch, elastic, body, body.positions)
    out = np.zeros((N_NODES, 3))
    elastic_forces(elastic, body, np.array([node]), 1, out)
    np.testing.assert_array_equal(out[node], expected)


@pytest.mark.parametrize("node", [0, 21, 40])
def test_the_patch_of_a_moved_node_has_all_nodes_whose_force_changes(shaken, node):
    """After a full evaluation, updating the rings gives all forces, and no others change."""
    elastic, body = shaken
    before = all_forces(elastic, body)
    reach = reach_of(elastic)
    rings = rings_around(elastic, node, reach)
    body.positions[node] += 1e-4
    deform_patch(patch_of(elastic, rings, 0, reach - 1), elastic, body, body.positions)
    out = before.copy()
    n = rings.n_found
    elastic_forces(elastic, body, rings.order, n, out)
    expected = all_forces(elastic, body)
    np.testing.assert_array_equal(out, expected)
    changed = np.flatnonzero((expected != before).any(axis=1))
    assert set(changed) <= set(rings.order[:n].tolist())
