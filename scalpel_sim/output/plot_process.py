"""A process that draws plots; it loads matplotlib while the run continues."""

import contextlib
import json
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import IO, cast

from scalpel_sim.errors import RunError
from tissue.support import whole_file

_TIMEOUT = 60.0
"""Time that a plot may take [s]. It takes a second, or ten when matplotlib first looks for
fonts."""


_PROGRAM = (
    "from scalpel_sim.output.plot_process import draw_requested_plots; draw_requested_plots()"
)


class Plotter:
    """A process that draws on request. It ends when it is closed, or when this process ends.

    Loading matplotlib takes as long as a short run does; here it costs the run nothing.
    """

    def __init__(self) -> None:
        # A session of its own: the Ctrl-C that ends a run must not end the drawing of it.
        self._process = subprocess.Popen(
            [sys.executable, "-c", _PROGRAM],
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
            env={**os.environ, "PYTHONPATH": os.pathsep.join(path for path in sys.path if path)},
        )

    def start(self, recorded: Path, title: str, forces: Path, energies: Path) -> None:
        """Request the plots of a `forces.csv`. They are drawn while this process continues.

        Args:
            recorded: The table.
            title: Heading of the pictures.
            forces: Where the picture of the forces goes.
            energies: Where that of the energies goes, if they are in the table.
        """
        self._forces = forces
        paths = {"recorded": recorded, "forces": forces, "energies": energies}
        said = {"title": title, "owner": os.getpid()}
        request = json.dumps(said | {key: str(path) for key, path in paths.items()})
        stdin = cast(IO[str], self._process.stdin)
        with contextlib.suppress(BrokenPipeError):  # `finish` says why
            stdin.write(request + "\n")
            stdin.flush()

    def finish(self) -> None:
        """Wait until the plots are drawn, which ends the process.

        Raises:
            RunError: a plot could not be drawn or written.
        """
        forces = self._forces
        try:
            _, complaint = self._process.communicate(timeout=_TIMEOUT)
        except subprocess.TimeoutExpired:
            self.close()
            raise RunError(f"{forces}: drawing it took more than {_TIMEOUT:g} s") from None
        if self._process.returncode != 0:
            reason = complaint.strip().rpartition("\n")[2] or f"exit {self._process.returncode}"
            raise RunError(f"{forces}: could not be drawn ({reason})")

    def __enter__(self) -> "Plotter":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """End the process, if it still runs."""
        self._process.kill()
        self._process.wait()
        for pipe in (self._process.stdin, self._process.stderr):
            cast(IO[str], pipe).close()


def draw_requested_plots() -> None:
    """Load matplotlib, and draw the plots that standard input then requests."""
    from scalpel_sim.output.plots import plot_energies, plot_forces
    from scalpel_sim.recording.recording import read_forces

    text = sys.stdin.readline()
    if text:
        request = json.loads(text)
        recording = read_forces(Path(request["recorded"]))
        with _file_of(request["owner"], request["forces"]) as unfinished:
            plot_forces(recording, request["title"], unfinished)
        if recording.is_audited:
            with _file_of(request["owner"], request["energies"]) as unfinished:
                plot_energies(recording, request["title"], unfinished)


@contextlib.contextmanager
def _file_of(owner: int, path: str) -> Iterator[Path]:
    """Yield a name to draw at, which replaces `path` if the process that requested it still runs.

    The folder of one that was killed may be that of another run by now.
    """
    with whole_file(path) as unfinished:
        yield unfinished
        if os.getppid() != owner:
            sys.exit("the run that requested the plot has ended")
