"""A table on disk that grows row by row while a run goes on."""

from pathlib import Path


class GrowingFile:
    """A file to which whole rows are added. What cannot be written is kept for the next attempt.

    Each `append` reaches the system at once, so that it survives the death of the process.

    Args:
        path: The file; one that is there is replaced.
        head: Its first line [bytes], which stays when the file is cut back.
        n_kept: How much is kept of a file that is there [bytes]; 0: it is replaced.

    Raises:
        OSError: the system refuses.
    """

    def __init__(self, path: Path, head: bytes, n_kept: int = 0) -> None:
        self.path = path
        self._file = path.open("r+b" if n_kept else "wb", buffering=0)
        self._length = n_kept  # of the whole rows that are on disk
        self._pending = b""
        self._n_head = len(head)
        if n_kept:
            self._cut(n_kept)
        else:
            self.append(head)

    @property
    def length(self) -> int:
        """Length with what is not written yet [bytes]."""
        return self._length + len(self._pending)

    def append(self, rows: bytes) -> None:
        """Add whole rows, after those that could not be written before.

        Raises:
            OSError: the system refuses. The file then ends after the last row that was written, and
                the rows are kept.
        """
        self._pending += rows
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

    def cut_back(self, length: int | None) -> None:
        """Take off what was added after the file had this length [bytes]; None: all but the head.

        Raises:
            OSError: the system refuses.
        """
        end = self._n_head if length is None else length
        self._pending = self._pending[: max(end - self._length, 0)]
        if end < self._length:
            self._cut(end)
            self._length = end

    def close(self) -> None:
        """Close it. May be called twice."""
        self._file.close()

    def _cut(self, end: int) -> None:
        """Make the file that long [bytes], and go on writing there."""
        self._file.truncate(end)
        self._file.seek(end)
