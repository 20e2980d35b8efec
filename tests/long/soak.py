"""A long run of everything: strokes, a led hand, tabs of the page, servers that are killed.

It is divided into lives of a body, which is then made anew: with a blade without an arm, with a
hand that leads the arm, and with an arm whose tissue is in another process, in turn.
"""

import itertools
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from benchmarks.strokes import random_stroke
from bridge import LinkError, TcpLink, serve
from scalpel_sim import SCENES, Simulation, Viewer, prepare
from scalpel_sim.hands.commands import Engage, Move, Turn
from scalpel_sim.hands.teleoperation import LiveHand
from scalpel_sim.preparation.tissue import make_tissue
from scalpel_sim.scene.scene import changed
from scalpel_sim.viewer.pictures import into_viewer
from tests.long.child import memory_of_this_process
from tissue import BladeSweep, Energies, FloatArray, Tissue, block

ROOT = Path(__file__).parents[2]

SCENE = changed(
    SCENES["grid2"], mesh=partial(block, (3, 4, 3), (0.04, 0.04, 0.04)), floor=-0.02, audit=True
)
"""A block of 216 tetrahedra that is held at its sides, as in the paper, above a floor."""

DT = 1e-3
"""Length of a frame [s]."""

LIFE = 20.0
"""Simulated time of a life [s]: three of them are the first minute."""

SETTLING, RESTING = 0.4, 0.05
"""The end of a life, in which the body comes to rest and then is watched, as shares of it."""

PERIOD = 16
"""Frames between two messages of a page that draws sixty pictures a second."""

HAND_SPEED = 0.1
"""Fastest that a hand moves along an axis [m/s]."""

CLEAR = 0.02
"""How far a hand leads the blade beside the body, or above it [m]."""

EDGE = 0.075
"""Length of the edge of the arm's blade in this scene, about [m]."""

ASIDE = 5e-3
"""How far a hand draws back and goes aside in a stroke, at most [m]."""

PAUSE_EVERY, PAUSE = 4000, 500
"""Frames after which a hand pauses, and of a pause."""


class Life(NamedTuple):
    """What a life came to."""

    kind: str
    frames: int
    residual: float
    """Largest residual of the account, as a share of the work that was done on the body."""
    drift: float
    """How far a node moved while the body was watched [m], between the means of its two halves: in
    some bodies contacts tremble for ever, which is no drift."""


def run(seed: int, seconds: float, life: float = LIFE) -> dict[str, Any]:
    """Run for so long of simulated time.

    Returns:
        For each life a row of `Life`, as `lives`; the memory after each life of this process and of
        the process that serves the page, as `memory` and `page_memory` [bytes]; `tabs` opened.
    """
    random = np.random.default_rng(seed)
    kinds: list[Callable[..., Life]] = [strokes, led, served]
    lives, memory, page_memory = [], [], []
    first = prepare(SCENE)
    with Viewer(first.arm.model, frame=first.frame) as viewer, open_tabs(viewer.url, seed) as tabs:
        del first
        for i in range(round(seconds / life)):
            lives.append(kinds[i % len(kinds)](random, life, viewer))
            memory.append(memory_of_this_process())
            page_memory.append(resident(viewer._process.pid))
            print(i, *lives[-1], memory[-1], page_memory[-1], file=sys.stderr, flush=True)
        assert viewer.is_running
        n_tabs = tabs_opened(tabs)
    return {"lives": lives, "memory": memory, "page_memory": page_memory, "tabs": n_tabs}


# Lives.


def strokes(random: np.random.Generator, life: float, viewer: Viewer) -> Life:
    """Make random strokes of a blade without an arm; then leave the body alone."""
    tissue = make_tissue(SCENE)
    residual, n, n_most = 0.0, 0, busy_frames(life)
    while n < n_most:
        poses = random_stroke(tissue, random)
        for sweep in itertools.starmap(BladeSweep, itertools.pairwise(poses)):
            tissue.step(sweep, DT)
            n += 1
        for _ in range(50):
            energies = tissue.step(None, DT).energies
            n += 1
        residual = max(residual, share(energies))
    return Life("strokes", *at_rest(tissue, life, n, residual))


def busy_frames(life: float) -> int:
    """Return the frames of a life before the body is left alone."""
    return round((1.0 - SETTLING - RESTING) * life / DT)


