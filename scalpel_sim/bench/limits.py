"""What the processor can do at best: bytes a second from each cache, and operations a second."""

import numpy as np

from scalpel_sim.bench.machine import Caches
from scalpel_sim.bench.timing import Case
from tissue import FloatArray
from tissue.core.jit import kernel
from tissue.core.simd import WIDTH, lanes, load_lanes, store_lanes

BYTES_PER_ELEMENT = 24
"""Of the triad: two doubles read, one written. The line that a store must fetch first is not
counted, as in McCalpin's STREAM."""
N_CHAINS = 8
"""Vectors that are multiplied and added to in turn: an operation takes 4 cycles, and two may begin
in each, so that fewer would wait for themselves."""
LINKS = 1000
"""Operations on each of them in a call."""
FLOPS_PER_CALL = 2 * WIDTH * N_CHAINS * LINKS
"""A multiplication and an addition for each."""
BEYOND_CACHES = 3.0
"""Times the last cache: what is read has been pushed out of it since it was read last."""


class Triad:
    """a = b + s c over arrays that fill so many bytes together."""

    def __init__(self, n_bytes: int) -> None:
        n = n_bytes // BYTES_PER_ELEMENT
        self.n_bytes = n * BYTES_PER_ELEMENT
        self._a, self._b, self._c = np.zeros(n), np.ones(n), np.ones(n)

    def run(self, n: int) -> None:
        """Do it so many times."""
        _triad(self._a, self._b, self._c, n)


def triads(caches: Caches) -> dict[str, Triad]:
    """Return a triad for each level, by its name: half of a cache, and more than the last."""
    return {
        "L1": Triad(caches.l1 // 2),
        "L2": Triad(caches.l2 // 2),
        "L3": Triad(caches.l3 // 4),
        "memory": Triad(round(BEYOND_CACHES * caches.l3)),
    }


def level_of(working_set: int, caches: Caches) -> str:
    """Return the level that feeds a loop over so many bytes."""
    for name, size in zip(("L1", "L2", "L3"), caches, strict=True):
        if working_set <= size:
            return name
    return "memory"


def arithmetic() -> Case:
    """Return what does nothing but multiply and add, in the engine's own vectors."""
    values = np.zeros(N_CHAINS * WIDTH)
    return Case("multiply and add", lambda n: _chains(values, n))


@kernel
def _triad(a: FloatArray, b: FloatArray, c: FloatArray, n: int) -> None:
    for k in range(n):
        s = 1.0 / (k + 1.0)
        for i in range(len(a)):
            a[i] = b[i] + s * c[i]


@kernel
def _chains(values: FloatArray, n: int) -> None:
    a, b = load_lanes(values, 0), load_lanes(values, WIDTH)
    c, d = load_lanes(values, 2 * WIDTH), load_lanes(values, 3 * WIDTH)
    e, f = load_lanes(values, 4 * WIDTH), load_lanes(values, 5 * WIDTH)
    g, h = load_lanes(values, 6 * WIDTH), load_lanes(values, 7 * WIDTH)
    factor, term = lanes(0.5), lanes(1.0)
    for _ in range(n * LINKS):
        a = a * factor + term
        b = b * factor + term
        c = c * factor + term
        d = d * factor + term
        e = e * factor + term
        f = f * factor + term
        g = g * factor + term
        h = h * factor + term
    store_lanes(values, 0, a + b + c + d + e + f + g + h)
