"""Cases that find the limits of the processor: bytes per second from each cache, and arithmetic."""

import numpy as np

from benchmarks.engine import VECTOR_LENGTH, multiply_and_add, triad_pass
from benchmarks.timing import Case
from scalpel_sim.validate.speed.machine import CacheSizes

BYTES_PER_ELEMENT = 24
"""Bytes of an element of the triad: two doubles read, one written. The line that a store must fetch
first is not counted, as in McCalpin's STREAM."""
N_CHAINS = 8
"""Vectors that `multiply_and_add` updates in turn: an operation takes 4 cycles, and two may begin
in each cycle, so that fewer vectors would wait for their own results."""
N_LINKS = 1000
"""Updates of each vector in a call."""
FLOPS_PER_CALL = 2 * VECTOR_LENGTH * N_CHAINS * N_LINKS
"""Operations of a call: a multiplication and an addition for each number and update."""
BEYOND_CACHES = 3.0
"""Size of the largest triad, in sizes of the last cache: what it reads has been evicted since it
was read before."""


class Triad:
    """The loop a = b + s c over arrays that fill a number of bytes together."""

    def __init__(self, n_bytes: int) -> None:
        n = n_bytes // BYTES_PER_ELEMENT
        self.n_bytes = n * BYTES_PER_ELEMENT
        self._a, self._b, self._c = np.zeros(n), np.ones(n), np.ones(n)

    def run(self, n: int) -> None:
        """Run the loop `n` times."""
        triad_pass(self._a, self._b, self._c, n)


def triads_by_level(sizes: CacheSizes) -> dict[str, Triad]:
    """Return a triad for each level, by its name: half of a cache, and more than the last."""
    return {
        "L1": Triad(sizes.l1 // 2),
        "L2": Triad(sizes.l2 // 2),
        "L3": Triad(sizes.l3 // 4),
        "memory": Triad(round(BEYOND_CACHES * sizes.l3)),
    }


def memory_level(working_set: int, sizes: CacheSizes) -> str:
    """Return the level that feeds a loop over this many bytes."""
    for name, size in zip(("L1", "L2", "L3"), sizes, strict=True):
        if working_set <= size:
            return name
    return "memory"


def arithmetic_case() -> Case:
    """Return a case that only multiplies and adds, in the engine's own vectors."""
    values = np.zeros(N_CHAINS * VECTOR_LENGTH)
    return Case("multiply and add", lambda n: multiply_and_add(values, n * N_LINKS))
