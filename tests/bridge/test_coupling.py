import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.coupling import (
    ABSURD_FORCE,
    ABSURD_FRAMES_IN_A_ROW,
    Coupling,
    CouplingError,
    DeviceLimits,
)
from tissue.types import Wrench

TOUCH = DeviceLimits(force=3.3)
PREMIUM = DeviceLimits(force=8.5, torque=0.188)

components = st.floats(-900.0, 900.0)
vectors = st.tuples(components, components, components).map(np.array)
small_vectors = vectors.map(lambda v: v / 100.0)


def wrench(force=(0.0, 0.0, 0.0), torque=(0.0, 0.0, 0.0), point=(0.0, 0.0, 0.0)):
    return Wrench(np.array(force), np.array(torque), np.array(point))


def test_a_wrench_within_the_limits_is_felt_bit_for_bit():
    tissue = wrench((1.0, 0.2, -0.3), (0.01, 0.0, 0.02), (0.1, 0.2, 0.3))
    coupling = Coupling(PREMIUM)
    felt = coupling.felt(tissue, 1e-3)
    assert all(a.tobytes() == b.tobytes() for a, b in zip(tissue, felt, strict=True))
    assert coupling.n_force_limited == coupling.n_torque_limited == 0


@given(vectors, small_vectors)
def test_the_limits_hold_and_both_directions_are_kept(force, torque):
    felt = Coupling(PREMIUM).felt(wrench(force, torque), 1e-3)
    assert math.hypot(*felt.force) <= 8.5
    assert math.hypot(*felt.torque) <= 0.188
    np.testing.assert_allclose(np.cross(felt.force, force), 0.0, atol=1e-9)
    np.testing.assert_allclose(np.cross(felt.torque, torque), 0.0, atol=1e-9)
    assert felt.force @ force >= 0.0 and felt.torque @ torque >= 0.0


def test_a_wrench_that_is_made_shorter_keeps_its_line_of_action():
    felt = Coupling(TOUCH).felt(wrench((0.0, 0.0, 6.6), (0.2, 0.0, 0.0)), 1e-3)
    np.testing.assert_allclose(felt.force, [0.0, 0.0, 3.3])
    np.testing.assert_allclose(felt.torque, [0.1, 0.0, 0.0])


def test_every_saturation_is_counted():
    coupling = Coupling(PREMIUM)
    coupling.felt(wrench((9.0, 0.0, 0.0)), 1e-3)
    coupling.felt(wrench((9.0, 0.0, 0.0), (0.3, 0.0, 0.0)), 1e-3)
    coupling.felt(wrench((8.0, 0.0, 0.0)), 1e-3)
    assert (coupling.n_force_limited, coupling.n_torque_limited) == (2, 1)


@given(st.lists(st.tuples(vectors, small_vectors), min_size=1, max_size=20))
def test_no_profile_changes_the_force_faster_than_the_slew_limit(profile):
    coupling = Coupling(DeviceLimits(force=8.5, torque=0.188, slew=1000.0))
    before = np.zeros(3)
    for force, torque in profile:
        felt = coupling.felt(wrench(force, torque), 1e-3)
        assert math.hypot(*(felt.force - before)) <= 1.0 + 1e-9
        assert math.hypot(*felt.force) <= 8.5
        assert math.hypot(*felt.torque) <= 0.188
        before = felt.force


def test_a_slewing_force_arrives():
    coupling = Coupling(DeviceLimits(slew=1000.0))
    felt = [coupling.felt(wrench((2.5, 0.0, 0.0)), 1e-3).force[0] for _ in range(4)]
    np.testing.assert_allclose(felt, [1.0, 2.0, 2.5, 2.5])
    assert coupling.n_slew_limited == 2


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("where", ["force", "torque", "point"])
def test_what_is_not_finite_never_gets_out_and_is_counted(bad, where):
    coupling = Coupling(TOUCH)
    with pytest.raises(CouplingError, match="not finite"):
        coupling.felt(wrench(**{where: (0.0, bad, 0.0)}), 1e-3)
    assert coupling.n_not_finite == 1


@pytest.mark.parametrize("force", [ABSURD_FORCE * 1.01, 1e9, 1e200])
def test_an_absurd_wrench_is_felt_as_zero_and_counted(force):
    coupling = Coupling(DeviceLimits())
    felt = coupling.felt(wrench((force, 0.0, 0.0), (0.1, 0.0, 0.0)), 1e-3)
    assert not felt.force.any() and not felt.torque.any()
    assert coupling.n_absurd == 1


def test_a_tissue_that_stays_absurd_ends_the_run_after_ten_frames():
    coupling = Coupling(TOUCH)
    for _ in range(ABSURD_FRAMES_IN_A_ROW - 1):
        coupling.felt(wrench((1e6, 0.0, 0.0)), 1e-3)
    with pytest.raises(CouplingError, match=r"10 frames in a row.*1e\+06 N"):
        coupling.felt(wrench((1e6, 0.0, 0.0)), 1e-3)


def test_a_tissue_that_comes_to_its_senses_starts_the_count_again():
    coupling = Coupling(TOUCH)
    for frame in range(5 * ABSURD_FRAMES_IN_A_ROW):
        coupling.felt(wrench((1e6 if frame % 5 else 1.0, 0.0, 0.0)), 1e-3)
    assert coupling.n_absurd == 4 * ABSURD_FRAMES_IN_A_ROW


@pytest.mark.parametrize("limit", [0.0, -1.0, np.nan])
def test_a_limit_that_is_not_positive_is_refused(limit):
    with pytest.raises(ValueError, match="the limit of force is"):
        DeviceLimits(force=limit)
