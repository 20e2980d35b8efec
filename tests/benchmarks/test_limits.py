"""The limits of the machine, and which of them limits a step."""

import numpy as np
import pytest

from benchmarks.roofline import (
    FLOPS_PER_CALL,
    StepTraffic,
    Triad,
    arithmetic_case,
    memory_level,
    roofline_bound,
    step_traffic,
    triads_by_level,
)
from benchmarks.scaling import SHARE_OF_MEMORY, sizes_that_fit
from benchmarks.timing import CPU, time_turn
from scalpel_sim.validate.speed.machine import (
    CacheSizes,
    cache_sizes,
    describe_machine,
    memory_bytes,
)

SIZES = CacheSizes(32_000, 1_000_000, 32_000_000)
BANDWIDTH = {"L1": 200e9, "L2": 100e9, "L3": 50e9, "memory": 10e9}


def test_the_level_is_the_smallest_cache_that_holds_the_body():
    at = {n: memory_level(n, SIZES) for n in (32_000, 32_001, 1_000_001, 32_000_001)}
    assert list(at.values()) == ["L1", "L2", "L3", "memory"]


def test_a_step_waits_for_bytes_or_for_operations_whichever_takes_longer():
    heavy = StepTraffic(n_springs=1, n_slots=2, n_bytes=5_000, n_flops=1_000, working_set=2_000_000)
    by_bytes = roofline_bound(heavy, BANDWIDTH, 100e9, SIZES)
    assert by_bytes.level == "L3"
    assert by_bytes.seconds == pytest.approx(100e-9)
    by_flops = roofline_bound(
        heavy._replace(working_set=20_000, n_flops=10_000), BANDWIDTH, 100e9, SIZES
    )
    assert by_flops.level == "L1"
    assert by_flops.seconds == pytest.approx(100e-9)


def test_a_step_is_counted_from_its_rows_and_nodes():
    two = step_traffic([7, 9], is_damped=False)  # one vector, and two of them
    assert (two.n_springs, two.n_slots) == (8, 8 + 16)
    three_elastic_sweeps = 3 * 20 * 24
    of_nodes = two.n_bytes - three_elastic_sweeps
    assert of_nodes > 0 and of_nodes == 2 * (of_nodes // 2)
    damped = step_traffic([7, 9], is_damped=True)
    assert damped.n_bytes - two.n_bytes > 12 * 24  # a sweep more, without rest pulls
    assert damped.n_flops > two.n_flops > 3 * 18 * 24


def test_a_triad_uses_the_bytes_that_it_states_and_adds_correctly():
    triad = Triad(48_000)
    triad.run(1)
    assert triad.n_bytes == 48_000 == 3 * triad._a.nbytes
    assert np.all(triad._a == 2.0)


def test_the_triad_of_a_cache_fits_in_it_and_that_of_memory_in_none():
    sizes = [triad.n_bytes for triad in triads_by_level(SIZES).values()]
    assert sizes == sorted(sizes)
    assert sizes[0] <= SIZES.l1 and sizes[1] <= SIZES.l2 and sizes[-1] > 2 * SIZES.l3


def test_a_core_does_more_than_one_operation_a_nanosecond():
    case = arithmetic_case()
    seconds = np.median(time_turn(case.run, 10, CPU, 0.01))
    assert 1e9 < FLOPS_PER_CALL / seconds < 1e13


def test_the_machine_is_described():
    found = describe_machine()
    assert found["processor"] and found["cores"] >= 1
    caches = cache_sizes()
    assert 0 < caches.l1 <= caches.l2 <= caches.l3
    assert memory_bytes() is None or 0 < memory_bytes() <= memory_bytes("MemTotal")


def test_bodies_that_do_not_fit_the_memory_are_omitted_with_a_reason():
    fit, skipped = sizes_that_fit((576, 6_000, 10**9), 2_000_000_000, "made")
    assert fit == (576, 6_000)
    (one,) = skipped
    assert (one.benchmark, one.tetrahedra) == ("made", 10**9)
    assert "2.0 GB" in one.reason and f"{SHARE_OF_MEMORY:.0%}" in one.reason
    assert sizes_that_fit((576, 10**9), None, "made") == ((576, 10**9), [])