def at_rest(tissue: Tissue, life: float, n: int, residual: float) -> tuple[int, float, float]:
    """Leave the body alone for the rest of a life; return its frames, residual and drift."""
    n_rest, n_all = round(RESTING * life / DT), round(life / DT)
    for _ in range(n, n_all - n_rest):
        tissue.step(None, DT)
    places = np.zeros((2, tissue.n_nodes, 3))
    for i in range(n_rest):
        energies = tissue.step(None, DT).energies
        places[2 * i // n_rest] += tissue.snapshot().positions / (n_rest // 2)
    drift = np.linalg.norm(places[1] - places[0], axis=1).max()
    return n_all, max(residual, share(energies)), float(drift)


def led(random: np.random.Generator, life: float, viewer: Viewer) -> Life:
    """Lead the arm by a hand that wanders through the body, with pauses; then let go."""
    simulation = prepare(SCENE, is_led=True)
    simulation.pictures.append(into_viewer(viewer))
    hand = LiveHand(simulation, clock=lambda: 0.0)
    hand.take_over(simulation)
    hand.commands.append(Engage())
    bounds = simulation.link.describe().bounds
    targets = itertools.chain.from_iterable(iter(lambda: way_of_stroke(random, bounds), None))
    target = next(targets)

    def command(now: Simulation) -> None:
        nonlocal target
        n = len(now.recording)
        if n % PERIOD == 0 and n % PAUSE_EVERY > PAUSE:
            middle = np.reshape(hand.blade.numbers, (3, 3))[:2].mean(axis=0)
            step = HAND_SPEED * DT * PERIOD
            if np.abs(target - middle).max() < step:
                target = next(targets)
            way = np.clip(target - middle, -step, step)
            hand.commands.append(Move(way.tolist(), float(n)))
            hand.commands.append(Turn(random.normal(0.0, 2e-3, 3).tolist(), float(n)))

    n = busy_frames(life)
    simulation.run(n * DT, command)
    residual = share(simulation.result.energies)
    return Life("led hand", *at_rest(simulation.link._tissue, life, n, residual))


def way_of_stroke(random: np.random.Generator, bounds: FloatArray) -> list[FloatArray]:
    """Return where a hand leads the middle of the edge in a stroke [m]: down, through, up, back.

    On its way through it draws back once, and goes on beside where it was.

    Args:
        random: Where the stroke is.
        bounds: Lowest and highest corner of the body [m], shape (2, 3).
    """
    low, high = bounds
    x, depth = random.uniform(low[0], high[0]), random.uniform(0.3, 1.0) * (high[2] - low[2])
    above, within = high[2] + CLEAR, high[2] + 0.5 * EDGE - depth
    front, back = low[1] - CLEAR, high[1] + CLEAR
    turn, retreat, aside = random.uniform(low[1], high[1]), *random.uniform(0.0, ASIDE, 2)
    beside = x + random.choice([-1.0, 1.0]) * aside
    return [
        np.array(p)
        for p in (
            (x, front, above),
            (x, front, within),
            (x, turn, within),
            (beside, turn - retreat, within),
            (beside, back, within),
            (beside, back, above),
        )
    ]


def served(random: np.random.Generator, life: float, viewer: Viewer) -> Life:
    """Cut tissue in another process, which is killed in the midst of it."""
    server = subprocess.Popen(
        [sys.executable, "-m", "tests.long.soak"],
        cwd=ROOT,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        stdout=subprocess.PIPE,
        text=True,
    )
    try:
        with closing(TcpLink(server.stdout.readline().strip())) as link:
            simulation = prepare(SCENE, link)
            simulation.pictures.append(into_viewer(viewer))
            simulation.run(life * random.uniform(0.9, 1.0))
            residual = share(simulation.result.energies)
            server.send_signal(signal.SIGKILL)
            try:
                simulation.run(life)
            except LinkError:
                return Life("killed server", len(simulation.recording), residual, 0.0)
        raise AssertionError("the run went on without its tissue")
    finally:
        server.kill()
        server.wait()
        server.stdout.close()


def share(energies: Energies | None) -> float:
    """Return the residual of an account as a share of the work."""
    assert energies is not None
    return abs(energies.residual) / max(abs(energies.work_of_blade), LEAST_WORK)


LEAST_WORK = 1e-3
"""Work below which the residual is no share of it [J]: a stroke through the body takes 30 mJ."""


# Tabs and memory.


@contextmanager
def open_tabs(url: str, seed: int) -> Iterator[subprocess.Popen[str]]:
    """Yield a process that opens and closes tabs of a page."""
    tabs = subprocess.Popen(
        [sys.executable, "-m", "tests.long.soak_tabs", url, str(seed)],
        cwd=ROOT,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    try:
        yield tabs
    finally:
        tabs.kill()
        tabs.communicate()


def tabs_opened(tabs: subprocess.Popen[str]) -> int:
    """Have the process end; return how many tabs it opened."""
    return int(tabs.communicate("end\n")[0])


def resident(pid: int) -> int:
    """Return the memory of a process that is in use [bytes]."""
    pages = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE")


if __name__ == "__main__":  # the tissue of a life, which is served until it is killed
    tissue = partial(make_tissue, SCENE)
    serve(tissue, scene="soak", port=0, on_listening=partial(print, flush=True))
