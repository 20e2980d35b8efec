"""The bytes of a file, read piece by piece; errors name the line of a piece that is missing."""

import re
import warnings
from typing import NoReturn

import numpy as np
import numpy.typing as npt

from tissue.core.array_types import FloatArray, IntArray
from tissue.mesh.mesh_arrays import MeshError

MAX_SHOWN = 40
"""Characters that an error quotes at most."""

PIECE = 1 << 22
"""Text that is searched at once [bytes]: it takes some ten times as much memory."""


class ByteReader:
    """A file in memory, and how far it has been read."""

    def __init__(self, data: bytes) -> None:
        self.data = data
        self.at = 0
        """Index of the next byte to be read."""

    def fail(self, message: str, at: int | None = None) -> NoReturn:
        """Raise a `MeshError` that names the line of byte `at`, by default the next one."""
        at = self.at if at is None else at
        line = self.data.count(b"\n", 0, at) + 1
        raise MeshError(f"line {line}: {message}")

    def line(self) -> str:
        """Read to the end of the line; return it without the blanks around it."""
        end = self.data.find(b"\n", self.at)
        end = len(self.data) if end < 0 else end
        text = self.data[self.at : end].decode("latin-1").strip()
        self.at = min(end + 1, len(self.data))
        return text

    def line_with_text(self) -> str:
        """Read the next line that is not blank; return "" at the end of the file."""
        self.skip_blanks()
        return self.line()

    def skip_blanks(self) -> None:
        """Move to the next byte that is not a blank."""
        blanks = re.compile(rb"\s*").match(self.data, self.at)
        self.at = blanks.end() if blanks else self.at

    def find(self, pattern: bytes, what: str) -> re.Match[bytes]:
        """Return where a regular expression first matches from here on, or fail without `what`."""
        match = re.compile(pattern).search(self.data, self.at)
        if match is None:
            self.fail(f"expected {what} from here on, found none; is the file truncated?")
        return match

    def binary(self, count: int, dtype: str, what: str) -> npt.NDArray[np.generic]:
        """Take `count` numbers of `dtype` (with byte order); a view of the file's bytes."""
        size = np.dtype(dtype).itemsize
        left = len(self.data) - self.at
        if not 0 <= count * size <= left:
            self.fail(
                f"expected {count} {what} ({count * size} bytes), found {left} bytes to the end of "
                "the file"
            )
        values: npt.NDArray[np.generic] = np.frombuffer(self.data, dtype, count, self.at)
        self.at += count * size
        return values

    def floats(self, end: int, what: str) -> FloatArray:
        """Take every number written as text up to byte `end`."""
        return as_floats(self._numbers(end, float, what))

    def ints(self, end: int, what: str) -> IntArray:
        """Take every whole number written as text up to byte `end`."""
        return as_ints(self._numbers(end, int, what))

    def words_on_lines(self, end: int) -> IntArray:
        """Return how many words are on each line that has any, up to byte `end`."""
        counts = []
        start = self.at
        while start < end:
            stop = min(start + PIECE, end)
            if stop < end:  # at the end of a line, of which there is one at the end
                line_end = self.data.find(b"\n", stop, end)
                stop = end if line_end < 0 else line_end + 1
            piece = np.frombuffer(self.data, np.uint8, stop - start, start)
            is_word = piece > ord(" ")
            begins = is_word & np.concatenate([[True], ~is_word[:-1]])
            line_of = np.cumsum(piece == ord("\n"), dtype=np.int32)
            counts.append(np.bincount(line_of[begins]))
            start = stop
        on_lines = np.concatenate([np.zeros(0, dtype=np.int64), *counts])
        return on_lines[on_lines > 0]

    def after_words(self, count: int, what: str) -> int:
        """Return where the next `count` words end."""
        at, left, data = self.at, count, self.data
        while left > 0:
            end = data.find(b"\n", at)
            end = len(data) if end < 0 else end
            words = data[at:end].split()
            if len(words) >= left:
                for _ in range(left):
                    match = re.compile(rb"\s*\S+").match(data, at)
                    at = match.end() if match else at
                return at
            left -= len(words)
            if end == len(data):
                self.fail(f"expected {count} {what}, found {count - left} to the end of the file")
            at = end + 1
        return at

    def expect(self, count: int, found: int, what: str, at: int) -> None:
        """Fail, at the line of byte `at`, unless as many things were found as there should be."""
        if found != count:
            self.fail(f"expected {count} {what}, found {found}", at)

    def _numbers(
        self, end: int, dtype: type[float] | type[int], what: str
    ) -> npt.NDArray[np.generic]:
        text = self.data[self.at : end].strip()
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error", DeprecationWarning)  # NumPy < 2.3 warns, and stops
                values = np.fromstring(text or b"0", dtype, sep=" ")[: len(text)]
        except (ValueError, DeprecationWarning):
            self._fail_at_word(end, dtype, what)
        self.at = end
        return values

    def _fail_at_word(self, end: int, dtype: type[float] | type[int], what: str) -> NoReturn:
        """Fail at the first word before byte `end` that is not a number."""
        for word in re.compile(rb"\S+").finditer(self.data, self.at, end):
            try:
                dtype(word.group())
            except ValueError:
                self.fail(f"expected {what}, found {shown(word.group())}", word.start())
        self.fail(f"expected {what}, found text that is not numbers")


def count_in(reader: ByteReader, text: str, what: str, at: int | None = None) -> int:
    """Return a number of things, which cannot be negative nor exceed the bytes of the file."""
    try:
        count = int(text)
    except ValueError:
        reader.fail(f"expected the number of {what}, found {shown(text)}", at)
    if not 0 <= count <= len(reader.data):
        reader.fail(
            f"expected the number of {what}, found {count}, which a file of "
            f"{len(reader.data)} bytes cannot hold",
            at,
        )
    return count


def shown(text: bytes | str) -> str:
    """Return the beginning of a text in quotes, for messages."""
    if isinstance(text, bytes):
        text = text[: MAX_SHOWN + 1].decode("latin-1")
    return "nothing" if not text else repr(text[:MAX_SHOWN]) + ("..." * (len(text) > MAX_SHOWN))


def as_floats(values: npt.NDArray[np.generic]) -> FloatArray:
    """Return a copy in double precision."""
    with np.errstate(invalid="ignore"):  # a signalling NaN in single precision
        return values.astype(np.float64)


def as_ints(values: npt.NDArray[np.generic]) -> IntArray:
    """Return a copy as 64-bit whole numbers; larger ones become the largest."""
    if values.dtype.kind == "u" and values.dtype.itemsize == 8:
        values = np.minimum(values, np.iinfo(np.int64).max)
    return values.astype(np.int64)
