"""One case of one engine in a process of its own, which steps when it is told to.

`benchmarks/peers/protocol.py` is the other side.
"""

import json
import os
import select
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import IO, Any, NamedTuple

import numpy as np

from tissue import FloatArray

FOLDER = Path(__file__).parents[2] / "benchmarks" / "peers"
"""Where the engines' files are: in the repository, not in the installed package."""

LONGEST_START = 300.0
"""Seconds for an engine to import, compile and build its body; Warp compiles for a minute."""
LONGEST_TURN = 120.0
"""Seconds for a turn: the slowest engine takes some tenths of a second a step."""
LONGEST_END = 10.0
"""Seconds to end by itself."""

ONE_THREAD = {
    name: "1" for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "RAYON_NUM_THREADS")
}


class Turn(NamedTuple):
    """What a case did in one turn."""

    seconds: FloatArray
    """A step, for each sample."""
    moved: float
    """How far a node is from its place at rest at most [m]; nan where positions are not finite."""


class Failed(RuntimeError):
    """A case that did not get going, or ended before its time."""


class NotInstalled(Failed):
    """A case whose engine this Python does not have."""


class PeerProcess:
    """A case, built and ready to step.

    Args:
        script: In `FOLDER`.
        case: As the script knows it.
        body: File with the arrays of `protocol.Body`.
        python: That has the engine.
        core: To run on.

    Raises:
        NotInstalled: the engine cannot be imported.
        Failed: it cannot make such a body, or takes too long.
    """

    def __init__(self, script: str, case: str, body: Path, python: Path, core: int) -> None:
        self._errors: IO[bytes] = tempfile.TemporaryFile()  # noqa: SIM115 (`close` closes it)
        self._process = subprocess.Popen(
            [python, FOLDER / script, body, case, str(core)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._errors,
            text=True,
            env=_environment(python),
        )
        try:
            self.version: str = self._answer(LONGEST_START)["version"]
        except BaseException:
            self.close()
            raise

    def turn(self, seconds: float) -> Turn:
        """Let it step for so long.

        Raises:
            Failed: it ended, or takes too long.
        """
        assert self._process.stdin is not None
        try:
            self._process.stdin.write(f"{seconds}\n")
            self._process.stdin.flush()
        except BrokenPipeError:
            raise Failed(self._last_words()) from None
        answer = self._answer(LONGEST_TURN)
        moved = answer["moved"]
        return Turn(np.array(answer["seconds"]), np.nan if moved is None else moved)

    def close(self) -> None:
        """End it."""
        if self._process.stdin is not None and not self._process.stdin.closed:
            self._process.stdin.close()  # its loop over our lines ends
        try:
            self._process.wait(LONGEST_END)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        if self._process.stdout is not None:
            self._process.stdout.close()
        self._errors.close()

    def _answer(self, seconds: float) -> dict[str, Any]:
        """Wait for its next line."""
        stdout = self._process.stdout
        assert stdout is not None
        if not select.select([stdout], [], [], seconds)[0]:
            raise Failed(f"it did not answer within {seconds:g} s")
        line = stdout.readline()
        if not line:
            words = self._last_words()
            kind = NotInstalled if words.startswith(_MISSING) else Failed
            raise kind(words)
        answer: dict[str, Any] = json.loads(line)
        if "failed" in answer:
            raise Failed(" ".join(answer["failed"].split()))
        return answer

    def _last_words(self) -> str:
        """Return the last line that it wrote on standard error."""
        code = self._process.wait()
        self._errors.seek(0)
        lines = self._errors.read().decode(errors="replace").split("\n")
        said = [line.strip() for line in lines if line.strip()]
        return said[-1] if said else f"it ended with exit code {code}"


_MISSING = ("ModuleNotFoundError", "ImportError")


def started(script: str, case: str, body: Path, pythons: Sequence[Path], core: int) -> PeerProcess:
    """Return the case, in the first of these environments that has its engine.

    Raises:
        NotInstalled: none has it.
        Failed: one has it, and it cannot.
    """
    for python in pythons[:-1]:
        try:
            return PeerProcess(script, case, body, python, core)
        except NotInstalled:
            continue
    return PeerProcess(script, case, body, pythons[-1], core)


def core_to_use() -> int:
    """Return the core to run on: the last that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return max(os.sched_getaffinity(0))
    return 0


def _environment(python: Path) -> dict[str, str]:
    """Return the environment: one thread; this Python finds what we find, another its own."""
    environment = {k: v for k, v in os.environ.items() if k != "PYTHONPATH"} | ONE_THREAD
    if python == Path(sys.executable):
        environment["PYTHONPATH"] = os.pathsep.join(path for path in sys.path if path)
    return environment
