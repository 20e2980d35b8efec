"""Times a step over TCP beside the same step in process.

Usage: PYTHONPATH=. python benchmarks/round_trip.py, on an idle machine

The tissue is small and runs in a second process, as with `scalpel-sim serve`. First the link alone
is timed, with the smallest request: the number of pieces. Then steps: without a blade, with a blade
above the tissue, and with a blade in the tissue, whose contacts are sent too; each with and without
a key. The time that the link adds to a step includes cache misses, since the other process has used
the cache in between.
"""

import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import closing

import numpy as np

from bridge import InProcessLink, TcpLink, TissueLink, serve
from tissue import BladeSegment, BladeSweep, FloatArray, Tissue, block

DT = 1e-4
"""Time step [s]: one Runge-Kutta step of the cell."""
N_WARM_UP = 200
N_STEPS = 4_000
MICROSECONDS = 1e6
SIDE = 0.01
"""Side of the cell [m]."""
KEY = bytes(range(32))
WITH_KEY = "with a key"


def upright(y: float, z: float) -> BladeSegment:
    """Return an upright edge in the middle of the cell that faces along y."""
    tip = np.array([0.4 * SIDE, y, z])
    return BladeSegment(tip, tip + np.array([0.0, 0.0, 3.0 * SIDE]), np.array([0.0, 1.0, 0.0]))


def main() -> None:
    """Print the times of a step through each link."""
    if sys.argv[1:2] == ["serve"]:
        key = KEY if WITH_KEY in sys.argv else None
        serve(cell, port=0, key=key, on_listening=lambda address: print(address, flush=True))
        return
    links: dict[str, TissueLink] = {"in process": InProcessLink(cell())}
    servers = []
    try:
        for name, options in (("over TCP", []), (WITH_KEY, [WITH_KEY])):
            server = subprocess.Popen(
                [sys.executable, __file__, "serve", *options], stdout=subprocess.PIPE, text=True
            )
            servers.append(server)
            assert server.stdout is not None
            address = server.stdout.readline().strip()
            links[name] = TcpLink(address, key=KEY if options else None)
        above, within = upright(0.5 * SIDE, SIDE), upright(0.3 * SIDE, -SIDE)
        report("link alone", {name: times(link.n_pieces) for name, link in links.items()})
        report("no blade", {name: times(stepping(link, None)) for name, link in links.items()})
        for what, pose in (("blade above", above), ("blade inside", within)):
            for link in links.values():
                draw_in(link, pose)
            sweep = BladeSweep(pose, pose)
            print(f"{what}: {len(link.step(sweep, DT).contacts.point)} contacts")
            report(what, {name: times(stepping(link, sweep)) for name, link in links.items()})
    finally:
        for link in links.values():
            with closing(link):
                pass
        for server in servers:
            server.terminate()
            server.wait()


def cell() -> Tissue:
    """Return one cell of six tetrahedra, held by its lowest nodes, at rest."""
    mesh = block((1, 1, 1), (SIDE, SIDE, SIDE))
    return Tissue(mesh, fixed=mesh.positions[:, 2] == 0.0, gravity=(0.0, 0.0, 0.0))


def draw_in(link: TissueLink, pose: BladeSegment) -> None:
    """Move the blade to a pose from in front of the cell."""
    before = None
    for y in np.linspace(-0.1 * SIDE, pose.tip[1], 200):
        shift = np.array([0.0, y - pose.tip[1], 0.0])
        after = pose._replace(tip=pose.tip + shift, heel=pose.heel + shift)
        link.step(BladeSweep(before or after, after), 1e-3)
        before = after


def stepping(link: TissueLink, sweep: BladeSweep | None) -> Callable[[], object]:
    """Return a function that takes one step."""
    return lambda: link.step(sweep, DT)


def times(ask: Callable[[], object]) -> FloatArray:
    """Return the time of each call [µs], shape (N_STEPS,)."""
    for _ in range(N_WARM_UP):
        ask()
    taken = np.empty(N_STEPS)
    for i in range(N_STEPS):
        begin = time.perf_counter()
        ask()
        taken[i] = time.perf_counter() - begin
    return taken * MICROSECONDS


def report(what: str, taken: dict[str, FloatArray]) -> None:
    """Print median and 99th percentile of each link, and what it adds to the time in process."""
    alone = np.median(taken["in process"])
    for name, values in taken.items():
        median, p99 = np.percentile(values, [50, 99])
        print(
            f"{what:13}  {name:10}  median {median:6.1f} µs  p99 {p99:6.1f} µs  "
            f"the link adds {median - alone:6.1f} µs"
        )
    print()


if __name__ == "__main__":
    main()
