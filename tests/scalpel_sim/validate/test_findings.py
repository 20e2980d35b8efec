import math

import pytest

from scalpel_sim.validate.findings import FAIL, KNOWN, PASS, THEORY, Check, KnownDeviation, within

EXPLAINED = KnownDeviation(0.8, "the reason")


@pytest.mark.parametrize(
    ("value", "known", "verdict"),
    [
        (1.0, None, PASS),
        (0.95, None, PASS),
        (0.94, None, FAIL),
        (1.06, None, FAIL),
        (0.80, EXPLAINED, KNOWN),
        (0.785, EXPLAINED, KNOWN),
        (0.78, EXPLAINED, FAIL),
        (0.82, EXPLAINED, FAIL),
        (1.06, EXPLAINED, FAIL),
        (1.00, EXPLAINED, PASS),
        (math.nan, EXPLAINED, FAIL),
        (math.inf, None, FAIL),
    ],
)
def test_a_check_passes_within_its_bounds_and_is_known_within_two_percent_of_what_was_measured(
    value, known, verdict
):
    check = Check("a value", value, *within(0.05), basis=THEORY, known=known)
    assert check.verdict == verdict


def test_within_is_a_share_of_the_expected_value():
    assert within(0.1, 164.0) == pytest.approx((147.6, 180.4))
