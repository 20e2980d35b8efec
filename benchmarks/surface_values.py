"""Times what colours the picture: displacement, strain and stress at the surface, and the surface.

Usage: PYTHONPATH=. python benchmarks/surface_values.py [SCENE], on an idle machine
"""

import sys
import time
from collections.abc import Callable
from statistics import median
from typing import get_args

from bridge import InProcessLink
from scalpel_sim import SCENES, prepare
from tissue import SurfaceQuantity

N_TIMES = 100
MILLISECONDS = 1e3


def main() -> None:
    """Print the times."""
    name = sys.argv[1] if len(sys.argv) > 1 else "organ"
    simulation = prepare(SCENES[name])
    simulation.run(0.6 * simulation.duration)
    link = simulation.link
    assert isinstance(link, InProcessLink)
    tissue = link.tissue
    print(f"{name}, {tissue.n_tetrahedra} tetrahedra, in mid-cut, medians of {N_TIMES} [ms]")
    print(f"{'surface':14s}{milliseconds(tissue.surface):8.3f}")
    for quantity in get_args(SurfaceQuantity):
        print(f"{quantity:14s}{milliseconds(lambda q=quantity: tissue.surface_values(q)):8.3f}")


def milliseconds(do: Callable[[], object]) -> float:
    """Return how long a call takes, the median of several [ms]."""
    times = []
    for _ in range(N_TIMES):
        start = time.perf_counter()
        do()
        times.append(time.perf_counter() - start)
    return MILLISECONDS * median(times)


if __name__ == "__main__":
    main()
