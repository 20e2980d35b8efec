"""Printing: log lines, the progress bar, the report of a run."""

import logging
import math
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from scalpel_sim.errors import Interrupted, RunError, WarnedError
from scalpel_sim.runs.options import PrintOptions, RunOutputOptions
from scalpel_sim.runs.stop_signals import StopSignals

if TYPE_CHECKING:  # an error of use should be printed without waiting for a compiler
    from rich.progress import Progress, ProgressColumn

    from scalpel_sim.output.summary import Summary
    from scalpel_sim.runs.prepared_run import PreparedRun
    from scalpel_sim.simulation import Simulation

SECONDS_PER_PROGRESS = 0.1
"""Interval at which the progress bar is drawn [s]."""
SECONDS_PER_LINE = 5.0
"""Interval at which progress is printed where standard error is no terminal [s]."""


@contextmanager
def log_to_stderr(options: PrintOptions) -> Iterator[None]:
    """Send log messages to standard error, from the level that was requested."""
    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(_OneLine())
    root = logging.getLogger()
    level = logging.ERROR if options.quiet else logging.INFO if options.verbose else logging.WARNING
    before = root.level
    root.addHandler(handler)
    root.setLevel(level)
    try:
        yield
    finally:
        root.removeHandler(handler)
        root.setLevel(before)


class _OneLine(logging.Formatter):
    """One line a message: `warning: unused nodes dropped`, and no prefix for information."""

    def format(self, record: logging.LogRecord) -> str:
        """Return the line."""
        prefix = f"{record.levelname.lower()}: " if record.levelno >= logging.WARNING else ""
        return prefix + " ".join(record.getMessage().split())


def say(message: str) -> None:
    """Print one line on standard error, where it does not mix with the results."""
    print(message, file=sys.stderr, flush=True)


def say_error(message: str) -> None:
    """Print an error on standard error, in one line."""
    say(f"error: {' '.join(message.split())}")


@contextmanager
def progress(seconds: float, options: PrintOptions) -> Iterator[Callable[["Simulation"], None]]:
    """Yield a function to call after each frame. On a terminal it draws a progress bar."""
    if options.quiet or not sys.stderr.isatty():
        yield lambda simulation: None
        return
    from rich.progress import BarColumn, TextColumn, TimeRemainingColumn

    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.completed:.2f} of {task.total:.2f} s"),
        TextColumn("{task.fields[force]:.2f} N"),
        TimeRemainingColumn(),
    )
    with _bar(*columns) as bar:
        task = bar.add_task("cutting", total=seconds, force=0.0)
        due = time.monotonic()

        def advance(simulation: "Simulation") -> None:
            nonlocal due
            if time.monotonic() >= due:
                due = time.monotonic() + SECONDS_PER_PROGRESS
                force = math.hypot(*simulation.wrench.force.tolist())
                bar.update(task, completed=simulation.time, force=force, refresh=True)

        yield advance


@contextmanager
def compiling(options: PrintOptions) -> Iterator[Callable[[int, int], None]]:
    """Yield a function that shows how many kernels are compiled, and how many there will be.

    On a terminal it draws a progress bar, elsewhere it prints a line from time to time.
    """
    began = shown = time.monotonic()
    if options.quiet:
        yield lambda done, total: None
    elif sys.stderr.isatty():
        from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeElapsedColumn

        description, n_of_all = TextColumn("{task.description}"), MofNCompleteColumn()
        with _bar(description, BarColumn(), n_of_all, TimeElapsedColumn()) as bar:
            task = bar.add_task("compiling kernels, first run only", total=None, visible=False)
            yield lambda done, total: bar.update(
                task, completed=done, total=total, visible=True, refresh=True
            )
    else:

        def print_line(done: int, total: int) -> None:
            nonlocal shown
            now = time.monotonic()
            if now >= shown:
                shown = now + SECONDS_PER_LINE
                say(f"compiling kernels, first run only: {done} of {total}, {now - began:.0f} s")

        yield print_line


def _bar(*columns: "ProgressColumn") -> "Progress":
    """Return a progress bar on standard error, which is drawn where it is updated.

    A thread that draws would make frames wait.
    """
    from rich.console import Console
    from rich.progress import Progress

    return Progress(*columns, console=Console(stderr=True), transient=True, auto_refresh=False)


def print_report(summary: "Summary", prepared: "PreparedRun") -> None:
    """Print the summary of a run, as a table or as JSON, and the names of its files."""
    folder, options = prepared.folder, prepared.printing
    if options.json:
        from scalpel_sim.output.summary import summary_json

        print(summary_json(summary))
    elif not options.quiet:
        from rich.console import Console

        from scalpel_sim.output.report import print_summary

        print_summary(summary, Console())
        names = sorted(path.name for path in folder.iterdir() if not path.name.startswith("."))
        print(f"files in {folder}: {', '.join(names)}")
        if prepared.exports:
            print(f"exported: {', '.join(map(str, prepared.exports))}")
        if prepared.record is not None:
            print(f"recorded: {prepared.record}; scalpel-sim replay {prepared.record} plays it")


def expect_no_warnings(summary: "Summary", options: RunOutputOptions) -> None:
    """Check that a run ended without warnings, if that is requested.

    Raises:
        WarnedError: it did not; the message names their kinds.
    """
    kinds = [warning["kind"] for warning in summary.warnings]
    if options.strict and kinds:
        raise WarnedError(
            f"the run ended with a warning, and --strict is given: {', '.join(kinds)}"
        )


def wait_until(
    message: str,
    has_begun: Callable[[], bool],
    what: str,
    on_wait: Callable[[], None],
    is_running: Callable[[], bool],
) -> None:
    """Print a message, and wait until a run begins.

    Args:
        message: What to print.
        has_begun: Whether it does.
        what: What begins it, for messages.
        on_wait: Called time and again; it takes some milliseconds.
        is_running: Whether the viewer still runs.

    Raises:
        Interrupted: the user or the system ended the program before.
        RunError: the viewer has ended before.
    """
    with StopSignals() as stop:
        say(message)  # from now on Ctrl-C ends it without a traceback
        while not has_begun():
            if stop.reason is not None:
                raise Interrupted(f"{stop.reason} before {what}")
            if not is_running():
                raise RunError(f"the viewer has ended before {what}")
            on_wait()
