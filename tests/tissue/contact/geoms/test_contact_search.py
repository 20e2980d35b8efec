"""What the search lists is what a test of all nodes and faces finds."""

import itertools

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.tissue.contact.geoms.test_signed_distance import GEOMS
from tissue import Geom, block
from tissue.contact.geoms.geom_arrays import (
    NODE_CONTACT,
    TAKEN,
    geom_motion_at,
    grown_geom_contacts,
    lead_geoms,
    motion_bound,
    new_geom_contacts,
    new_geoms,
    place_geoms,
)
from tissue.contact.geoms.geom_contact import GeomContact
from tissue.contact.geoms.kinematic_contact import end_geom_substep
from tissue.contact.geoms.signed_distance import distance_to
from tissue.core.vec3 import Vec3
from tissue.mesh.body import build_body

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


@pytest.mark.kernel
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


@pytest.mark.kernel
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


DT = 1e-3


def on_table(friction, velocity):
    """Return a free block that touches a table, with that velocity [m/s], and their contact."""
    body = build_body(block((2, 2, 1), (0.02, 0.02, 0.01)), None, None)
    body.masses[:] = np.random.default_rng(0).uniform(1e-4, 1e-3, len(body.masses))
    contact = GeomContact([Geom("table", "plane", (), friction=friction)], body, 0.01)
    body.velocities[:] = velocity
    contact.begin_step(body, DT)
    return body, contact


@pytest.mark.kernel
@pytest.mark.parametrize("friction", [0.0, 0.3, 100.0])
def test_the_impulse_stops_the_approach_and_slip_within_the_cone_of_friction(friction):
    body, contact = on_table(friction, (0.4, 0.0, -0.5))
    before = body.velocities.copy()
    end_geom_substep(contact.arrays, body, DT, 1.0, DT)
    low = body.positions[: body.n_nodes, 2] < 1e-9
    after = body.velocities[: body.n_nodes]
    np.testing.assert_array_equal(after[~low], before[: body.n_nodes][~low])
    np.testing.assert_allclose(after[low, 2], 0.0, atol=1e-15)
    np.testing.assert_allclose(after[low, 0], max(0.4 - friction * 0.5, 0.0), atol=1e-12)


@pytest.mark.kernel
def test_a_node_that_is_inside_is_put_onto_the_surface_and_others_stay():
    body, contact = on_table(0.0, (0.0, 0.0, 0.0))
    low = body.positions[: body.n_nodes, 2] < 1e-9
    body.positions[: body.n_nodes][low] -= [0.0, 0.0, 3e-4]
    before = body.positions.copy()
    end_geom_substep(contact.arrays, body, DT, 1.0, DT)
    np.testing.assert_allclose(body.positions[: body.n_nodes][low, 2], 0.0, atol=1e-15)
    np.testing.assert_array_equal(
        body.positions[: body.n_nodes][~low], before[: body.n_nodes][~low]
    )


@pytest.mark.kernel
@pytest.mark.parametrize("friction", [0.0, 0.3])
def test_momentum_and_torque_that_the_tissue_gets_are_those_that_the_geom_loses(friction):
    body, contact = on_table(friction, (0.4, 0.1, -0.5))
    masses, before = body.masses[: body.n_nodes, None], body.velocities[: body.n_nodes].copy()
    x = body.positions[: body.n_nodes].copy()
    end_geom_substep(contact.arrays, body, DT, 1.0, DT)
    change = masses * (body.velocities[: body.n_nodes] - before)
    forces, torques = contact.wrenches()
    np.testing.assert_allclose(-DT * forces[0], change.sum(axis=0), atol=1e-15)
    np.testing.assert_allclose(-DT * torques[0], np.cross(x, change).sum(axis=0), atol=1e-15)


@pytest.mark.parametrize("first", [0, 4])
def test_growing_keeps_every_row_of_the_list_in_use(first):
    contacts = new_geom_contacts(new_geoms([Geom("ball", "sphere", (1.0,))]), 4, n_nodes=6)
    contacts.first, contacts.n_contacts = first, 3
    arrays = {
        name: value for name, value in vars(contacts).items() if isinstance(value, np.ndarray)
    }
    of_rows = {name: array for name, array in arrays.items() if len(array) == 8}
    assert {"point", "force", "impulse", "slop", "touches"} <= set(of_rows)
    for k, array in enumerate(of_rows.values()):
        array[:] = np.arange(array.size).reshape(array.shape) + 100 * k
    grown = grown_geom_contacts(contacts, 10, n_nodes=9)
    assert (grown.first, grown.n_contacts) == (0, 3)
    for name, array in of_rows.items():
        assert (getattr(grown, name)[:3] == array[first : first + 3]).all(), name


@pytest.mark.kernel
@pytest.mark.parametrize("when", [0.0, 0.3, 1.0])
def test_a_geom_turns_about_an_even_axis_and_its_origin_moves_on_a_line(when):
    random = np.random.default_rng(0)
    start, turn = Rotation.from_quat(random.normal(size=4)), Rotation.from_rotvec([0.3, -0.9, 0.5])
    geoms = new_geoms([Geom("box", "box", (0.01, 0.02, 0.03))])
    geoms.origin_t0[0], geoms.axes_t0[0] = (1.0, 2.0, 3.0), start.as_matrix().ravel()
    there = np.array([[1.1, 2.0, 2.8]])
    axes = (turn * start).as_matrix().reshape(1, 9)
    assert lead_geoms(geoms, there, axes, 2.0, 1e3) == (TAKEN, 0)
    place_geoms(geoms, when)
    wanted = Rotation.from_rotvec(when * turn.as_rotvec()) * start
    np.testing.assert_allclose(geoms.axes[0], wanted.as_matrix().ravel(), atol=1e-14)
    np.testing.assert_allclose(geoms.origin[0], [1.0 + 0.1 * when, 2.0, 3.0 - 0.2 * when])


@pytest.mark.kernel
def test_the_motion_at_a_point_is_no_more_than_the_bound():
    geoms = new_geoms([Geom("box", "box", (0.01, 0.02, 0.03))])
    axes = Rotation.from_rotvec([0.02, 0.01, -0.03]).as_matrix().reshape(1, 9)
    lead_geoms(geoms, np.array([[0.001, 0.0, 0.002]]), axes, 2.0, 1e3)
    corners = np.array(list(itertools.product(*((-s, s) for s in (0.01, 0.02, 0.03)))))
    moved = [np.linalg.norm(geom_motion_at(geoms, 0, Vec3(*x))) for x in corners]
    assert 0.0 < max(moved) <= motion_bound(geoms, 0)
