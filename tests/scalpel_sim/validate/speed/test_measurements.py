"""One format for all measurements, and the verdicts of a comparison of two runs."""

import json

import numpy as np
import pytest
from msgspec.structs import replace
from rich.console import Console

from scalpel_sim.errors import UsageError
from scalpel_sim.validate.speed.measurements import (
    FORMAT,
    HIGHER,
    LOWER,
    NEITHER,
    BenchmarkResult,
    Quantity,
    Skipped,
    collect_results,
    load_results,
    results_as_json,
    summarise_times,
    summarise_values,
)
from scalpel_sim.validate.speed.tables import (
    FASTER,
    NOT_COMPARED,
    SAME,
    SLOWER,
    TOO_FEW,
    compare_measurements,
    print_comparison,
)


def measured(rounds, case="step", better=LOWER, convert=lambda seconds: 1e6 * seconds):
    quantity = Quantity("made", case, 576, "time", "µs", "CPU", better)
    return summarise_times(quantity, [np.array(r) for r in rounds], convert)


def rate(tetrahedra, values):
    quantity = Quantity("made", "frames", tetrahedra, "rate", "1/s", "wall", HIGHER)
    return summarise_values(quantity, values)


def run(seconds, n_rounds=5, spread=0.02):
    """Return a measurement of rounds around a time [s], each with its own median."""
    around = seconds * (1.0 + spread * np.linspace(-1.0, 1.0, n_rounds))
    return measured([[0.99 * s, s, 1.01 * s] for s in around])


def verdict(before, now):
    (comparison,) = compare_measurements([before], [now])
    return comparison.verdict


def test_a_measurement_has_the_median_the_slow_samples_and_the_range_of_the_rounds():
    made = measured([np.linspace(1e-6, 100e-6, 100), np.full(3, 2e-6)])
    assert made.median == pytest.approx(np.median([*range(1, 101), 2, 2, 2]))
    assert 90.0 < made.p95 < made.p99 < 100.0
    assert (made.lowest, made.highest) == (pytest.approx(2.0), pytest.approx(50.5))
    assert (made.n, made.rounds) == (103, 2)


def test_the_slow_samples_of_a_rate_are_the_low_ones():
    made = measured([np.linspace(1.0, 2.0, 101)], better=HIGHER, convert=lambda s: 100.0 / s)
    assert made.p99 < made.p95 < made.median
    assert rate(None, [1.0, 2.0, 9.0]).p99 < 2.0


def test_what_is_saved_is_read_again_to_the_last_bit(tmp_path):
    skipped = Skipped("made", "large", 10**6, "too large for this memory")
    before = collect_results([BenchmarkResult([run(1.23456789e-6)], [skipped], print)], 0.25)
    file = tmp_path / "before.json"
    file.write_text(results_as_json(before))
    assert load_results(file) == before
    assert before.machine["processor"] and before.versions["numba"]


def test_a_slowdown_is_found():
    assert verdict(run(1e-6), run(1.3e-6)) == SLOWER
    assert verdict(run(1.3e-6), run(1e-6)) == FASTER
    (comparison,) = compare_measurements([run(1e-6)], [run(2e-6)])
    assert comparison.ratio == pytest.approx(0.5)


def test_what_lies_within_the_spread_gets_no_verdict():
    assert verdict(run(1e-6, spread=0.5), run(1.3e-6, spread=0.5)) == SAME
    assert verdict(run(1e-6, spread=0.001), run(1.05e-6, spread=0.001)) == SAME
    assert verdict(run(1e-6, n_rounds=3), run(2e-6)) == TOO_FEW


def test_a_higher_rate_is_faster_and_a_share_is_neither():
    slow, fast = (rate(48, [value] * 5) for value in (10.0, 20.0))
    assert verdict(slow, fast) == FASTER
    assert compare_measurements([slow], [fast])[0].ratio == pytest.approx(2.0)
    assert verdict(*(replace(each, better=NEITHER) for each in (slow, fast))) == NOT_COMPARED


def test_only_the_same_case_in_the_same_body_is_compared():
    assert compare_measurements([measured([[1.0]], case="another")], [measured([[1.0]])]) == []
    assert (
        compare_measurements([replace(measured([[1.0]]), tetrahedra=48)], [measured([[1.0]])]) == []
    )


@pytest.mark.parametrize(("clock", "differs"), [(4.1e9, False), (3.0e9, True)])
def test_a_clock_differs_where_it_does_by_more_than_measurements_do(clock, differs, capsys):
    result = BenchmarkResult([run(1e-6)], [], print)
    before, now = (collect_results([result], 0.0, each) for each in (4e9, clock))
    print_comparison(before, now, Console(width=1000))
    assert ("The machine differs: clock_hz was" in capsys.readouterr().out) == differs


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        (None, "cannot be read"),
        ("no JSON", "is not JSON"),
        ("[]", "no results file of this version"),
        (json.dumps({"format": "another 1"}), "no results file of this version"),
        (json.dumps({"format": FORMAT, "figures": [{}]}), "parts missing"),
        (json.dumps({"format": FORMAT}), "parts missing"),
    ],
)
def test_an_invalid_results_file_is_refused_by_name(content, expected, tmp_path):
    file = tmp_path / "before.json"
    if content is not None:
        file.write_text(content)
    with pytest.raises(UsageError, match=f"before.json.*{expected}"):
        load_results(file)
