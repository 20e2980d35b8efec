"""Tables that grow step by step in one HDF5 file, which is whole whenever its writer is killed."""

import logging
import os
from collections.abc import Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from scalpel_sim.errors import writing
from scalpel_sim.file_lock import take_lock
from scalpel_sim.saved_run.preallocated_file import (
    STEP_TIMES,
    Describe,
    GrowingTable,
    PreallocatedFile,
)
from tissue.support import remove_unfinished, whole_file

NEARLY_FULL = 0.6
"""Share of its capacity that a table may use before a larger file is made. Meanwhile the rest must
last: a copy takes seconds, and the capacity is that of half a minute or more."""

_log = logging.getLogger(__name__)

_OPTION = "--record"
_INSTEAD = f"another {_OPTION}"

_UNFINISHED = ".part"
"""Ending of a file that is not in place, which `remove_unfinished` knows."""


@dataclass
class _Growth:
    """A larger file that a thread makes."""

    file: "Future[PreallocatedFile]"
    copied: dict[str, int]
    """Rows of each table that it has, of those that are still the same."""


class GrowingTables:
    """Tables to which rows are added: see `PreallocatedFile`.

    The file appears under its name with the first step. Before the capacity of a table is used up,
    a thread lays out a file with twice as much, which then replaces it: nothing waits for the copy.

    Until it is closed no other run can write the file.

    Args:
        path: The file; one that is there is replaced by the first step.
        tables: The tables; `STEP_TIMES` is one of them.
        describe: Writes what does not grow; also called by that thread.

    Raises:
        RunError: the system refuses, another run is writing the file, or this version of HDF5 lays
            files out otherwise.
    """

    def __init__(self, path: Path, tables: Sequence[GrowingTable], describe: Describe) -> None:
        self.path = path
        self._tables = {table.name: table for table in tables}
        self._describe = describe
        self._lengths = dict.fromkeys(self._tables, 0)
        self._n_files = 0
        self._thread = ThreadPoolExecutor(1, thread_name_prefix="recording")
        self._growth: _Growth | None = None
        self._grows_early = True
        self._release = take_lock(path.with_name(f".{path.name}.lock"), path, _OPTION)
        try:
            with writing(path, _INSTEAD):
                remove_unfinished(path)
                self._file = self._new_file(self._next_path())
        except BaseException:
            self._release()
            raise

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
            while not self._file.has_capacity(name, end):
                if self._growth is None:
                    self._begin_growth({name: end})
                self._end_growth()
            try:
                self._file.write(name, first, numbers.tobytes())
            except OSError:
                if self._growth is None:
                    raise
                self._drop_growth()  # the larger file took the space that this one needs
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
            if self._growth is None:
                if self._grows_early and self._is_nearly_full:
                    self._begin_growth({})
            elif self._growth.file.done():
                try:
                    self._end_growth()
                except OSError:  # it is tried again where a table is full, and raises there
                    self._grows_early = False

    def cut_back(self, lengths: Sequence[int]) -> None:
        """Take off what was added after `lengths` were these; at least one step stays.

        Raises:
            RunError: the system refuses.
        """
        self._lengths = dict(zip(self._lengths, map(int, lengths), strict=True))
        if self._growth is not None:
            copied = self._growth.copied
            self._growth.copied = {n: min(copied[n], k) for n, k in self._lengths.items()}
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
        self._reserve(self._lengths)
        with writing(self.path, _INSTEAD):
            self._file.close()
            self._file.path.unlink()
            self._file = self._new_file(self._next_path())
            self._file.copy(self.path, starts, self._lengths)
            self._file.show(self._lengths)
            self._put_in_place()

    def finish(self) -> None:
        """Close the file, and take spare capacity out of it.

        Where the system refuses, that is logged, and the file stays as it is, with all steps.
        """
        starts, is_in_place = self._file.starts, self._is_in_place
        self._end_writing()
        try:
            if is_in_place:
                self._drop_spare_capacity(starts)
        except OSError as error:
            _log.warning(
                "%s: is complete, but cannot be written anew without the space that was not used "
                "(%s): it looks larger than it is",
                self.path,
                error.strerror or error,
            )
        finally:
            self._release()

    def _drop_spare_capacity(self, starts: Mapping[str, int]) -> None:
        """Write the file anew without spare capacity; its tables begin there [bytes]."""
        exact = [each._replace(capacity=self._lengths[name]) for name, each in self._tables.items()]
        with whole_file(self.path) as unfinished:
            file = PreallocatedFile(unfinished, exact, self._describe)
            try:
                file.copy(self.path, starts, self._lengths)
                file.show(self._lengths)
            finally:
                file.close()

    def close(self) -> None:
        """Close the file as it is, and let others write it. May be called twice."""
        try:
            self._end_writing()
        finally:
            self._release()

    def _end_writing(self) -> None:
        """Close the file. May be called twice."""
        self._drop_growth()
        self._thread.shutdown()
        self._file.close()
        if not self._is_in_place:
            self._file.path.unlink(missing_ok=True)

    @property
    def _is_in_place(self) -> bool:
        """Whether the file has its name."""
        return self._file.path == self.path

    @property
    def _is_nearly_full(self) -> bool:
        """Whether a table has little capacity left."""
        return any(
            n > NEARLY_FULL * self._tables[name].capacity for name, n in self._lengths.items()
        )

    def _next_path(self) -> Path:
        """Return a name of a file that is not in place."""
        self._n_files += 1
        return self.path.with_name(f".{self.path.name}.{os.getpid()}-{self._n_files}{_UNFINISHED}")

    def _new_file(self, path: Path) -> PreallocatedFile:
        """Lay out a file; where that fails, there is none."""
        try:
            return PreallocatedFile(path, self._tables.values(), self._describe)
        except BaseException:
            path.unlink(missing_ok=True)
            raise

    def _put_in_place(self) -> None:
        """Give the file its name."""
        if not self._is_in_place:
            self._file.move_to(self.path)

    def _reserve(self, n_rows: Mapping[str, int]) -> None:
        """Double the capacity of tables, in the next file, until they take so many rows."""
        for name, n in n_rows.items():
            capacity = max(self._tables[name].capacity, 1)
            while capacity < n:
                capacity *= 2
            self._tables[name] = self._tables[name]._replace(capacity=capacity)

    def _begin_growth(self, n_rows: Mapping[str, int]) -> None:
        """Begin to make a larger file.

        Args:
            n_rows: Rows that some tables must be able to take.
        """
        nearly = {
            name: 2 * each.capacity
            for name, each in self._tables.items()
            if self._lengths[name] > NEARLY_FULL * each.capacity
        }
        self._reserve(nearly)
        self._reserve(n_rows)
        path, source, starts = self._next_path(), self._file.path, self._file.starts
        copied = dict(self._lengths)

        def grown() -> PreallocatedFile:
            file = self._new_file(path)
            try:
                file.copy(source, starts, copied)
            except BaseException:
                file.close()
                path.unlink(missing_ok=True)
                raise
            return file

        self._growth = _Growth(self._thread.submit(grown), copied)

    def _drop_growth(self) -> None:
        """Stay in this file until a table of it is full: the larger one is removed."""
        growth, self._growth, self._grows_early = self._growth, None, False
        if growth is not None and growth.file.exception() is None:
            unused = growth.file.result()
            unused.close()
            unused.path.unlink(missing_ok=True)

    def _end_growth(self) -> None:
        """Continue in the larger file, once it is made."""
        assert self._growth is not None
        growth, self._growth = self._growth, None
        file, old = growth.file.result(), self._file
        try:
            file.copy(old.path, old.starts, self._lengths, growth.copied)
            if self._is_in_place:
                file.show(old.shown)
        except BaseException:
            file.close()
            file.path.unlink(missing_ok=True)
            raise
        self._file = file
        old.close()
        if old.path == self.path:
            self._put_in_place()
        else:
            old.path.unlink()
