"""What the search lists is what a test of all nodes and faces finds."""

import numpy as np
import pytest

from tests.tissue.contact.geoms.test_signed_distance import GEOMS
from tissue import block
from tissue.contact.geoms.geom_arrays import NODE_CONTACT
from tissue.contact.geoms.geom_contact import GeomContact
from tissue.contact.geoms.signed_distance import distance_to
from tissue.core.vec3 import Vec3
from tissue.mesh.body import build_body

pytestmark = pytest.mark.kernel

SIZE = 0.005


def above(shape, gap):
    """Return a block of 20 mm, and contact with a geom that is `gap` above it [m]."""
    body = build_body(block((4, 4, 4), (0.02, 0.02, 0.02)), None, None)
    body.masses[:] = 1e-3
    contact = GeomContact([GEOMS[shape]], body, SIZE, [[0.01, 0.01, 1.0]])
    lift = min(
        distance_to(contact.arrays.geoms, 0, Vec3(*x)).distance
        for x in body.positions[: body.n_nodes]
    )
    contact = GeomContact([GEOMS[shape]], body, SIZE, [[0.01, 0.01, 1.0 - lift + gap]])
    return body, contact


@pytest.mark.parametrize("shape", [name for name in GEOMS if name != "plane"])
def test_every_skin_node_within_a_quarter_of_a_node_size_is_listed_once(shape):
    body, contact = above(shape, 2e-4)
    contact.begin_step(body, 1e-3)
    arrays = contact.arrays
    rows = slice(arrays.first, arrays.first + arrays.n_contacts)
    is_node = arrays.face[rows] == NODE_CONTACT
    listed = arrays.node[rows][is_node, 0]
    distances = np.array(
        [distance_to(arrays.geoms, 0, Vec3(*x)).distance for x in body.positions[: body.n_nodes]]
    )
    skin = body.positions[: body.n_nodes, 2] == 0.02
    np.testing.assert_array_equal(
        np.sort(listed), np.flatnonzero(skin & (distances <= 0.25 * SIZE))
    )
    assert len(listed) > 0
    faces, weights = arrays.node[rows][~is_node], arrays.weight[rows][~is_node]
    np.testing.assert_allclose(weights.sum(axis=1), 1.0)
    assert (body.positions[faces, 2] == 0.02).all(), "faces of the upper side alone"


def test_a_list_lasts_until_nodes_have_come_nearer_by_a_tenth_of_a_node_size():
    body, contact = above("box", 2e-4)
    contact.begin_step(body, 1e-3)
    searches = []
    body.velocities[:, 2] = 0.05
    for _ in range(24):
        contact.begin_step(body, 1e-3)
        searches.append(contact.search.search)
    # 0.05 mm a step, of which the first is covered: another search each ten or eleven steps.
    assert 2 <= searches[-1] - searches[0] <= 3
