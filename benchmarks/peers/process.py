"""One case of one engine in a process of its own, which steps on request; the body that it gets.

`benchmarks.peers.serving` is the other side.
"""

import json
import os
import select
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from benchmarks.engine import (
    FRAME_DT,
    POISSON_RATIO,
    YOUNG_MODULUS,
    EngineLoops,
    block_material,
    held_nodes,
)
from benchmarks.peers.serving import PeerBody, write_body
from scalpel_sim.recording.recording import unnamed_file
from tissue import FloatArray, TetrahedralMesh

_ROOT = Path(__file__).parents[2]
"""Where the other Python, which need not have this package, finds the adapters."""

LONGEST_START = 300.0
"""Longest time for an engine to import, compile, build its body and do the first swing [s]; Warp
compiles for a minute."""
LONGEST_TURN = 120.0
"""Longest time for a turn [s]: the slowest engine takes some tenths of a second a step."""
LONGEST_END = 10.0
"""Longest time to end without being killed [s]."""

_GRAVITY = 9.81
"""Gravity [m/s2], that of a `Tissue`."""

_ONE_THREAD = {
    name: "1" for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "RAYON_NUM_THREADS")
}
_MISSING = ("ModuleNotFoundError", "ImportError")


class PeerTurn(NamedTuple):
    """Outcome of a case in one turn."""

    seconds: FloatArray
    """CPU time per step of each sample [s]."""
    moved: float
    """Largest displacement of a node from rest [m]; nan where positions are not finite."""


class PeerError(RuntimeError):
    """A case that could not start, or ended too early."""


class NotInstalledError(PeerError):
    """A case whose engine is not installed in this Python."""


class PeerProcess:
    """A case that is built and ready to step.

    Args:
        adapter: Name of the adapter.
        case: The case, as the adapter names it.
        dt: Time step [s].
        body: File with the arrays of `PeerBody`.
        python: The Python that has the engine.
        core: Index of the core to run on.

    Raises:
        NotInstalledError: the engine cannot be imported.
        PeerError: the engine cannot make this body, or takes too long.
    """

    def __init__(
        self, adapter: str, case: str, dt: float, body: Path, python: Path, core: int
    ) -> None:
        self._errors = unnamed_file()
        self._process = subprocess.Popen(
            [python, "-m", "benchmarks.peers.adapters", adapter, body, case, str(dt), str(core)],
            cwd=_ROOT,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._errors,
            text=True,
            env=_environment(python),
        )
        try:
            begin = self._answer(LONGEST_START)
        except BaseException:
            self.close()
            raise
        self.version: str = begin["version"]
        self.sag = np.array(begin["sag"])
        """Mean sag of the nodes at each instant of the first swing [m]."""

    def turn(self, seconds: float) -> PeerTurn:
        """Run one turn of at least this long [s].

        Raises:
            PeerError: the process ended, or takes too long.
        """
        assert self._process.stdin is not None
        try:
            self._process.stdin.write(f"{seconds}\n")
            self._process.stdin.flush()
        except BrokenPipeError:
            raise PeerError(self._last_words()) from None
        answer = self._answer(LONGEST_TURN)
        moved = answer["moved"]
        return PeerTurn(np.array(answer["seconds"]), np.nan if moved is None else moved)

    def close(self) -> None:
        """End the process."""
        if self._process.stdin is not None and not self._process.stdin.closed:
            self._process.stdin.close()  # its loop over the requests ends
        try:
            self._process.wait(LONGEST_END)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        if self._process.stdout is not None:
            self._process.stdout.close()
        self._errors.close()

    def _answer(self, seconds: float) -> dict[str, Any]:
        """Wait for the next line of the process."""
        stdout = self._process.stdout
        assert stdout is not None
        if not select.select([stdout], [], [], seconds)[0]:
            raise PeerError(f"it did not answer within {seconds:g} s")
        line = stdout.readline()
        if not line:
            words = self._last_words()
            raise (NotInstalledError if words.startswith(_MISSING) else PeerError)(words)
        answer: dict[str, Any] = json.loads(line)
        if "failed" in answer:
            raise PeerError(" ".join(answer["failed"].split()))
        return answer

    def _last_words(self) -> str:
        """Return the last line that the process wrote on standard error."""
        code = self._process.wait()
        self._errors.seek(0)
        lines = self._errors.read().decode(errors="replace").split("\n")
        written = [line.strip() for line in lines if line.strip()]
        return written[-1] if written else f"it ended with exit code {code}"


def start_peer(
    adapter: str, case: str, dt: float, body: Path, pythons: Sequence[Path], core: int
) -> PeerProcess:
    """Start a case in the first of these Pythons that has its engine.

    Args:
        adapter: Name of the adapter.
        case: The case, as the adapter names it.
        dt: Time step [s].
        body: File with the arrays of `PeerBody`.
        pythons: Where to look for the engine, in this order.
        core: Index of the core to run on.

    Raises:
        NotInstalledError: none of them has the engine.
        PeerError: one has it, and cannot run the case.
    """
    for python in pythons[:-1]:
        try:
            return PeerProcess(adapter, case, dt, body, python, core)
        except NotInstalledError:
            continue
    return PeerProcess(adapter, case, dt, body, pythons[-1], core)


def last_core() -> int:
    """Return the index of the last core that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return max(os.sched_getaffinity(0))
    return 0


def _environment(python: Path) -> dict[str, str]:
    """Return the environment: one thread; this Python imports what this process can import."""
    environment = {k: v for k, v in os.environ.items() if k != "PYTHONPATH"} | _ONE_THREAD
    if python == Path(sys.executable):
        environment["PYTHONPATH"] = os.pathsep.join(path for path in sys.path if path)
    return environment


def body_file(folder: Path, mesh: TetrahedralMesh) -> Path:
    """Write a block for the other processes, with our springs and masses; return the file."""
    ours = EngineLoops(mesh)
    edges, stiffness = ours.springs
    file = folder / "body.npz"
    body = PeerBody(
        positions=mesh.positions,
        tetrahedra=mesh.tetrahedra.astype(np.int32),
        edges=edges,
        stiffness=stiffness,
        masses=ours.masses,
        held=np.flatnonzero(held_nodes(mesh)),
        young_modulus=YOUNG_MODULUS,
        poisson_ratio=POISSON_RATIO["neo_hookean"],
        retardation_time=block_material("springs").retardation_time,
        gravity=_GRAVITY,
        dt=FRAME_DT,
    )
    write_body(str(file), body)
    return file
