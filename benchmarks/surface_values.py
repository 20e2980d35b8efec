"""Times what colours the picture: displacement, strain and stress at the surface, and the surface.

Usage: PYTHONPATH=. python benchmarks/surface_values.py [SCENE], on an idle machine
"""

import sys
from typing import get_args

from benchmarks.timing import median_milliseconds
from bridge import InProcessLink
from scalpel_sim import SCENES, prepare
from tissue import SurfaceQuantity

N_TIMES = 100


def main() -> None:
    """Print the times."""
    name = sys.argv[1] if len(sys.argv) > 1 else "organ"
    simulation = prepare(SCENES[name])
    simulation.run(0.6 * simulation.duration)
    link = simulation.link
    assert isinstance(link, InProcessLink)
    tissue = link.tissue
    print(f"{name}, {tissue.n_tetrahedra} tetrahedra, in mid-cut, medians of {N_TIMES} [ms]")
    print(f"{'surface':14s}{median_milliseconds(tissue.surface, N_TIMES):8.3f}")
    for quantity in get_args(SurfaceQuantity):
        taken = median_milliseconds(lambda q=quantity: tissue.surface_values(q), N_TIMES)
        print(f"{quantity:14s}{taken:8.3f}")


if __name__ == "__main__":
    main()
