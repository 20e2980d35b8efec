"""Tables that grow step by step in one HDF5 file, which is whole whenever its writer is killed."""

import logging
import os
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt

from scalpel_sim.errors import writing
from scalpel_sim.saved_run.laid_out_file import STEP_TIMES, Describe, GrowingTable, LaidOutFile
from tissue.support import remove_unfinished, whole_file

_log = logging.getLogger(__name__)

_INSTEAD = "another --record"

_UNFINISHED = ".part"
"""Ending of a file that is not in place, which `remove_unfinished` knows."""


class GrowingTables:
    """Tables to which rows are added: see `LaidOutFile`.

    The file appears under its name with the first step. Where there is too little room for more,
    one with twice as much is laid out, and replaces it.

    Args:
        path: The file; one that is there is replaced by the first step.
        tables: The tables; `STEP_TIMES` is one of them.
        describe: Writes what does not grow.

    Raises:
        RunError: the system refuses, or this version of HDF5 lays files out otherwise.
    """

    def __init__(self, path: Path, tables: Sequence[GrowingTable], describe: Describe) -> None:
        self.path = path
        self._tables = {table.name: table for table in tables}
        self._describe = describe
        self._lengths = dict.fromkeys(self._tables, 0)
        self._n_files = 0
        with writing(path, _INSTEAD):
            remove_unfinished(path)
            self._file = self._new_file()

    @property
    def lengths(self) -> tuple[int, ...]:
        """Numbers of rows of all tables, in order."""
        return tuple(self._lengths.values())

    @property
    def n_steps(self) -> int:
        """Number of steps."""
        return self._lengths[STEP_TIMES]

    def has(self, name: str) -> bool:
        """Return whether there is a table of that name."""
        return name in self._tables

    def length(self, name: str) -> int:
        """Return the number of rows of a table."""
        return self._lengths[name]

    def append(self, name: str, rows: npt.ArrayLike) -> int:
        """Add rows to a table, which are seen after the next `commit`.

        Args:
            name: The table.
            rows: The rows, shape (n, *width).

        Returns:
            The number of the first of them.

        Raises:
            RunError: the system refuses.
        """
        table, first = self._tables[name], self._lengths[name]
        numbers = np.ascontiguousarray(rows, table.kind).reshape(-1, *table.width)
        end = first + len(numbers)
        with writing(self.path, _INSTEAD):
            if not self._file.has_room(name, end):
                self._make_room(name, end)
            self._file.write(name, first, numbers.tobytes())
        self._lengths[name] = end
        return first

    def commit(self) -> None:
        """Show what was added to those who read the file.

        Raises:
            RunError: the system refuses.
        """
        with writing(self.path, _INSTEAD):
            self._file.show(self._lengths)
            self._put_in_place()

    def cut_back(self, lengths: Sequence[int]) -> None:
        """Take off what was added after `lengths` were these; at least one step stays.

        Raises:
            RunError: the system refuses.
        """
        self._lengths = dict(zip(self._lengths, map(int, lengths), strict=True))
        with writing(self.path, _INSTEAD):
            self._file.show(self._lengths)

    def take(self, starts: Mapping[str, int], lengths: Sequence[int]) -> None:
        """Continue with the first rows of the tables of the file that is in place.

        Args:
            starts: Where its tables begin [bytes].
            lengths: How many rows of each are kept.

        Raises:
            RunError: the system refuses.
        """
        self._lengths = dict(zip(self._lengths, map(int, lengths), strict=True))
        for name, n_rows in self._lengths.items():
            self._reserve(name, n_rows)
        with writing(self.path, _INSTEAD):
            self._replace_file(self.path, starts)
            self._file.show(self._lengths)
            self._put_in_place()

    def finish(self) -> None:
        """Close the file, and take the room that is left out of it.

        Where the system refuses, that is logged, and the file stays as it is, with all steps.
        """
        starts, is_in_place = self._file.starts, self._file.path == self.path
        self.close()
        if not is_in_place:
            return
        exact = [each._replace(room=self._lengths[name]) for name, each in self._tables.items()]
        try:
            with whole_file(self.path) as unfinished:
                file = LaidOutFile(unfinished, exact, self._describe)
                try:
                    file.copy(self.path, starts, self._lengths)
                    file.show(self._lengths)
                finally:
                    file.close()
        except OSError as error:
            _log.warning(
                "%s: is complete, but cannot be written anew without the room that was not used "
                "(%s): it looks larger than it is",
                self.path,
                error.strerror or error,
            )

    def close(self) -> None:
        """Close the file as it is. May be called twice."""
        self._file.close()
        if self._file.path != self.path:
            self._file.path.unlink(missing_ok=True)

    def _new_file(self) -> LaidOutFile:
        """Lay out a file under a name that is not the one of the file."""
        self._n_files += 1
        name = f".{self.path.name}.{os.getpid()}-{self._n_files}{_UNFINISHED}"
        path = self.path.with_name(name)
        try:
            return LaidOutFile(path, self._tables.values(), self._describe)
        except BaseException:
            path.unlink(missing_ok=True)
            raise

    def _put_in_place(self) -> None:
        """Give the file its name."""
        if self._file.path != self.path:
            self._file.move_to(self.path)

    def _reserve(self, name: str, n_rows: int) -> None:
        """Double the room of a table until it takes so many rows, in the next file."""
        room = max(self._tables[name].room, 1)
        while room < n_rows:
            room *= 2
        self._tables[name] = self._tables[name]._replace(room=room)

    def _make_room(self, name: str, n_rows: int) -> None:
        """Continue in a file with room for so many rows of a table."""
        self._reserve(name, n_rows)
        was_in_place, shown = self._file.path == self.path, self._file.shown
        self._replace_file(self._file.path, self._file.starts)
        if was_in_place:
            self._file.show(shown)
            self._put_in_place()

    def _replace_file(self, source: Path, starts: Mapping[str, int]) -> None:
        """Continue in a new file that has the rows of a file before.

        Args:
            source: That file.
            starts: Where its tables begin [bytes].
        """
        old, new = self._file, self._new_file()
        try:
            new.copy(source, starts, self._lengths)
        except BaseException:
            new.close()
            new.path.unlink(missing_ok=True)
            raise
        self._file = new
        old.close()
        if old.path != self.path:
            old.path.unlink(missing_ok=True)
