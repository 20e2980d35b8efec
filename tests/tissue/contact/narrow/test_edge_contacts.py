"""Feature edges touch where they cross, and the direction across is out of both bodies."""

import numpy as np
import pytest

from tests.support.overlaps import NO_GRAVITY, joined
from tests.system.energy.test_conservation import momentum
from tests.tissue.contact.two_blocks import SIZE
from tissue import Material, TetrahedralMesh, Tissue

pytestmark = pytest.mark.kernel

DT = 1e-4
"""Length of a frame [s]: the method is of fourth order in it, so momentum is kept to 1e-8."""

FALLING = [0.02, 0.01, -0.2]
"""Velocity of the upper roof [m/s]."""


def roof(upside_down: bool) -> TetrahedralMesh:
    """Return a tetrahedron whose upper edge is sharp along x, or its lower one along y."""
    positions = SIZE * np.array(
        [[-1.0, 0.0, 1.0], [1.0, 0.0, 1.0], [0.0, -1.0, 0.0], [0.0, 1.0, 0.0]]
    )
    if upside_down:  # turned about the bisector of the x and y axes
        positions = positions[:, [1, 0, 2]] * [1.0, 1.0, -1.0] + [0.0, 0.0, SIZE]
    return TetrahedralMesh(positions, np.array([[0, 1, 2, 3]]))


def two_roofs(offset: float) -> Tissue:
    """Return a roof that falls on another, `offset` from it along y [m], from 0.5 mm above."""
    mesh = joined(roof(False), roof(True), (0.0, offset, 0.0105))
    free = Material(30e3, viscous_damping=0.0, retardation_time=0.0, friction=0.0)
    tissue = Tissue(mesh, free, gravity=NO_GRAVITY)
    tissue._body.velocities[4:8] = FALLING
    return tissue


def contacts_of(tissue: Tissue) -> int:
    """Drop one roof on the other; return the greatest number of contacts."""
    return max(tissue.step(None, DT).body_contacts.n_contacts for _ in range(100))


@pytest.mark.parametrize("offset", [0.0, 0.003])
def test_edges_that_cross_push_each_other_apart_and_keep_their_momentum(offset):
    tissue = two_roofs(offset)
    linear, angular = momentum(tissue)
    assert contacts_of(tissue) == 1
    body = tissue.snapshot()
    assert body.velocities[:4, 2].mean() < body.velocities[4:, 2].mean()
    linear_t1, angular_t1 = momentum(tissue)
    np.testing.assert_allclose(linear_t1, linear, atol=1e-12 * np.linalg.norm(linear))
    np.testing.assert_allclose(angular_t1, angular, atol=1e-8 * np.linalg.norm(angular))


def test_edges_that_pass_each_other_do_not_touch():
    tissue = two_roofs(0.0215)
    assert contacts_of(tissue) == 0
    np.testing.assert_allclose(tissue.snapshot().velocities[4:], [FALLING] * 4)


def test_edges_that_lost_their_contact_and_overlap_come_apart_slowly():
    tissue, deep = two_roofs(0.0), 3e-4
    body = tissue._body
    body.velocities[:] = 0.0
    body.positions[4:8, 2] -= 5e-4 + deep
    assert contacts_of(tissue) == 1

    def gap() -> float:
        return float(body.positions[4:6, 2].min() - body.positions[:2, 2].max())

    assert -deep < gap() < -0.2 * deep, "they come out at one node size per second"
    for _ in range(400):
        tissue.step(None, DT)
    assert gap() > -0.1 * deep
