"""What every peer does: read a body, say that it is ready, and time steps when it is told to.

Each case runs in a process of its own, on one core and one thread. The parent tells the processes
in turn how long to step (a line with seconds), and each answers with what its steps took: CPU time
of the whole process, its own threads included. While others run it waits and uses nothing.

Standard output belongs to the protocol; what a library prints goes to standard error. Nothing here
imports the project: a peer may live in an environment that does not have it.
"""

import json
import os
import sys
import time
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

SHORTEST_SAMPLE = 2e-4
"""Time that a sample takes at least [s]: as many steps as it needs are timed together."""
LEAST_SAMPLES = 3
"""In each turn."""
N_WARM_UP = 5
"""Steps that are not timed at the start: they compile and allocate."""


class Body(NamedTuple):
    """What to simulate: the same body and material for everyone."""

    positions: np.ndarray
    """Nodes at rest [m], shape (n_nodes, 3)."""
    tetrahedra: np.ndarray
    """Shape (n_tets, 4)."""
    edges: np.ndarray
    """Pairs of nodes, shape (n_edges, 2)."""
    stiffness: np.ndarray
    """Of the spring along each edge [N/m], by van Gelder's formula."""
    masses: np.ndarray
    """Of the nodes [kg]."""
    held: np.ndarray
    """Nodes that do not move, shape (n_held,)."""
    young_modulus: float
    """[Pa]."""
    poisson_ratio: float
    """Of the laws that can have it; springs have 1/4."""
    retardation_time: float
    """Viscosity over stiffness [s]."""
    dt: float
    """[s]."""

    @property
    def mu(self) -> float:
        """Lame's second constant [Pa]."""
        return self.young_modulus / (2.0 * (1.0 + self.poisson_ratio))

    @property
    def lam(self) -> float:
        """Lame's first constant [Pa]."""
        nu = self.poisson_ratio
        return self.young_modulus * nu / ((1.0 + nu) * (1.0 - 2.0 * nu))


class Stepper(NamedTuple):
    """A body that a peer made, ready to move."""

    steps: Callable[[int], None]
    """Takes so many steps of `dt`."""
    positions: Callable[[], np.ndarray]
    """Where the nodes are [m]."""
    version: str
    """Of the peer."""


def main(make: Callable[[Body, str], Stepper]) -> None:
    """Serve one case: arguments are the file of the body, the case, and the core to run on."""
    file, case, core = sys.argv[1:4]
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {int(core)})
    answers = os.fdopen(os.dup(1), "w", buffering=1)
    os.dup2(2, 1)  # a library that prints must not get into the answers
    with np.load(file) as arrays:
        values = {name: arrays[name] for name in Body._fields}
    body = Body(**{name: v if v.ndim else float(v) for name, v in values.items()})
    try:
        stepper = make(body, case)
        stepper.steps(N_WARM_UP)
    except Exception as error:
        answers.write(json.dumps({"failed": f"{type(error).__name__}: {error}"}) + "\n")
        return
    n_steps = steps_of_a_sample(stepper.steps)
    answers.write(json.dumps({"version": stepper.version}) + "\n")
    for line in sys.stdin:
        samples = turn(stepper.steps, n_steps, float(line))
        moved = float(np.abs(stepper.positions() - body.positions).max())
        answers.write(
            json.dumps({"seconds": samples, "moved": moved if np.isfinite(moved) else None}) + "\n"
        )


def steps_of_a_sample(steps: Callable[[int], None]) -> int:
    """Return how many steps make a sample."""
    n_steps = 1
    while True:
        start = time.process_time()
        steps(n_steps)
        if time.process_time() - start >= SHORTEST_SAMPLE:
            return n_steps
        n_steps *= 2


def turn(steps: Callable[[int], None], n_steps: int, seconds: float) -> list[float]:
    """Return the seconds a step in each sample of one turn, after a step that is not timed."""
    steps(1)
    samples: list[float] = []
    begin = time.process_time()
    while True:
        start = time.process_time()
        steps(n_steps)
        end = time.process_time()
        samples.append((end - start) / n_steps)
        if end - begin >= seconds and len(samples) >= LEAST_SAMPLES:
            return samples
