"""Times a step over TCP against the same step in process: python benchmarks/round_trip.py.

The tissue is one cell at rest without a blade near, so that what remains is the link. It lives in a
second process, as with `scalpel-sim serve`. Run it on an idle machine, from the repository.
"""

import subprocess
import sys
import time
from contextlib import closing

import numpy as np

from bridge.link import InProcessLink, TissueLink
from bridge.server import serve
from bridge.tcp import TcpLink
from tissue.shapes import grid
from tissue.tissue import Tissue
from tissue.types import BladeSegment, BladeSweep, FloatArray

DT = 1e-4
"""[s]. One Runge-Kutta step of the cell."""
N_WARM_UP = 200
N_STEPS = 10_000
MICROSECONDS = 1e6

HERE = BladeSegment(np.array([0.0, 0.0, 1.0]), np.array([0.0, 0.0, 1.1]), np.array([0.0, 1.0, 0.0]))
"""A blade a metre above the tissue: a full request, and nothing to cut."""


def main() -> None:
    """Print the times of a step through both links."""
    if sys.argv[1:] == ["serve"]:
        serve(cell, port=0, on_listening=lambda address: print(address, flush=True))
        return
    server = subprocess.Popen(
        [sys.executable, __file__, "serve"], stdout=subprocess.PIPE, text=True
    )
    try:
        assert server.stdout is not None
        with closing(TcpLink(server.stdout.readline().strip())) as there:
            links: dict[str, TissueLink] = {"in process": InProcessLink(cell()), "over TCP": there}
            report({name: times(link, None) for name, link in links.items()}, "no blade near")
            sweep = BladeSweep(HERE, HERE)
            report({name: times(link, sweep) for name, link in links.items()}, "with a blade")
    finally:
        server.terminate()
        server.wait()


def cell() -> Tissue:
    """Return one cell of six tetrahedra, at rest."""
    return Tissue(grid((1, 1, 1), (0.01, 0.01, 0.01)), gravity=(0.0, 0.0, 0.0))


def times(link: TissueLink, sweep: BladeSweep | None) -> FloatArray:
    """Return how long each step took [µs], shape (N_STEPS,)."""
    for _ in range(N_WARM_UP):
        link.step(sweep, DT)
    taken = np.empty(N_STEPS)
    for i in range(N_STEPS):
        begin = time.perf_counter()
        link.step(sweep, DT)
        taken[i] = time.perf_counter() - begin
    return taken * MICROSECONDS


def report(taken: dict[str, FloatArray], what: str) -> None:
    """Print median and 99th percentile of each link, and what TCP adds."""
    for name, values in taken.items():
        median, p99 = np.percentile(values, [50, 99])
        print(f"{what:14} {name:11} median {median:7.1f} µs   p99 {p99:7.1f} µs")
    medians = {name: np.median(values) for name, values in taken.items()}
    print(f"{what:14} the link adds {medians['over TCP'] - medians['in process']:.1f} µs\n")


if __name__ == "__main__":
    main()
