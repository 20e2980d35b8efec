"""The bridge's plain floats against the same rules in NumPy."""

import numpy as np
import pytest

from bridge import DeviceLimits
from bridge.arithmetic import compiled_arithmetic
from bridge.coupling.coupling import Coupling
from bridge.coupling.passivity import Travel
from bridge.poses import motion, pose_of, six
from tests.bridge.coupling.naive_coupling import NaiveCoupling, naive_motion
from tissue import BladeSegment

DT, LEVER = 1e-3, 0.02
LIMITS = {
    "none": DeviceLimits(),
    "force and torque": DeviceLimits(force=2.0, torque=0.05),
    "all": DeviceLimits(force=2.0, torque=0.05, slew=500.0),
}


def random_pose(rng):
    edge, forward = 0.04 * np.linalg.qr(rng.normal(size=(3, 3)))[0][:2]
    tip = rng.normal(size=3)
    tilted = forward + 0.3 * edge
    return BladeSegment(tip, tip + edge, tilted / np.linalg.norm(tilted))


@pytest.mark.parametrize("seed", range(5))
def test_a_motion_is_that_of_the_rotation_matrix(seed):
    rng = np.random.default_rng(seed)
    before, after = random_pose(rng), random_pose(rng)
    expected = naive_motion(before, after)
    assert motion(before, after) == pytest.approx(expected, abs=1e-9)
    one, other = pose_of(before), pose_of(after)
    again = compiled_arithmetic().motion.call(one.tip, one.axes, other.tip, other.axes)
    assert again == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize("limits", LIMITS)
@pytest.mark.parametrize("seed", range(5))
def test_a_coupling_renders_what_its_rules_say(limits, seed):
    """Free air, contacts, silences, implausible wrenches, pushes that give energy and take it."""
    rng = np.random.default_rng(seed)
    coupling, naive = Coupling(LIMITS[limits]), NaiveCoupling(LIMITS[limits], DT)
    stiffness, silence, work, n_felt = 0.0, 0.0, 0.0, 0
    for i in range(2000):
        if i % 50 == 0:
            stiffness = rng.choice([0.0, 300.0, 3000.0])
            resting, velocity = rng.normal(size=6) * 1e-3, 0.05 * rng.normal(size=6)
            is_silent, position = rng.uniform() < 0.1, np.zeros(6)
        step = DT * (velocity + 0.02 * rng.normal(size=6))
        position = position + step
        lever = np.repeat([1.0, LEVER**2], 3)
        wrench = -stiffness * lever * (position - resting)
        if rng.uniform() < 0.01:
            wrench = wrench + np.array([2e3, 0.0, 0.0, 0.0, 0.0, 0.0])
        silence = silence + 20.0 * DT if is_silent else 0.0
        work += 1e-5 * rng.normal() * (stiffness > 0.0)
        expected = naive.render(wrench, step, LEVER, work, silence)
        tip = rng.normal(size=3).tolist()
        travel = Travel(six(step), LEVER, work)
        felt = np.array(coupling.felt(six(wrench), tip, DT, travel, silence))
        assert felt == pytest.approx(expected, rel=1e-9, abs=1e-9)
        naive.felt = felt  # so that rounding does not add up
        n_felt += bool(felt.any())
    assert coupling.passivity.frames > 10 and n_felt > 500
    assert (coupling.n_force_limited > 10) == (limits != "none")
    assert coupling.n_implausible > 5 and coupling.n_faded > 10
