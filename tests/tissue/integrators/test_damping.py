"""Damping between steps: its order, its stability, and the energy that it takes."""

import numpy as np
import pytest

from tests.support import bodies
from tests.tissue.integrators.test_runge_kutta import (
    DAMPINGS,
    FREQUENCY,
    exact_state,
    first_unstable_step,
    growth_of,
    order,
)
from tests.tissue.kernels_of import elastic_of, network_of, oscillator
from tissue import block
from tissue.elasticity.energy import elastic_energy
from tissue.integrators.damping import LONGEST_INTERVAL
from tissue.integrators.methods import METHODS
from tissue.integrators.stability import DAMPING_LIMIT

pytestmark = pytest.mark.kernel

NAMES = [name for name, method in METHODS.items() if method.damps_between_steps]
STEPS = [40, 80, 160, 320]
INTERVALS = range(1, LONGEST_INTERVAL + 1)


def state_after_a_second(method, n, damping, interval=1):
    """Return x and x' of the oscillator of `exact_state`."""
    network = oscillator(FREQUENCY, **damping)
    network.body.positions[1, 0] = 1.3
    network.damped_between_steps(METHODS[method].number, 1.0 / n, n, interval=interval)
    return np.array([network.body.positions[1, 0] - 1.0, network.body.velocities[1, 0]])


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


@pytest.mark.parametrize("damping", DAMPED)
@pytest.mark.parametrize("interval", INTERVALS)
@pytest.mark.parametrize("method", NAMES)
def test_with_damping_between_steps_the_order_is_one(method, interval, damping):
    given = DAMPINGS[damping]
    errors = [error_with_rate(method, n, given, rate_of(given), interval) for n in STEPS]
    assert order(STEPS, errors) == pytest.approx(1.0, abs=0.05)


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
