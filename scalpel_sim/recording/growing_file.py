"""A table on disk that grows row by row during a run, and checksums of what it holds."""

import zlib
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple, Self

_BYTES_PER_READ = 1 << 20
"""Length of what is read of a file at once [bytes]."""


class FileSum(NamedTuple):
    """The first bytes of a file. It is carried on with what is added, without reading the file."""

    n_bytes: int = 0
    """Number of these bytes."""
    crc: int = 0
    """Their CRC-32: against damage, not against malice."""

    def after(self, data: bytes | memoryview) -> Self:
        """Return the checksum when these bytes have been added."""
        return self._replace(n_bytes=self.n_bytes + len(data), crc=zlib.crc32(data, self.crc))


def sums_that_hold(path: Path, sums: Iterable[FileSum]) -> set[FileSum]:
    """Return which of some checksums a file agrees with. One that is not there has no bytes.

    Raises:
        OSError: it cannot be read.
    """
    found, now = set(), FileSum()
    try:
        with path.open("rb") as file:
            for each in sorted(set(sums)):
                while data := file.read(min(each.n_bytes - now.n_bytes, _BYTES_PER_READ)):
                    now = now.after(data)
                if now == each:
                    found.add(each)
    except FileNotFoundError:
        return {FileSum()}.intersection(sums)
    return found


def sum_of(path: Path) -> FileSum:
    """Return the checksum of a whole file.

    Raises:
        OSError: it cannot be read.
    """
    now = FileSum()
    with path.open("rb") as file:
        while data := file.read(_BYTES_PER_READ):
            now = now.after(data)
    return now


class GrowingFile:
    """A file to which whole rows are added. What cannot be written is kept for the next attempt.

    Each `append` reaches the system at once, so that it survives the death of the process.

    Args:
        path: The file; one that is there is replaced.
        head: Its first line [bytes], which stays when the file is cut back.
        kept: What is kept of a file that is there; of no bytes: it is replaced.

    Raises:
        OSError: the system refuses.
    """

    def __init__(self, path: Path, head: bytes, kept: FileSum = FileSum()) -> None:
        self.path = path
        self._file = path.open("r+b" if kept.n_bytes else "wb", buffering=0)
        self._length = kept.n_bytes  # of the whole rows that are on disk
        self._pending = b""
        self._head = FileSum().after(head)
        self.sum = kept
        """Length and checksum, with what is not written yet."""
        if kept.n_bytes:
            self._cut(kept.n_bytes)
        else:
            self.append(head)

    def append(self, rows: bytes) -> None:
        """Add whole rows, after those that could not be written before.

        Raises:
            OSError: the system refuses. The file then ends after the last row that was written, and
                the rows are kept.
        """
        self._pending += rows
        self.sum = self.sum.after(rows)
        if not self._pending:
            return
        rest = memoryview(self._pending)
        try:
            while rest:  # a disk that gets full takes a part
                rest = rest[self._file.write(rest) :]
        except OSError:
            self._cut(self._length)
            raise
        self._length += len(self._pending)
        self._pending = b""

    def cut_back(self, mark: FileSum | None) -> None:
        """Take off what was added after `sum` was this; None: all but the head.

        Raises:
            OSError: the system refuses.
        """
        self.sum = self._head if mark is None else mark
        end = self.sum.n_bytes
        self._pending = self._pending[: max(end - self._length, 0)]
        if end < self._length:
            self._cut(end)
            self._length = end

    def close(self) -> None:
        """Close it. May be called twice."""
        self._file.close()

    def _cut(self, end: int) -> None:
        """Make the file that long [bytes], and continue there."""
        self._file.truncate(end)
        self._file.seek(end)
