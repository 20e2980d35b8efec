"""A proxy on a spring and a damper, and the damping that a sampled spring needs."""

import math

import numpy as np
import pytest

from bridge import VirtualCoupling
from bridge.coupling.virtual_coupling import Proxy, least_damping
from bridge.poses import moved
from tissue import BladeSegment

DT = 1e-3
UPRIGHT = BladeSegment(np.zeros(3), np.array([0.0, 0.0, 0.04]), np.array([0.0, 1.0, 0.0]))
FREE = np.zeros((6, 6))
MIDDLE = np.array([0.0, 0.0, 0.02])


def at(*displacement):
    return moved(UPRIGHT, np.array(displacement + (0.0,) * (6 - len(displacement))))


def middle(pose):
    return 0.5 * (pose.tip + pose.heel)


def test_in_free_air_the_proxy_is_where_the_arm_is_and_nothing_is_felt():
    proxy = Proxy(VirtualCoupling(), DT, UPRIGHT)
    for frame in range(50):
        arm = at(1e-4 * frame, 2e-4 * frame, 0.0, 0.002 * frame)
        assert proxy.follow(arm, np.zeros(6), FREE, DT) == pytest.approx(np.zeros(6), abs=1e-12)
        assert proxy.pose.tip == pytest.approx(arm.tip, abs=1e-6)
        assert proxy.pose.heel == pytest.approx(arm.heel, abs=1e-6)


def test_a_held_proxy_is_displaced_by_force_over_stiffness_and_the_arm_feels_the_force():
    """A force at the middle of the edge: it shifts the proxy and does not turn it."""
    proxy, load = Proxy(VirtualCoupling(stiffness=500.0), DT, UPRIGHT), np.array([0.0, -1.0, 0.0])
    wrench = np.concatenate([load, np.cross(MIDDLE, load)])
    for _ in range(200):
        felt = proxy.follow(UPRIGHT, wrench, FREE, DT)
    assert felt == pytest.approx(wrench)
    assert middle(proxy.pose) - MIDDLE == pytest.approx(load / 500.0, abs=1e-9)
    assert proxy.pose.tip - UPRIGHT.tip == pytest.approx(load / 500.0, abs=1e-6)


def test_the_arm_feels_spring_and_tissue_in_series():
    """Pressed 2 mm into tissue of 3 kN/m by a spring of 1 kN/m: 750 N/m."""
    proxy = Proxy(VirtualCoupling(stiffness=1e3), DT, UPRIGHT)
    tissue = np.diag([0.0, 3e3, 0.0, 0.0, 0.0, 0.0])
    to_middle = np.eye(6)
    to_middle[:3, 3:] = [[0.0, 0.02, 0.0], [-0.02, 0.0, 0.0], [0.0, 0.0, 0.0]]
    tissue = to_middle.T @ tissue @ to_middle
    for _ in range(300):
        depth = (middle(proxy.pose) - MIDDLE)[1]
        push = np.array([0.0, -3e3 * depth, 0.0])
        felt = proxy.follow(
            at(0.0, 2e-3), np.concatenate([push, np.cross(MIDDLE, push)]), tissue, DT
        )
    assert felt[1] == pytest.approx(-750.0 * 2e-3, rel=1e-6)


def test_a_wall_of_any_stiffness_stops_the_proxy_within_a_frame():
    """The balance is solved with the tissue's stiffness, so that no stiffness is too large."""
    proxy = Proxy(VirtualCoupling(), DT, UPRIGHT)
    wall = np.diag([1e6, 1e6, 1e6, 1e3, 1e3, 1e3])
    for frame in range(100):
        moved_by = np.concatenate([proxy.pose.tip, np.zeros(3)])
        felt = proxy.follow(at(0.0, 1e-5 * frame), -wall @ moved_by, wall, DT)
        assert abs(proxy.pose.tip[1]) < 1e-5
    assert felt[1] < 0.0


def test_values_that_are_not_given_follow_from_the_stiffness():
    spring, damper = VirtualCoupling(stiffness=1e3).matrices(lever=0.02, dt=DT)
    assert np.diag(spring) == pytest.approx([1e3] * 3 + [0.4] * 3)
    assert np.diag(damper) == pytest.approx([3.0] * 3 + [1.2e-3] * 3)


def test_too_little_damping_gets_a_warning_with_the_numbers(caplog):
    Proxy(VirtualCoupling(stiffness=1e3), DT, UPRIGHT)
    assert not caplog.records
    Proxy(VirtualCoupling(stiffness=1e3, damping=0.5), DT, UPRIGHT)
    assert "1000 N/m at 1 ms needs a damping of more than (1 + 1/2) K T = 1.5, and has 0.5" in (
        caplog.text
    )
    assert "lower the stiffness to 333" in caplog.text


@pytest.mark.parametrize("bad", [0.0, -1.0, math.nan, math.inf])
@pytest.mark.parametrize(
    "name", ["stiffness", "damping", "rotational_stiffness", "rotational_damping"]
)
def test_a_coupling_with_an_impossible_value_is_refused(name, bad):
    with pytest.raises(ValueError, match=f"the coupling's {name} is .*; it must be positive"):
        VirtualCoupling(**{name: bad})


# A mass on a spring whose force is held over each period T and is d periods late. Between two
# samples the motion of the mass with its damper b is integrated exactly:
#
#     m x'' + b x' = -K x(t_(k-d))       for t_k <= t < t_(k+1)


def largest_amplitudes(damping, delay, n_steps=100_000):
    """Return the amplitudes in the first and in the last tenth of the steps, 1 kg on 1 kN/m."""
    decay = math.exp(-damping * DT)
    glide = (1.0 - decay) / damping
    seen = [1.0] * (math.ceil(delay) + 1)
    x, v, amplitudes = 1.0, 0.0, [0.0, 0.0]
    first, last = n_steps // 10, n_steps - n_steps // 10
    for step in range(n_steps):
        # The mean over the last period is half a period late.
        late = seen[0] if delay == int(delay) else 0.5 * (seen[0] + seen[1])
        steady = -1e3 * late / damping
        x, v = x + steady * DT + (v - steady) * glide, steady + (v - steady) * decay
        seen = [*seen[1:], x]
        if step < first or step >= last:
            amplitudes[step >= last] = max(amplitudes[step >= last], abs(x))
    return amplitudes


@pytest.mark.parametrize("delay", [0, 0.5, 1])
def test_a_sampled_spring_needs_damping_of_delay_plus_a_half_times_stiffness_times_period(delay):
    least = least_damping(1e3, DT, delay)
    first, last = largest_amplitudes(1.1 * least, delay)
    assert last < 0.2 * first
    first, last = largest_amplitudes(0.8 * least, delay)
    assert last > 5.0 * first
