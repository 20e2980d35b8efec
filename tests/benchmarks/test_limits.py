"""The machine is described, and bodies that do not fit its memory are omitted."""

from benchmarks.scaling import SHARE_OF_MEMORY, sizes_that_fit
from scalpel_sim.validate.speed.machine import cache_sizes, describe_machine, memory_bytes
from scalpel_sim.validate.speed.tables import Rows


def test_the_machine_is_described():
    found = describe_machine()
    assert found["processor"] and found["cores"] >= 1
    caches = cache_sizes()
    assert 0 < caches.l1 <= caches.l2 <= caches.l3
    assert memory_bytes() is None or 0 < memory_bytes() <= memory_bytes("MemTotal")


def test_bodies_that_do_not_fit_the_memory_are_omitted_with_a_reason():
    rows = Rows("made")
    assert sizes_that_fit((576, 6_000, 10**9), 2_000_000_000, rows) == (576, 6_000)
    (one,) = rows.skipped
    assert (one.benchmark, one.tetrahedra) == ("made", 10**9)
    assert "2.0 GB" in one.reason and f"{SHARE_OF_MEMORY:.0%}" in one.reason
    assert sizes_that_fit((576, 10**9), None, rows) == (576, 10**9) and len(rows.skipped) == 1
