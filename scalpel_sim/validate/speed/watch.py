"""The progress bar of a benchmark: drawn between two turns, never during one."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from scalpel_sim.runs.options import PrintOptions

if TYPE_CHECKING:
    from rich.progress import Progress


class Watch:
    """Receives the progress of a benchmark; this base class ignores it."""

    def begin(self, n_turns: int) -> None:
        """Expect this many turns."""

    def tick(self, name: str) -> None:
        """Count one turn of the case `name` as done."""


SILENT = Watch()


class ProgressWatch(Watch):
    """Draws a progress bar, a new one for each benchmark."""

    def __init__(self, progress: "Progress") -> None:
        self._progress = progress
        self._task = progress.add_task("", total=None)

    def begin(self, n_turns: int) -> None:
        """Begin a new bar."""
        self._progress.reset(self._task, total=n_turns, description="measuring")

    def tick(self, name: str) -> None:
        """Advance the bar by one turn."""
        self._progress.update(self._task, advance=1, description=name, refresh=True)


@contextmanager
def watching(printing: PrintOptions) -> Iterator[Watch]:
    """Yield a progress bar where standard error is a terminal, else a silent watch."""
    if printing.quiet or not sys.stderr.isatty():
        yield SILENT
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn

    columns = (BarColumn(), MofNCompleteColumn(), TextColumn("{task.description}"))
    # A thread that draws would take time from what is measured.
    with Progress(
        *columns, console=Console(stderr=True), transient=True, auto_refresh=False
    ) as progress:
        yield ProgressWatch(progress)
