"""A table on disk that grows row by row while a run goes on."""

from pathlib import Path

from scalpel_sim.recording.file_sum import FileSum


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
        """Make the file that long [bytes], and go on writing there."""
        self._file.truncate(end)
        self._file.seek(end)
