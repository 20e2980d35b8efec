"""The Nystroem method of three stages: order, stability, and what it takes from fast modes."""

import numpy as np
import pytest

from tests.support import bodies, naive_runge_kutta
from tests.tissue.integrators.test_runge_kutta import order
from tests.tissue.kernels_of import network_of
from tissue import block
from tissue.core.jit import is_compiling
from tissue.integrators.methods import METHODS, NYSTROEM
from tissue.integrators.nystroem import INSTANTS, WEIGHTS

MESH = block((3, 2, 2), (0.06, 0.04, 0.04))
SECOND = INSTANTS[1]


def step_matrix(z, c=SECOND):
    """Return a step of x'' = -w^2 x as a matrix on (x, h v), with z = w h."""
    columns = [
        naive_runge_kutta.three_stages(lambda x, v: -(z**2) * x, np.array(x), np.array(v), 1.0, c)
        for x, v in ((1.0, 0.0), (0.0, 1.0))
    ]
    return np.array(columns).T


def limit_of_stability(c):
    """Return the least z at which a mode grows."""
    scan = np.arange(0.01, 4.0, 0.001)
    grows = (np.abs(np.linalg.eigvals(step_matrix(z, c))).max() > 1.0 + 1e-9 for z in scan)
    return next(z for z, it_grows in zip(scan, grows, strict=True) if it_grows)


def bent():
    """Return a block of 190 springs, held at two sides, bent by 5 mm."""
    held = bodies.sides(MESH)
    network = network_of(MESH, held)
    x = MESH.positions / np.ptp(MESH.positions, axis=0)
    wave = 0.005 * np.sin(np.pi * x[:, [0]]) * np.array([0.5, 1.0, 0.7]) * ~held[:, None]
    network.body.positions[:] = MESH.positions + wave
    return network


@pytest.mark.kernel
def test_a_step_is_that_of_the_published_family_at_one_third():
    network = bent()
    body = network.body

    def acceleration(x, v):
        before = body.positions.copy(), body.velocities.copy()
        body.positions[:], body.velocities[:] = x, 0.0 * v
        forces = network.forces() / body.masses[:, None]
        body.positions[:], body.velocities[:] = before
        return np.where(body.fixed[:, None] != 0, 0.0, forces)

    x, v = body.positions.copy(), body.velocities.copy()
    for _ in range(3):
        x, v = naive_runge_kutta.three_stages(acceleration, x, v, 2e-4, SECOND)
    network.damped_between_steps(NYSTROEM, 2e-4, 3)
    np.testing.assert_allclose(body.positions, x, rtol=0.0, atol=1e-15)
    np.testing.assert_allclose(body.velocities, v, rtol=0.0, atol=1e-12)


def test_the_order_is_four_on_a_network_of_springs():
    def after(n, seconds=0.04):
        network = bent()
        network.damped_between_steps(NYSTROEM, seconds / n, n)
        return network.body.positions.copy()

    steps = [80, 113, 160, 226]
    fine = after(16 * steps[-1])
    assert order(steps, [np.abs(after(n) - fine).max() for n in steps]) >= 3.9


def test_weights_and_instants_integrate_polynomials_of_third_degree():
    for degree in range(4):
        integral = sum(w * c**degree for w, c in zip(WEIGHTS, INSTANTS, strict=True))
        assert integral == pytest.approx(1.0 / (degree + 1), rel=1e-14)


def test_the_limit_of_stability_is_the_root_of_twelve():
    assert limit_of_stability(SECOND) == pytest.approx(np.sqrt(12.0), abs=2e-3)
    assert np.sqrt(12.0) - 2e-4 < METHODS["nystroem"].limit < np.sqrt(12.0)


def test_no_other_method_of_the_family_is_stable_as_far_or_takes_as_little_energy():
    """Nystroem's own has the second stage at one half."""
    others = [0.2, 0.25, 0.3, 0.32, 0.35, 0.4, 0.45, 0.5, 0.55]
    assert max(limit_of_stability(c) for c in others) < np.sqrt(12.0) - 0.1
    assert max(np.linalg.det(step_matrix(1.0, c)) for c in others) < np.linalg.det(step_matrix(1.0))


@pytest.mark.parametrize("z", [0.5, 1.0, 2.0, 2.9])
def test_a_step_takes_z_to_the_sixth_over_864_of_the_energy_of_a_mode(z):
    """The mean over its phases is the determinant of the step."""
    assert 1.0 - np.linalg.det(step_matrix(z)) == pytest.approx(z**6 / 864.0, rel=1e-9)


@pytest.mark.skipif(not is_compiling(), reason="many steps: compiled only")
def test_momentum_is_kept_to_rounding():
    network = network_of(MESH)
    body = network.body
    body.velocities[:] = np.random.default_rng(1).normal(0.0, 0.1, body.velocities.shape)
    before = body.masses @ body.velocities
    network.damped_between_steps(NYSTROEM, 2e-4, 500)
    np.testing.assert_allclose(body.masses @ body.velocities, before, atol=1e-15)
