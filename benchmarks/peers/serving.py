"""One case of one engine in a process of its own: the body, its first swing, and timed turns.

Each case runs on one core and one thread. First the body falls from rest, and the first line of
JSON has its sag. Then the parent process has the cases step in turn for a number of seconds, one
line of text each; the answer is a line of JSON with the CPU time that the steps took, of the whole
process with its own threads. A process that waits uses no CPU time. Standard output belongs to
these answers.
"""

import json
import os
import sys
import time
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple, TextIO

import numpy as np
import numpy.typing as npt

_SHORTEST_SAMPLE = 2e-4
"""Least duration of a sample [s]: as many steps as this needs are timed together."""
_LEAST_SAMPLES = 3
"""Fewest samples in a turn."""
SWING_INTERVAL = 4e-3
"""Time between the instants at which the sag is read [s]; each time step divides it."""
SWING_INSTANTS = 32
"""Number of these instants: about one swing of the smallest block. These steps also compile and
allocate, and are not timed."""

_Array = npt.NDArray[Any]


class PeerBody(NamedTuple):
    """The body and material to simulate, the same for every engine."""

    positions: _Array
    """Positions of the nodes at rest [m], shape (n_nodes, 3)."""
    tetrahedra: _Array
    """Nodes of each tetrahedron, shape (n_tetrahedra, 4)."""
    edges: _Array
    """Nodes of each edge, shape (n_edges, 2)."""
    stiffness: _Array
    """Stiffness of the spring along each edge [N/m], by van Gelder's formula, shape (n_edges,)."""
    masses: _Array
    """Masses of the nodes [kg], shape (n_nodes,)."""
    held: _Array
    """Indices of the nodes that do not move, shape (n_held,)."""
    young_modulus: float
    """Young's modulus [Pa]."""
    poisson_ratio: float
    """Poisson's ratio, for laws that have a choice; springs have 1/4."""
    retardation_time: float
    """Viscosity over stiffness [s]."""
    gravity: float
    """Gravity, along -z [m/s2]."""
    dt: float
    """Time step [s]."""

    @property
    def density(self) -> float:
        """Density [kg/m3]."""
        return float(self.masses.sum() / self.volume)

    @property
    def volume(self) -> float:
        """Volume at rest [m3]."""
        corners = self.positions[self.tetrahedra]
        return float(np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1])).sum() / 6.0)

    @property
    def mu(self) -> float:
        """Lame's second constant [Pa]."""
        return self.young_modulus / (2.0 * (1.0 + self.poisson_ratio))

    @property
    def lam(self) -> float:
        """Lame's first constant [Pa]."""
        nu = self.poisson_ratio
        return self.young_modulus * nu / ((1.0 + nu) * (1.0 - 2.0 * nu))


class PeerStepper(NamedTuple):
    """A body that an engine made, ready to step."""

    steps: Callable[[int], None]
    """Takes the given number of steps of `dt`."""
    positions: Callable[[], _Array]
    """Returns the positions of the nodes [m], shape (n_nodes, 3)."""
    version: str
    """Version of the engine."""


Adapter = Callable[[PeerBody, str], PeerStepper]
"""A function that makes a body in an engine; the case says how."""


def serve_case(adapters: Mapping[str, Adapter]) -> None:
    """Serve the case that the command line names: ADAPTER BODY CASE STEP CORE."""
    adapter, file, case, step, core = sys.argv[1:6]
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {int(core)})
    answers = os.fdopen(os.dup(1), "w", buffering=1)
    os.dup2(2, 1)  # what a library prints must not get among the answers
    try:
        body = read_body(file)._replace(dt=float(step))
        stepper = adapters[adapter](body, case)
        sag = _swing(body, stepper)
    except ImportError:
        raise  # the engine is not installed
    except Exception as error:
        answers.write(json.dumps({"failed": f"{type(error).__name__}: {error}"}) + "\n")
        return
    answers.write(json.dumps({"version": stepper.version, "sag": sag}) + "\n")
    answer_requests(body, stepper, sys.stdin, answers)


def _swing(body: PeerBody, stepper: PeerStepper) -> list[float]:
    """Return the mean sag of the nodes at each instant of the first swing [m]."""
    n_steps = round(SWING_INTERVAL / body.dt)
    sag: list[float] = []
    for _ in range(SWING_INSTANTS):
        stepper.steps(n_steps)
        sag.append(float(np.mean(body.positions[:, 2] - stepper.positions()[:, 2])))
    return sag


def write_body(file: str, body: PeerBody) -> None:
    """Write a body to a .npz file."""
    arrays: dict[str, Any] = body._asdict()
    np.savez(file, **arrays)


def read_body(file: str) -> PeerBody:
    """Read a body from a .npz file."""
    with np.load(file) as arrays:
        entries = {name: arrays[name] for name in PeerBody._fields}
    values: dict[str, Any] = {name: v if v.ndim else float(v) for name, v in entries.items()}
    return PeerBody(**values)


def answer_requests(
    body: PeerBody, stepper: PeerStepper, requests: TextIO, answers: TextIO
) -> None:
    """Answer each request with the times of its steps, until they end.

    Args:
        body: The body at rest.
        stepper: The same body, ready to step.
        requests: Lines with the seconds to step for.
        answers: Where the answers go: `seconds`, a list of seconds per step, and `moved`, the
            largest displacement of a node from rest [m], or null where positions are not finite.
    """
    n_steps = _steps_per_sample(stepper.steps)
    for line in requests:
        samples = _time_turn(stepper.steps, n_steps, float(line))
        moved = float(np.abs(stepper.positions() - body.positions).max())
        answers.write(
            json.dumps({"seconds": samples, "moved": moved if np.isfinite(moved) else None}) + "\n"
        )


def _steps_per_sample(steps: Callable[[int], None]) -> int:
    """Return how many steps make up a sample."""
    n_steps = 1
    while True:
        start = time.process_time()
        steps(n_steps)
        if time.process_time() - start >= _SHORTEST_SAMPLE:
            return n_steps
        n_steps *= 2


def _time_turn(steps: Callable[[int], None], n_steps: int, seconds: float) -> list[float]:
    """Run one turn; return the seconds per step of each sample. The first step is not timed."""
    steps(1)
    samples: list[float] = []
    begin = time.process_time()
    while True:
        start = time.process_time()
        steps(n_steps)
        end = time.process_time()
        samples.append((end - start) / n_steps)
        if end - begin >= seconds and len(samples) >= _LEAST_SAMPLES:
            return samples
