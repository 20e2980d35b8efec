"""Checks of what benchmarks measure."""

import math

from rich.console import Console

from scalpel_sim.validate.speed.measurements import HIGHER, LOWER


def is_sane(measured):
    """Check that a measurement has a unit, a clock, samples, and percentiles on the slow side."""
    assert measured.unit and measured.clock and measured.n >= measured.rounds >= 1
    assert all(map(math.isfinite, (measured.median, measured.p95, measured.p99)))
    assert measured.lowest <= measured.highest
    if measured.better == LOWER:
        assert 0.0 <= measured.median <= measured.p95 <= measured.p99
    if measured.better == HIGHER:
        assert measured.median >= measured.p95 >= measured.p99 > 0.0
    return True


def printed(result, capsys):
    result.show(Console(width=200))
    return capsys.readouterr().out
