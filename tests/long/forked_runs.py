"""Runs in processes of their own that begin with all modules and kernels loaded.

To load them takes longer than a short run. A process that has loaded them forks one for each run,
which counts its frames in a file that outlives a kill: the memory of a mapped file belongs to the
system.
"""

import json
import mmap
import os
import signal
import struct
import subprocess
import sys
import tempfile
from pathlib import Path
from types import TracebackType
from typing import Self
from unittest.mock import patch

from tests.support.processes import environment

COUNT = struct.Struct("<q")


class ForkedRuns:
    """A process that forks runs, one at a time."""

    def __init__(self) -> None:
        self._server = subprocess.Popen(
            [sys.executable, "-m", "tests.long.forked_runs"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env=environment(),
        )
        self._line()  # it is ready

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._server.kill()
        self._server.communicate()

    def start(self, count: Path, *words: str) -> "ForkedRun":
        """Start `scalpel-sim` with these words; `count` is the file of its frames."""
        assert self._server.stdin is not None
        errors = count.with_name("errors")
        request = {"count": str(count), "errors": str(errors), "words": words}
        self._server.stdin.write(json.dumps(request) + "\n")
        self._server.stdin.flush()
        return ForkedRun(int(self._line()), errors, self._line)

    def _line(self) -> str:
        assert self._server.stdout is not None
        return self._server.stdout.readline()


class ForkedRun:
    """A process of a run, as far as `subprocess.Popen` has it."""

    def __init__(self, pid: int, errors: Path, wait) -> None:
        self.returncode: int | None = None
        self._pid, self._errors, self._wait = pid, errors, wait

    def poll(self) -> int | None:
        """Return None while it goes on, or has ended and was not waited for."""
        try:
            state = Path(f"/proc/{self._pid}/stat").read_text().rpartition(")")[2].split()[0]
        except FileNotFoundError:
            return 0
        return 0 if state == "Z" else None

    def send_signal(self, number: signal.Signals) -> None:
        """Send a signal, unless it has ended."""
        if self.returncode is None and self.poll() is None:
            os.kill(self._pid, number)

    def communicate(self, timeout: float) -> tuple[str, str]:
        """Wait until it ends, and return what it wrote as errors; the test has the time limit."""
        self.returncode = os.waitstatus_to_exitcode(int(self._wait()))
        return "", self._errors.read_text()


def count_in(path: Path) -> int:
    """Return how many frames were done."""
    counted = path.read_bytes() if path.exists() else b""
    return int(COUNT.unpack(counted)[0]) if len(counted) == COUNT.size else 0


def main() -> None:
    """Load all, and fork a run for each line of standard input."""
    from scalpel_sim.cli.app import command_line

    with tempfile.TemporaryDirectory() as folder:
        assert command_line(["run", "grid2", "-q", "--seconds", "0.02", "--out", folder]) == 0
    print("ready", flush=True)
    for line in sys.stdin:
        request = json.loads(line)
        pid = os.fork()
        if pid == 0:
            _run(request)
        print(pid, flush=True)
        print(os.waitpid(pid, 0)[1], flush=True)


def _run(request: dict) -> None:
    """Be one run, and end."""
    from scalpel_sim.__main__ import main as run_program
    from scalpel_sim.simulation import Simulation

    with open(request["errors"], "w") as file:
        os.dup2(file.fileno(), sys.stderr.fileno())
    path = Path(request["count"])
    path.write_bytes(bytes(COUNT.size))
    with path.open("r+b") as file:
        memory = mmap.mmap(file.fileno(), COUNT.size)
    step = Simulation.step

    def counted(simulation: Simulation) -> object:
        done = step(simulation)
        COUNT.pack_into(memory, 0, len(simulation.recording))
        return done

    patch.object(Simulation, "step", counted).start()
    sys.argv = ["scalpel-sim", *request["words"]]
    code = 1
    try:
        run_program()
    except SystemExit as end:
        code = int(end.code or 0)
    finally:
        sys.stderr.flush()
        os._exit(code)


if __name__ == "__main__":
    main()
