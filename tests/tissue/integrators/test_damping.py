"""Damping between steps, the Nystroem method of three stages, and position Verlet."""

import numpy as np
import pytest

from tests.support import bodies, naive_runge_kutta
from tests.tissue.integrators.test_runge_kutta import (
    DAMPINGS,
    FREQUENCY,
    bent,
    exact_state,
    first_unstable_step,
    growth_of,
    order,
)
from tests.tissue.kernels_of import elastic_of, network_of, oscillator
from tissue import block
from tissue.core.jit import is_compiling
from tissue.elasticity.energy import elastic_energy
from tissue.integrators.damping import LONGEST_INTERVAL
from tissue.integrators.methods import METHODS, NYSTROEM, VERLET
from tissue.integrators.nystroem import INSTANTS, WEIGHTS
from tissue.integrators.stability import DAMPING_LIMIT

NAMES = [name for name, method in METHODS.items() if method.damps_between_steps]
STEPS = [40, 80, 160, 320]
INTERVALS = range(1, LONGEST_INTERVAL + 1)


def state_after_a_second(method, n, damping, interval=1):
    """Return x and x' of the oscillator of `exact_state`."""
    network = oscillator(FREQUENCY, **damping)
    network.body.positions[1, 0] = 1.3
    network.damped_between_steps(METHODS[method].number, 1.0 / n, n, interval=interval)
    return np.array([network.body.positions[1, 0] - 1.0, network.body.velocities[1, 0]])


@pytest.mark.kernel
@pytest.mark.parametrize("method", NAMES)
def test_without_damping_the_order_is_that_of_the_method(method):
    errors = [
        np.abs(state_after_a_second(method, n, {}) - exact_state(1.0, {})).max() for n in STEPS
    ]
    assert order(STEPS, errors) == pytest.approx(METHODS[method].order, abs=0.05)


def error_with_rate(method, n, damping, rate, interval):
    """Return the error against the exact motion with a damping rate [1/s]."""
    exact = exact_state(1.0, {"viscous_damping": rate})
    return np.abs(state_after_a_second(method, n, damping, interval) - exact).max()


def rate_of(damping):
    """Return the rate of damping of the oscillator [1/s]."""
    by_dampers = damping.get("retardation_time", 0.0) * FREQUENCY**2
    return damping.get("viscous_damping", 0.0) + by_dampers


DAMPED = ["drag", "retardation", "both"]


@pytest.mark.kernel
@pytest.mark.parametrize("damping", DAMPED)
@pytest.mark.parametrize("interval", INTERVALS)
@pytest.mark.parametrize("method", NAMES)
def test_with_damping_between_steps_the_order_is_one(method, interval, damping):
    given = DAMPINGS[damping]
    errors = [error_with_rate(method, n, given, rate_of(given), interval) for n in STEPS]
    assert order(STEPS, errors) == pytest.approx(1.0, abs=0.05)


@pytest.mark.kernel
@pytest.mark.parametrize("damping", DAMPED)
@pytest.mark.parametrize("interval", INTERVALS)
@pytest.mark.parametrize("method", NAMES)
def test_the_error_is_a_rate_too_high_by_half_of_rate_times_interval(method, interval, damping):
    """It multiplies by 1 - r s, as the rate -ln(1 - r s) / s = r (1 + r s / 2 + ...) does.

    Against the motion with that rate the order is two: that of the splitting.
    """
    given = DAMPINGS[damping]
    rate = rate_of(given)
    errors = [
        error_with_rate(method, n, given, rate * (1.0 + 0.5 * rate * interval / n), interval)
        for n in STEPS
    ]
    assert order(STEPS, errors) > 1.9


def limit_of(method, ratio, by_drag, interval):
    """Return the first step, in units of 1 / w, beyond which the oscillator grows."""
    damping = {"viscous_damping": 2.0 * ratio} if by_drag else {"retardation_time": 2.0 * ratio}
    network = oscillator(1.0, **damping)

    def growth(step):
        def take_step():
            network.damped_between_steps(
                METHODS[method].number, step, interval, interval=interval, is_running=True
            )

        return growth_of(network, take_step)

    return first_unstable_step(growth)


@pytest.mark.kernel
@pytest.mark.parametrize("ratio", [0.0, 0.1, 0.3, 0.6, 1.0, 2.0])
@pytest.mark.parametrize("by_drag", [True, False], ids=["drag", "retardation"])
@pytest.mark.parametrize("interval", INTERVALS)
@pytest.mark.parametrize("method", NAMES)
def test_elastic_motion_and_damping_limit_the_step_each_by_itself(method, interval, by_drag, ratio):
    """The rate of damping is 2 ratio w. Some damping makes longer Runge-Kutta steps stable."""
    of_damping = DAMPING_LIMIT / (2.0 * ratio * interval) if ratio > 0.0 else np.inf
    expected = min(METHODS[method].limit, of_damping)
    found = limit_of(method, ratio, by_drag, interval)
    assert expected <= found + 0.001
    if method == "verlet" or ratio in (0.0, 1.0, 2.0):
        assert found == pytest.approx(expected, abs=0.005)


@pytest.mark.kernel
@pytest.mark.parametrize("interval", INTERVALS)
@pytest.mark.parametrize("method", NAMES)
def test_what_damping_takes_is_what_the_body_loses(method, interval):
    """A shaken block: kinetic and elastic energy and what was dissipated are constant."""
    mesh = block((2, 2, 1), (0.04, 0.04, 0.02))
    network = network_of(mesh, bodies.sides(mesh), retardation_time=2e-4, viscous_damping=5.0)
    body, elastic = network.body, elastic_of(network.springs)
    noise = np.random.default_rng(0).normal(size=body.positions.shape) * ~body.fixed[:, None]
    body.velocities[:] = 0.02 * noise

    def energy():
        return 0.5 * body.masses @ (body.velocities**2).sum(axis=1) + elastic_energy(elastic, body)

    before = energy()
    damping = network.damped_between_steps(METHODS[method].number, 2e-5, 200, interval=interval)
    assert damping.dissipated > 0.05 * before
    assert before - energy() == pytest.approx(damping.dissipated, rel=1e-3)


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


@pytest.mark.kernel
def test_a_step_is_that_of_the_published_family_at_one_third():
    network = bent(0.005)
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


def energy(network):
    """Return the kinetic and elastic energy [J]."""
    body = network.body
    kinetic = 0.5 * body.masses @ (body.velocities**2).sum(axis=1)
    return kinetic + elastic_energy(elastic_of(network.springs), body)


@pytest.mark.kernel
def test_a_motion_whose_velocities_are_reversed_returns():
    network = bent(0.01)
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
