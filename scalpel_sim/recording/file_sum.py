"""`FileSum`: how far a file that grows has got, with a checksum of it until there."""

import zlib
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple, Self

_BYTES_PER_READ = 1 << 20
"""How much of a file is read at once [bytes]."""


class FileSum(NamedTuple):
    """The first bytes of a file. It is carried on with what is added, without reading the file."""

    n_bytes: int = 0
    """How many there are."""
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
