"""The kernels' form of the Runge-Kutta method against the classical one in NumPy."""

import numpy as np
import pytest

from tests.support import bodies, naive, naive_runge_kutta
from tests.tissue.kernels_of import YOUNG_MODULUS, Network, network_of, oscillator

pytestmark = pytest.mark.kernel

MESH = bodies.jittered(2, 5)
DAMPED = {"retardation_time": 1e-3, "viscous_damping": 3.0}
STEP = 1e-4


def accelerations_of(network: Network):
    """Return the accelerations of a network as a plain sum over its springs."""
    rest, masses = network.body.rest, network.body.masses[:, None]
    springs = naive.stiffnesses(MESH.positions, MESH.tetrahedra, YOUNG_MODULUS)
    time, drag = network.surroundings.retardation_time, network.surroundings.drag

    def accelerations(x, v):
        return naive.forces(springs, rest, x, v, time) / masses - drag * v

    return accelerations


def perturb(network: Network):
    random = np.random.default_rng(0)
    network.body.positions[:] += 1e-3 * random.normal(size=MESH.positions.shape)
    network.body.velocities[:] = 0.1 * random.normal(size=MESH.positions.shape)
    return network.body.positions.copy(), network.body.velocities.copy()


@pytest.mark.parametrize("damping", [{}, {"viscous_damping": 3.0}, DAMPED])
def test_a_step_is_that_of_nystroem_in_numpy(damping):
    network = network_of(MESH, **damping)
    x, v = perturb(network)
    network.advance(STEP)
    x, v = naive_runge_kutta.nystroem(accelerations_of(network), x, v, STEP)
    np.testing.assert_allclose(network.body.positions, x, rtol=0.0, atol=1e-15)
    np.testing.assert_allclose(network.body.velocities, v, rtol=0.0, atol=1e-12)


def test_both_forms_have_the_errors_of_theory():
    """x'' = -w^2 x - 2 zeta w x', zeta = 0.1, two periods in 640 steps: 4.07e-9 and 1.67e-9."""
    w, zeta, n, seconds = 2.0 * np.pi, 0.1, 640, 2.0
    damped = w * np.sqrt(1.0 - zeta**2)
    decay = np.exp(-zeta * w * seconds)
    exact_x = decay * (np.cos(damped * seconds) + zeta * w / damped * np.sin(damped * seconds))
    exact_v = -decay * w * w / damped * np.sin(damped * seconds)

    def error(x, v):
        return max(abs(x - exact_x), abs(v - exact_v) / w)

    network = oscillator(w, viscous_damping=2.0 * zeta * w)
    network.body.positions[1, 0] = 1.5
    network.advance(seconds / n, n)
    x, v = network.body.positions[1, 0] - 1.0, network.body.velocities[1, 0]
    assert error(2.0 * x, 2.0 * v) == pytest.approx(1.67e-9, rel=0.05)

    x, v = np.array(1.0), np.array(0.0)
    for _ in range(n):
        x, v = naive_runge_kutta.classical(
            lambda x, v: -w * w * x - 2.0 * zeta * w * v, x, v, seconds / n
        )
    assert error(x, v) == pytest.approx(4.07e-9, rel=0.05)
