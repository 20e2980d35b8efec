"""Terms of an instrument against a force and a way that are known."""

import numpy as np
import pytest

from scalpel_sim.scoring.hand_terms import HandTerms
from tissue import Wrench

DT = 0.02


def wrench(*force):
    return Wrench(np.array(force, float), np.zeros(3), np.zeros(3))


def led_along(way, seconds=1.0, **settings):
    """Return the terms of an instrument that was led along a way over time."""
    hand = HandTerms("left", None, **({"can_hold": True} | settings))
    for i in range(round(seconds / DT) + 1):
        hand.move(way(DT * i), False, DT)
    return hand


def test_force_has_a_peak_an_excess_and_an_integral():
    hand = HandTerms("blade", 2.0, can_hold=False)
    for i in range(1000):
        hand.feel(wrench(0.0, 3.0 * np.sin(np.pi * i / 1000), 0.0), 1e-3)
    assert hand.force == pytest.approx(3.0, rel=1e-4)
    assert hand.force_above == pytest.approx(1.0, rel=1e-4)
    assert hand.impulse == pytest.approx(6.0 / np.pi, rel=1e-4)
    assert hand.held is None


def test_without_a_limit_nothing_is_an_excess():
    hand = HandTerms("blade", None, can_hold=False)
    hand.feel(wrench(9.0, 0.0, 0.0), 1e-3)
    assert hand.force_above == 0.0


def test_a_circle_has_its_length_and_the_jerk_of_its_radius_and_speed():
    rate, radius = 2.0, 0.05
    hand = led_along(lambda t: (radius * np.cos(rate * t), radius * np.sin(rate * t), 0.0), 3.0)
    assert hand.path_length == pytest.approx(3.0 * rate * radius, rel=0.01)
    assert hand.jerk == pytest.approx(radius * rate**3, rel=0.01)


def test_the_polynomial_of_a_jerk_has_it_and_even_motion_has_none():
    assert led_along(lambda t: (7.0 * t**3 / 6.0, 0.0, 0.0)).jerk == pytest.approx(7.0, rel=1e-6)
    assert led_along(lambda t: (0.1 * t, 0.0, 0.2 * t)).jerk == pytest.approx(0.0, abs=1e-6)


def test_a_hold_is_a_share_of_the_time_and_a_loss_counts_once():
    hand = HandTerms("left", None, can_hold=True)
    for holds in [False] * 5 + [True] * 10 + [False] * 3 + [True] * 2:
        hand.move((0.0, 0.0, 0.0), holds, DT)
    assert hand.held == 12 / 20
    assert hand.dropped == 1
