"""Position Verlet: its order, and what a symplectic method keeps."""

import numpy as np
import pytest

from tests.support import bodies
from tests.tissue.integrators.test_runge_kutta import order
from tests.tissue.kernels_of import elastic_of, network_of
from tissue import block
from tissue.core.jit import is_compiling
from tissue.elasticity.energy import elastic_energy
from tissue.integrators.methods import METHODS, VERLET

MESH = block((3, 2, 2), (0.06, 0.04, 0.04))


def bent(size=0.01):
    """Return a block of 190 springs, held at two sides, bent by up to `size` [m]."""
    held = bodies.sides(MESH)
    network = network_of(MESH, held)
    x = MESH.positions / np.ptp(MESH.positions, axis=0)
    wave = size * np.sin(np.pi * x[:, [0]]) * np.array([0.5, 1.0, 0.7]) * ~held[:, None]
    network.body.positions[:] = MESH.positions + wave
    return network


def energy(network):
    """Return the kinetic and elastic energy [J]."""
    body = network.body
    kinetic = 0.5 * body.masses @ (body.velocities**2).sum(axis=1)
    return kinetic + elastic_energy(elastic_of(network.springs), body)


def positions_after(n, seconds=0.04):
    network = bent()
    network.damped_between_steps(VERLET, seconds / n, n)
    return network.body.positions.copy()


def test_the_order_is_two_on_a_network_of_springs():
    steps = [80, 113, 160, 226]
    fine = positions_after(16 * steps[-1])
    errors = [np.abs(positions_after(n) - fine).max() for n in steps]
    assert order(steps, errors) == pytest.approx(2.0, abs=0.1)


@pytest.mark.kernel
def test_a_motion_whose_velocities_are_reversed_returns():
    network = bent()
    begin = network.body.positions.copy()
    for _ in range(2):
        network.damped_between_steps(VERLET, 2e-4, 20)
        network.body.velocities *= -1.0
    assert np.abs(network.body.positions - begin).max() < 1e-12


@pytest.mark.skipif(not is_compiling(), reason="ten thousand steps: compiled only")
@pytest.mark.parametrize("share", [0.3, 0.8])
def test_the_energy_does_not_drift_in_ten_thousand_steps(share):
    """It oscillates by an error of second order; its mean over a period does not change."""
    network = bent(0.002)  # in strong compression springs are stiffer than at rest
    before = energy(network)
    frequency = np.sqrt(network.springs.frequency_squared.max())
    h, energies = share * METHODS["verlet"].limit / frequency, []
    for _ in range(100):
        means = []
        for _ in range(10):
            network.damped_between_steps(VERLET, h, 10)
            means.append(energy(network))
        energies.append(np.mean(means))
    drift = np.polyfit(np.arange(len(energies)), energies, 1)[0] * len(energies)
    assert abs(drift) < 0.01 * before
    assert max(energies) < 1.1 * min(energies)
