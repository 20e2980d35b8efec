import itertools

import pytest

from bridge.coupling.coupling import DECAY_AFTER, RAMP, WARN_AFTER, ZERO_AFTER, Watchdog

DT = 1e-3


def silent_for(watchdog, seconds):
    """Return the gain in each millisecond of a silence."""
    return [watchdog.gain((i + 1) * DT, DT) for i in range(round(seconds / DT))]


def test_the_gain_of_a_tissue_that_answers_is_one():
    watchdog = Watchdog()
    assert [watchdog.gain(0.0, DT) for _ in range(10)] == [1.0] * 10
    assert watchdog.n_silent == watchdog.n_faded == 0


def test_a_silence_gets_one_warning_and_is_counted_from_10_ms_on(caplog):
    watchdog = Watchdog()
    silent_for(watchdog, 0.020)
    assert watchdog.n_silent == 11
    assert len(caplog.records) == 1 and "has not answered for 10 ms" in caplog.text
    watchdog.gain(0.0, DT)
    silent_for(watchdog, 0.020)
    assert len(caplog.records) == 2


def test_the_wrench_fades_from_50_ms_on_and_is_zero_at_500():
    gains = silent_for(Watchdog(), 0.6)
    assert set(gains[:50]) == {1.0}
    assert gains[274] == pytest.approx(0.5)
    assert all(later < earlier for earlier, later in itertools.pairwise(gains[49:500]))
    assert set(gains[499:]) == {0.0}
    assert (WARN_AFTER, DECAY_AFTER, ZERO_AFTER) == (0.010, 0.050, 0.500)


def test_a_wrench_returns_along_a_ramp():
    watchdog = Watchdog()
    silent_for(watchdog, 0.6)
    back = [watchdog.gain(0.0, DT) for _ in range(round(RAMP / DT) + 5)]
    assert back[0] == pytest.approx(DT / RAMP)
    assert max(b - a for a, b in itertools.pairwise(back)) <= DT / RAMP + 1e-12
    assert back[-1] == 1.0
    assert watchdog.n_faded == 550 + round(RAMP / DT) - 1


def test_after_a_reset_a_wrench_returns_along_a_ramp_too():
    watchdog = Watchdog()
    watchdog.reset()
    assert watchdog.gain(0.0, DT) == pytest.approx(DT / RAMP)
