"""What the command line says: log lines, the progress bar, the report of a run."""

import logging
import math
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from scalpel_sim.cli.options import Talk

if TYPE_CHECKING:  # an error of use should be said without waiting for a compiler
    from scalpel_sim.output.summary import Summary
    from scalpel_sim.simulation import Simulation

SECONDS_PER_PROGRESS = 0.1
"""So often is the progress bar drawn [s]."""


@contextmanager
def talking(talk: Talk) -> Iterator[None]:
    """Send what the parts log to standard error, as much of it as was asked for."""
    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(_OneLine())
    root = logging.getLogger()
    level = logging.ERROR if talk.quiet else logging.INFO if talk.verbose else logging.WARNING
    before = root.level
    root.addHandler(handler)
    root.setLevel(level)
    try:
        yield
    finally:
        root.removeHandler(handler)
        root.setLevel(before)


class _OneLine(logging.Formatter):
    """`warning: unused nodes dropped`, and plain text for what is only information."""

    def format(self, record: logging.LogRecord) -> str:
        """Return the line."""
        prefix = f"{record.levelname.lower()}: " if record.levelno >= logging.WARNING else ""
        return prefix + " ".join(record.getMessage().split())


def say(message: str) -> None:
    """Print one line on standard error, where it cannot get between the figures."""
    print(message, file=sys.stderr, flush=True)


def say_error(message: str) -> None:
    """Print one line on standard error."""
    say(f"error: {' '.join(message.split())}")


@contextmanager
def progress(seconds: float, talk: Talk) -> Iterator[Callable[["Simulation"], None]]:
    """Yield what to call after each frame: it moves a bar if a person is looking at one."""
    if talk.quiet or not sys.stderr.isatty():
        yield lambda simulation: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.completed:.2f} of {task.total:.2f} s"),
        TextColumn("{task.fields[force]:.2f} N"),
        TimeRemainingColumn(),
    )
    # Drawn between two frames: a thread that draws would make frames wait.
    with Progress(
        *columns, console=Console(stderr=True), transient=True, auto_refresh=False
    ) as bar:
        task = bar.add_task("cutting", total=seconds, force=0.0)
        due = time.monotonic()

        def advance(simulation: "Simulation") -> None:
            nonlocal due
            if time.monotonic() >= due:
                due = time.monotonic() + SECONDS_PER_PROGRESS
                force = math.hypot(*simulation.wrench.force.tolist())
                bar.update(task, completed=simulation.time, force=force, refresh=True)

        yield advance


def report(summary: "Summary", folder: Path, talk: Talk) -> None:
    """Say how it went."""
    if talk.json:
        from scalpel_sim.output.run_folder import summary_json

        print(summary_json(summary))
    elif not talk.quiet:
        from rich.console import Console

        from scalpel_sim.output.report import print_table

        print_table(summary, Console())
        print(f"files in {folder}: {', '.join(sorted(path.name for path in folder.iterdir()))}")
