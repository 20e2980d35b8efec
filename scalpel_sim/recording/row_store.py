"""`RowStore`: rows of numbers without end, of which memory holds some seconds' worth."""

import mmap
import os
import struct
import tempfile
from collections.abc import Iterator, Sequence
from io import FileIO
from pathlib import Path

import numpy as np

from scalpel_sim.errors import RunError
from tissue import FloatArray

ROWS_IN_MEMORY = 8192
"""Rows that are kept in memory before a file is begun: 8 s of frames, some 4 MB."""

ROWS_PER_WRITE = 256
"""Rows that are then written together, in a tenth of a millisecond."""

_ROWS_PER_READ = 4096
"""Rows that are read together: some 2 MB."""


class RowStore:
    """Rows of numbers, one after the other.

    More than `ROWS_IN_MEMORY` are written to a temporary file that has no name, so that nothing is
    left of it, however the process ends.

    Args:
        n_columns: Numbers of a row.
        folder: Where that file is made; None: where the system has temporary files.
    """

    def __init__(self, n_columns: int, folder: Path | None = None) -> None:
        self.folder = folder
        """Where the file will be made; see `RowStore`."""
        self._row = struct.Struct(f"{n_columns}d")
        self._shape = (-1, n_columns)
        self._n = self._first = 0
        """Number of rows, and the number of the first that is in memory."""
        self._file: FileIO | None = None
        self._take_room(ROWS_IN_MEMORY)

    def _take_room(self, n_rows: int) -> None:
        self._room: FloatArray = np.zeros((n_rows, self._shape[1]))
        self._memory = self._room.data.cast("B")

    def __len__(self) -> int:
        return self._n

    @property
    def are_in_memory(self) -> bool:
        """Whether all rows are in memory."""
        return self._file is None

    def append(self, row: Sequence[float]) -> None:
        """Add a row.

        Raises:
            RunError: the file cannot be written. The rows before are kept.
        """
        at = self._n - self._first
        if at == len(self._room):
            self._write()
            if at > ROWS_PER_WRITE:
                self._take_room(ROWS_PER_WRITE)
            self._first, at = self._n, 0
        # For NumPy to look at fifty numbers of a list takes three times as long.
        self._row.pack_into(self._memory, at * self._row.size, *row)
        self._n += 1

    def cut_back(self, n_rows: int) -> None:
        """Forget all rows but the first `n_rows`, of which there are as many."""
        self._first, self._n = min(self._first, n_rows), n_rows

    def since(self, n_rows: int) -> FloatArray:
        """Return the rows after the first `n_rows`. A view, until the next row comes."""
        if n_rows >= self._first:
            return self._room[n_rows - self._first : self._n - self._first]
        return self.rows()[n_rows:]

    def rows(self) -> FloatArray:
        """Return all rows. A view; of a file, it cannot be written.

        Raises:
            RunError: the file cannot be written.
        """
        if self._file is None:
            return self._room[: self._n]
        if not self._n:
            return np.zeros((0, self._shape[1]))
        self._write()
        mapped = mmap.mmap(self._file.fileno(), self._n * self._row.size, access=mmap.ACCESS_READ)
        return np.frombuffer(mapped).reshape(self._shape)

    def parts(self, first: int = 0) -> Iterator[FloatArray]:
        """Yield the rows from one on, some thousands at a time: a view, until the next comes.

        Raises:
            RunError: the file cannot be written, or not be read.
        """
        if self._file is None:
            yield self._room[first : self._n]
            return
        self._write()
        part = np.empty((_ROWS_PER_READ, self._shape[1]))
        for begin in range(first, self._n, _ROWS_PER_READ):
            found = part[: min(_ROWS_PER_READ, self._n - begin)]
            self._file.seek(begin * self._row.size)
            if self._file.readinto(found.data.cast("B")) != found.nbytes:
                raise RunError("the temporary file of the recording cannot be read")
            yield found

    def _write(self) -> None:
        """Write the rows that are in memory."""
        left = self._memory[: (self._n - self._first) * self._row.size]
        try:
            if self._file is None:
                self._file = unnamed_file(self.folder)
            self._file.seek(self._first * self._row.size)
            while left:
                left = left[self._file.write(left) :]
        except OSError as error:
            where = self.folder or tempfile.gettempdir()
            raise RunError(
                f"{where}: the recording cannot be written there ({error.strerror or error}); make "
                "room"
            ) from error


def unnamed_file(folder: Path | None = None) -> FileIO:
    """Return such a file, open to read and to write, without a buffer.

    Args:
        folder: On whose disk it is; None: where the system has temporary files.

    Raises:
        OSError: it cannot be made.
    """
    with tempfile.TemporaryFile(buffering=0, dir=folder) as file:
        return FileIO(os.dup(file.fileno()), "r+b")
