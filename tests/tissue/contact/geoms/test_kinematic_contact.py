"""Impulses of contact: what the tissue gets the geom loses, within the cone of friction."""

import numpy as np
import pytest

from tissue import Geom, block
from tissue.contact.geoms.geom_contact import GeomContact
from tissue.contact.geoms.kinematic_contact import end_geom_substep
from tissue.mesh.body import build_body

pytestmark = pytest.mark.kernel

DT = 1e-3


def on_table(friction, velocity):
    """Return a free block that touches a table, with that velocity [m/s], and their contact."""
    body = build_body(block((2, 2, 1), (0.02, 0.02, 0.01)), None, None)
    body.masses[:] = np.random.default_rng(0).uniform(1e-4, 1e-3, len(body.masses))
    contact = GeomContact([Geom("table", "plane", (), friction=friction)], body, 0.01)
    body.velocities[:] = velocity
    contact.begin_step(body, DT)
    return body, contact


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
