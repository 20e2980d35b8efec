"""The progress bar of a benchmark: drawn between two turns, never during one."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from scalpel_sim.cli.options import PrintOptions

if TYPE_CHECKING:
    from rich.progress import Progress


class Watch:
    """Told how far a benchmark is; this one says nothing."""

    def begin(self, n_turns: int) -> None:
        """Expect so many turns."""

    def tick(self, name: str) -> None:
        """Take note that a turn of the case is over."""


SILENT = Watch()


class Bar(Watch):
    """Shows a bar; each benchmark begins a new one."""

    def __init__(self, progress: "Progress") -> None:
        self._progress = progress
        self._task = progress.add_task("", total=None)

    def begin(self, n_turns: int) -> None:
        """Begin a new bar."""
        self._progress.reset(self._task, total=n_turns, description="measuring")

    def tick(self, name: str) -> None:
        """Move the bar."""
        self._progress.update(self._task, advance=1, description=name, refresh=True)


@contextmanager
def watching(printing: PrintOptions) -> Iterator[Watch]:
    """Yield a bar if a person is looking at one."""
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
        yield Bar(progress)
