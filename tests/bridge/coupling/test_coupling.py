import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge import CouplingError
from bridge.arithmetic import PLAIN, compiled_arithmetic
from bridge.coupling.coupling import (
    MAX_IMPLAUSIBLE_FRAMES,
    MAX_PLAUSIBLE_FORCE,
    MAX_PLAUSIBLE_SPEED,
    Coupling,
    expect_plausible_motion,
)
from bridge.coupling.limits import DeviceLimits
from bridge.coupling.passivity import Travel
from bridge.poses import six
from tissue import Wrench

TOUCH = DeviceLimits(force=3.3)
PREMIUM = DeviceLimits(force=8.5, torque=0.188)

components = st.floats(-900.0, 900.0)
vectors = st.tuples(components, components, components).map(np.array)
small_vectors = vectors.map(lambda v: v / 100.0)


def wrench(force=(0.0, 0.0, 0.0), torque=(0.0, 0.0, 0.0), point=(0.0, 0.0, 0.0)):
    return Wrench(np.array(force), np.array(torque), np.array(point))


AT_REST = Travel((0.0,) * 6, 0.0, 0.0)


def render(coupling, tissue, dt, travel=AT_REST, silence=0.0):
    """Return the wrench that the arm feels for the next `dt` [s]."""
    numbers = six(np.concatenate([tissue.force, tissue.torque]))
    felt = coupling.felt(numbers, tissue.point.tolist(), dt, travel, silence)
    return Wrench(np.array(felt[:3]), np.array(felt[3:]), tissue.point)


def test_a_wrench_within_the_limits_is_felt_bit_for_bit():
    tissue = wrench((1.0, 0.2, -0.3), (0.01, 0.0, 0.02), (0.1, 0.2, 0.3))
    coupling = Coupling(PREMIUM)
    felt = render(coupling, tissue, 1e-3)
    assert all(a.tobytes() == b.tobytes() for a, b in zip(tissue, felt, strict=True))
    assert coupling.n_force_limited == coupling.n_torque_limited == 0


@given(vectors, small_vectors)
def test_the_limits_hold_and_both_directions_are_kept(force, torque):
    felt = render(Coupling(PREMIUM), wrench(force, torque), 1e-3)
    assert math.hypot(*felt.force) <= 8.5
    assert math.hypot(*felt.torque) <= 0.188
    np.testing.assert_allclose(np.cross(felt.force, force), 0.0, atol=1e-9)
    np.testing.assert_allclose(np.cross(felt.torque, torque), 0.0, atol=1e-9)
    assert felt.force @ force >= 0.0 and felt.torque @ torque >= 0.0


def test_every_saturation_is_counted():
    coupling = Coupling(PREMIUM)
    render(coupling, wrench((9.0, 0.0, 0.0)), 1e-3)
    render(coupling, wrench((9.0, 0.0, 0.0), (0.3, 0.0, 0.0)), 1e-3)
    render(coupling, wrench((8.0, 0.0, 0.0)), 1e-3)
    assert (coupling.n_force_limited, coupling.n_torque_limited) == (2, 1)


motions = st.tuples(*[st.floats(-1e-4, 1e-4)] * 3, *[st.floats(-0.01, 0.01)] * 3)
frames = st.tuples(vectors, small_vectors, motions, st.sampled_from([0.0, 0.0, 0.06, 0.3, 1.0]))


@given(st.lists(frames, min_size=1, max_size=20))
def test_no_profile_exceeds_a_limit_or_changes_the_force_faster_than_the_slew_limit(profile):
    """With the passivity controller, and a tissue that is silent at times."""
    coupling = Coupling(DeviceLimits(force=8.5, torque=0.188, slew=1000.0))
    before = np.zeros(3)
    for force, torque, motion, silence in profile:
        travel = Travel(motion, 0.02, 0.0)
        felt = render(coupling, wrench(force, torque), 1e-3, travel, silence)
        assert math.hypot(*(felt.force - before)) <= 1.0 + 1e-9
        assert math.hypot(*felt.force) <= 8.5
        assert math.hypot(*felt.torque) <= 0.188
        before = felt.force


@pytest.mark.parametrize("is_compiled", [False, True])
def test_a_wrench_that_passes_is_counted_as_one_that_is_felt(is_compiled):
    """Forces around the limit, motions that would gain energy, and a tissue that is silent once."""
    rng, arithmetic = np.random.default_rng(2), compiled_arithmetic() if is_compiled else PLAIN
    short = Coupling(PREMIUM, arithmetic=arithmetic)
    exact = Coupling(PREMIUM, arithmetic=arithmetic)
    n_passed = 0
    for i in range(400):
        tissue = six(np.concatenate([rng.normal(0.0, 4.0, 3), rng.normal(0.0, 0.08, 3)]))
        motion = six(np.concatenate([rng.normal(0.0, 1e-4, 3), rng.normal(0.0, 1e-3, 3)]))
        travel, silence = Travel(motion, 0.02, -1e-4 * i), 0.06 if i == 100 else 0.0
        rest = (0.0, 0.0, 0.0), 1e-3, travel, silence
        felt = exact.felt(tissue, *rest)
        passed = short.passes(tissue, motion, travel.work_on_tissue, silence)
        n_passed += passed
        assert felt == (tissue if passed else short.felt(tissue, *rest))
        assert short.passivity == exact.passivity
    assert 100 < n_passed < 300 and short.passivity.frames > 0
    assert (short.n_force_limited, short.n_faded) == (exact.n_force_limited, exact.n_faded)


