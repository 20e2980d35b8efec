"""Energy at the arm's blade: the observer counts it, and the controller dissipates it."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge import DeviceLimits
from bridge.arithmetic import ENERGY_TOLERANCE
from bridge.coupling.passivity import Passivity, Travel
from bridge.coupling.virtual_coupling import least_damping
from bridge.poses import six

DT = 1e-3
LEVER = 0.02
PREMIUM = DeviceLimits(force=8.5, torque=0.188)
LOWEST_ENERGY = -1e-6
"""Energy below which the count may not fall [J]."""


def along_x(value):
    return np.array([value, 0.0, 0.0, 0.0, 0.0, 0.0])


class Mass:
    """A mass on a rail, moved as MuJoCo moves an arm: x_(n+1) = x_n + h v_(n+1)."""

    def __init__(self, mass, x=0.0, v=0.0, damping=0.0):
        self.mass, self.x, self.v, self.damping = mass, x, v, damping

    def push(self, force):
        self.v += DT * (force - self.damping * self.v) / self.mass
        self.x += DT * self.v

    @property
    def energy(self):
        return 0.5 * self.mass * self.v**2


def corrected(passivity, wanted, displacement, given=0.0):
    travel = Travel(six(displacement), LEVER, given)
    numbers = six(wanted)
    felt = passivity.correct(numbers, travel)
    passivity.record(felt, numbers, travel)
    return np.array(felt)


@pytest.mark.parametrize("stiffness", [50.0, 5e3])
def test_the_energy_that_is_counted_is_the_one_that_the_arm_loses(stiffness):
    """A mass runs into a spring and back; the energies are equal to rounding in every frame."""
    passivity, arm, before = Passivity(acts=False), Mass(0.05, -1e-4, 0.1), -1e-4
    start = arm.energy
    for _ in range(300):
        force = -stiffness * max(arm.x, 0.0)
        felt = corrected(passivity, along_x(force), along_x(arm.x - before))
        # The new wrench also does work over half of the next frame.
        pending = 0.5 * DT * felt[0] * arm.v
        before = arm.x
        lost = start - arm.energy
        if force:
            assert passivity.counters.energy == pytest.approx(lost - pending, abs=1e-15)
        arm.push(felt[0])


def bounce(acts):
    """Bounce a mass off a spring whose force is a frame late; return mass, forces and counters."""
    passivity, arm, before, late = Passivity(acts=acts), Mass(0.05, -1e-4, 0.1), -1e-4, 0.0
    forces = []
    for _ in range(100):
        forces.append(corrected(passivity, along_x(late), along_x(arm.x - before))[0])
        before, late = arm.x, -5e3 * max(arm.x, 0.0)
        arm.push(forces[-1])
    return arm, np.array(forces), passivity.counters


def test_an_arm_that_bounces_off_a_late_spring_gains_energy_unless_the_controller_acts():
    start = Mass(0.05, v=0.1).energy
    free, _, counted = bounce(acts=False)
    assert free.energy > 1.2 * start
    assert counted.least_energy == pytest.approx(start - free.energy, rel=1e-9)
    assert counted.frames == counted.injected_away == 0
    damped, _, counters = bounce(acts=True)
    assert damped.energy <= start - LOWEST_ENERGY
    assert counters.least_energy >= LOWEST_ENERGY
    assert counters.injected_away > 0.1 * start and counters.frames > 0


def test_the_controller_lets_a_force_fade_instead_of_reversing_it():
    """The small force that pulls back is due to the speed that the arm gains within a frame."""
    _, forces, _ = bounce(acts=True)
    assert forces.max() < 0.2 * -forces.min()


components = st.floats(-1.0, 1.0)
sixes = st.tuples(*[components] * 6).map(np.array)
frames = st.lists(st.tuples(sixes, sixes), min_size=1, max_size=40)


@given(frames)
def test_no_wrench_and_no_motion_generate_energy_or_exceed_a_limit(profile):
    passivity = Passivity(PREMIUM)
    for wanted, displacement in profile:
        wanted = wanted * np.repeat([8.5 / math.sqrt(3.0), 0.188 / math.sqrt(3.0)], 3)
        felt = corrected(passivity, wanted, displacement * np.repeat([1e-3, 0.05], 3))
        assert PREMIUM.allow(felt * (1.0 - 1e-12))
        assert passivity.counters.energy >= LOWEST_ENERGY
    assert passivity.counters.least_energy >= LOWEST_ENERGY


@given(frames)
def test_a_wrench_that_generates_no_energy_passes_bit_for_bit(profile):
    """A damper only dissipates."""
    passivity, before = Passivity(), np.zeros(6)
    for _, displacement in profile:
        wanted = -0.5 * (displacement + before)
        if wanted @ displacement > 0.0 or before @ displacement < 0.0:
            continue
        assert corrected(passivity, wanted, displacement).tobytes() == wanted.tobytes()
        before = displacement
    assert passivity.counters.frames == 0


def test_energy_that_the_tissue_itself_returns_is_allowed():
    """A flap that lies on the blade pushes it down: the tissue itself reports the work."""
    passivity, work = Passivity(), 0.0
    for _ in range(100):
        work -= 1.0 * 1e-4
        assert corrected(passivity, along_x(1.0), along_x(1e-4), work)[0] == 1.0
    assert passivity.counters.frames == 0
    assert (
        corrected(passivity, along_x(1.0), along_x(1e-4), work)[0] < 1.0
    )  # the tissue did no work


def test_the_energy_count_starts_again_where_no_wrench_acts():
    passivity = Passivity()
    for _ in range(10):
        corrected(passivity, along_x(-1.0), along_x(1e-3))  # as in a cut: 1 mJ a frame
    assert passivity.counters.energy == pytest.approx(9.5e-3)
    for _ in range(2):
        corrected(passivity, along_x(0.0), along_x(1e-3))
    assert passivity.counters.energy == 0.0
    out = [corrected(passivity, along_x(1.0), along_x(1e-3))[0] for _ in range(10)]
    assert sum(out) * 1e-3 <= 2.0 * ENERGY_TOLERANCE


@pytest.mark.parametrize("delay", [0, 1])
def test_a_spring_without_its_damping_stays_bounded_under_the_controller(delay):
    """With 0.8 of the damping that a sampled spring needs, the spring alone is unstable."""
    stiffness = 1e3
    passivity = Passivity()
    arm = Mass(0.05, x=1e-3, damping=0.8 * least_damping(stiffness, DT, delay))
    seen = [arm.x] * (delay + 1)
    for _ in range(20_000):
        displacement = along_x(arm.x - seen[-1])
        seen = [*seen[1:], arm.x]
        arm.push(corrected(passivity, along_x(-stiffness * seen[-1 - delay]), displacement)[0])
        assert abs(arm.x) < 2e-3
    assert passivity.counters.least_energy >= LOWEST_ENERGY
