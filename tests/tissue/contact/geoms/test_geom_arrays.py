"""Contacts with geoms keep all that they are where their arrays grow."""

import itertools

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tissue import Geom
from tissue.contact.geoms.geom_arrays import (
    TAKEN,
    geom_motion_at,
    grown_geom_contacts,
    lead_geoms,
    motion_bound,
    new_geom_contacts,
    new_geoms,
    place_geoms,
)
from tissue.core.vec3 import Vec3


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