def test_a_force_limited_in_its_rate_reaches_its_value():
    coupling = Coupling(DeviceLimits(slew=1000.0))
    felt = [render(coupling, wrench((2.5, 0.0, 0.0)), 1e-3).force[0] for _ in range(4)]
    np.testing.assert_allclose(felt, [1.0, 2.0, 2.5, 2.5])
    assert coupling.n_slew_limited == 2


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("where", ["force", "torque", "point"])
def test_a_wrench_that_is_not_finite_is_never_rendered_and_is_counted(bad, where):
    coupling = Coupling(TOUCH)
    with pytest.raises(CouplingError, match="not finite"):
        render(coupling, wrench(**{where: (0.0, bad, 0.0)}), 1e-3)
    assert coupling.n_not_finite == 1


@pytest.mark.parametrize("force", [MAX_PLAUSIBLE_FORCE * 1.01, 1e9, 1e200])
def test_an_implausible_wrench_is_felt_as_zero_and_counted(force):
    coupling = Coupling(DeviceLimits())
    felt = render(coupling, wrench((force, 0.0, 0.0), (0.1, 0.0, 0.0)), 1e-3)
    assert not felt.force.any() and not felt.torque.any()
    assert coupling.n_implausible == 1


def test_a_tissue_that_stays_implausible_ends_the_run_after_ten_frames():
    coupling = Coupling(TOUCH)
    for _ in range(MAX_IMPLAUSIBLE_FRAMES - 1):
        render(coupling, wrench((1e6, 0.0, 0.0)), 1e-3)
    with pytest.raises(CouplingError, match=r"10 frames in a row.*1e\+06 N"):
        render(coupling, wrench((1e6, 0.0, 0.0)), 1e-3)


def test_a_plausible_wrench_starts_the_count_again():
    coupling = Coupling(TOUCH)
    for frame in range(5 * MAX_IMPLAUSIBLE_FRAMES):
        render(coupling, wrench((1e6 if frame % 5 else 1.0, 0.0, 0.0)), 1e-3)
    assert coupling.n_implausible == 4 * MAX_IMPLAUSIBLE_FRAMES


@pytest.mark.parametrize("limit", [0.0, -1.0, np.nan])
def test_a_limit_that_is_not_positive_is_refused(limit):
    with pytest.raises(ValueError, match="the limit of force is"):
        DeviceLimits(force=limit)


def test_the_wrench_of_a_silent_tissue_fades_and_returns_along_a_ramp():
    coupling, dt = Coupling(TOUCH), 1e-3
    for frame in range(600):
        felt = render(coupling, wrench((0.0, 2.0, 0.0)), dt, silence=frame * dt)
        if frame in (0, 49, 275, 500):
            allowed = {0: 2.0, 49: 2.0, 275: 1.0, 500: 0.0}[frame]
            assert felt.force[1] == pytest.approx(allowed)
    back = [render(coupling, wrench((0.0, 2.0, 0.0)), dt).force[1] for _ in range(110)]
    assert back[0] == pytest.approx(0.02) and back[-1] == 2.0
    assert coupling.n_silent == 590


def test_a_silence_gets_one_warning_and_is_counted_from_10_ms_on(caplog):
    coupling = Coupling(TOUCH)
    for n_silences in (1, 2):
        for frame in range(21):
            render(coupling, wrench((0.0, 2.0, 0.0)), 1e-3, silence=1e-3 * frame)
        assert coupling.n_silent == 11 * n_silences
        assert caplog.text.count("has not answered for 10 ms") == n_silences
        render(coupling, wrench((0.0, 2.0, 0.0)), 1e-3)
    assert coupling.n_faded == 0


def test_after_an_implausible_wrench_the_force_returns_along_a_ramp():
    coupling = Coupling(TOUCH)
    render(coupling, wrench((1e6, 0.0, 0.0)), 1e-3)
    felt = [render(coupling, wrench((1.0, 0.0, 0.0)), 1e-3).force[0] for _ in range(110)]
    assert felt[0] == pytest.approx(0.02) and felt[49] == pytest.approx(0.51) and felt[-1] == 1.0


@pytest.mark.parametrize("dt", [1e-3, 1e-2])
def test_a_blade_that_no_hand_moves_so_is_refused(dt):
    far = 0.999 * MAX_PLAUSIBLE_SPEED * dt
    expect_plausible_motion((0.6 * far, 0.8 * far, 0.0, 0.9, 0.9, 0.9), dt)
    for motion in ((0.7 * far, 0.8 * far, 0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0, 1.0, 1.0)):
        with pytest.raises(CouplingError, match="Move the arm there by a path, or make another"):
            expect_plausible_motion(motion, dt)
