"""The processor, its vector instructions, its clock, and the cores that a process may use."""

import pytest

from scalpel_sim.validate.speed import machine
from scalpel_sim.validate.speed.machine import (
    SIMD_LEVELS,
    machine_line,
    measured_clock,
    simd_level,
    usable_cores,
)


@pytest.mark.parametrize("level", SIMD_LEVELS)
def test_a_processor_with_all_extensions_of_a_level_is_of_that_level(level):
    flags = " ".join(SIMD_LEVELS[level])
    assert simd_level(flags) == level
    assert simd_level(f"{flags} fpu vme") == level


def test_a_processor_that_lacks_one_extension_is_of_the_level_below():
    v4 = SIMD_LEVELS["x86-64-v4"]
    assert simd_level(" ".join(v4 - {"avx512bw"})) == "x86-64-v3"
    assert simd_level(" ".join(v4 - {"fma"})) is None


@pytest.mark.parametrize(
    ("limit", "expected"), [("max 100000", 4.0), ("150000 100000", 1.5), ("900000 100000", 4.0)]
)
def test_a_container_may_use_a_part_of_the_cores(limit, expected, monkeypatch, tmp_path):
    file = tmp_path / "cpu.max"
    file.write_text(f"{limit}\n")
    monkeypatch.setattr(machine, "_CPU_LIMIT", file)
    monkeypatch.setattr(machine.os, "sched_getaffinity", lambda _: range(4), raising=False)
    assert usable_cores() == expected


def test_the_clock_is_that_of_a_processor():
    """From a slow embedded one to what no processor reaches."""
    assert 0.3e9 < measured_clock() < 10e9


def test_each_round_of_the_chain_waits_for_the_one_before():
    """Else the compiler could shorten it, and the clock would be too high: the sum is that of
    Python, and no closed form has it."""
    a, b = 5, 1
    for _ in range(1000):
        a = (a + b) % 2**64
        b ^= a
    assert machine._chain(1000, 5) % 2**64 == a


def test_the_machine_in_one_line_omits_what_is_not_known():
    known = {"processor": "Cray-1", "simd": "x86-64-v4", "clock_hz": 8e7, "cores": 1}
    assert machine_line(known) == "Cray-1, x86-64-v4, 0.1 GHz under load, 1 cores"
    unknown = known | {"simd": None, "clock_hz": None}
    assert machine_line(unknown) == "Cray-1, 1 cores"
