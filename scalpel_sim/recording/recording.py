"""One row of numbers for each frame, and the terms of the energy account."""

import math
import mmap
import os
import re
import struct
import tempfile
from collections.abc import Iterator, Sequence
from io import FileIO
from itertools import islice
from pathlib import Path
from typing import BinaryIO, NamedTuple

import msgspec
import numpy as np

from scalpel_sim.errors import RunError, unknown
from scalpel_sim.recording.columns import (
    COLUMNS,
    columns_in,
    grasper_quantities,
    label_of_column,
    shared_columns,
    vector_columns,
)
from tissue import FloatArray

ROWS_IN_MEMORY = 8192
"""Rows that are kept in memory before a file is begun: 8 s of frames, some 4 MB."""

ROWS_PER_WRITE = 256
"""Rows that are then written together, in a tenth of a millisecond."""

_ROWS_PER_READ = 4096
"""Rows that are read together: some 2 MB."""


class Term(NamedTuple):
    """A term of the energy account: a field of `tissue.Energies`."""

    name: str
    label: str
    colour: str


# Paul Tol's muted palette, which colour-blind readers can distinguish too.
TERMS = (
    Term("cutting", "cutting: toughness x area", "#cc6677"),
    Term("breaking", "breaking the skin", "#882255"),
    Term("friction", "friction on the blade", "#ddcc77"),
    Term("damping", "damping", "#88ccee"),
    Term("contact", "impacts of the tissue", "#44aa99"),
    Term("topology", "change of the mesh", "#999933"),
    Term("released", "released by the blade, net", "#aa4499"),
    Term("elastic", "stored: elastic", "#117733"),
    Term("held", "stored: at the blade", "#77cc77"),
    Term("kinetic", "stored: motion", "#332288"),
    Term("potential", "stored: height", "#bbbbbb"),
)
"""The terms in the order of the table: first what is dissipated, then what is stored."""


_LINES_PER_READ = 1024
"""Lines of `forces.csv` that are read together: some megabytes of text."""


class Recording:
    """Rows of numbers, one per frame. Some seconds are in memory; see `RowStore`.

    Args:
        columns: Names of the columns; None: those of `COLUMNS`.
    """

    def __init__(self, columns: Sequence[str] | None = None) -> None:
        self.columns = shared_columns() if columns is None else tuple(columns)
        """Names and units of all columns."""
        self.n_held = sum(_is_held(name) for name in self.columns)
        """Number of attachments."""
        self._store = RowStore(len(self.columns))
        self.append = self._store.append
        """Add one frame: a number for each of `columns`."""
        self.room_for_a_row = self._store.room_for_a_row
        """Return where to write the first numbers of a frame, before `end_row`: rows, and which."""
        self.end_row = self._store.end_row
        """Add a frame of which so many numbers have been written, and these are the others."""
        self.cut_back = self._store.cut_back
        """Forget all frames but the first so many, of which there are as many."""
        self.since = self._store.since
        """Return the frames after the first so many. A view, until the next frame."""

    def __len__(self) -> int:
        return len(self._store)

    def keep_in(self, folder: Path) -> None:
        """Put the file of what memory does not hold into a folder, if there is none yet."""
        self._store.folder = folder

    @property
    def rows(self) -> FloatArray:
        """All frames so far, shape (n_frames, n_columns). A view.

        Raises:
            RunError: there are more than memory holds, and the disk is full.
        """
        return self._store.rows()

    def rows_from(self, first: int) -> Iterator[FloatArray]:
        """Yield the frames after so many, one by one: a view, until the next."""
        for part in self._store.parts(first):
            yield from part

    def column(self, name: str) -> FloatArray:
        """Return one column, shape (n_frames,). A view where memory holds all frames.

        Raises:
            ValueError: there is none of that name.
        """
        at = self._place_of_column(name)
        return self._columns(slice(at, at + 1))[:, 0]

    def vector(self, name: str) -> FloatArray:
        """Return the three columns of a vector such as `tip`, shape (n_frames, 3), likewise."""
        return self._columns(self._place_of(name))

    def sizes(self, name: str) -> FloatArray:
        """Return the magnitude of a vector such as `force` in each frame, shape (n_frames,)."""
        place = self._place_of(name)
        sizes = [np.linalg.norm(part[:, place], axis=1) for part in self._store.parts()]
        return np.concatenate([np.zeros(0), *sizes])

    def at_end(self, name: str) -> float:
        """Return a number of the last frame; 0 where there is none."""
        last = self.since(max(0, len(self) - 1))
        return float(last[-1, self._place_of_column(name)]) if len(last) else 0.0

    def _place_of_column(self, name: str) -> int:
        if name not in self.columns:
            raise unknown("column", name, self.columns)
        return self.columns.index(name)

    def _place_of(self, name: str) -> slice:
        """Return which columns a vector has."""
        names = (each for each in self.columns if each.startswith(f"{name}_x_"))
        first = self._place_of_column(next(names, f"{name}_x"))
        return slice(first, first + 3)

    def _columns(self, place: slice) -> FloatArray:
        """Return some columns."""
        if self._store.are_in_memory:
            return self.rows[:, place]
        found = np.empty((len(self), place.stop - place.start))
        done = 0
        for part in self._store.parts():
            found[done : done + len(part)] = part[:, place]
            done += len(part)
        return found

    @property
    def hands(self) -> tuple[str, ...]:
        """Names of the graspers."""
        there = set(self.columns)
        return tuple(
            name
            for name in (each.removesuffix("_opening_m") for each in self.columns)
            if there.issuperset(columns_in(grasper_quantities(name)))
        )

    def of_label(self, label: int) -> tuple[float, float] | None:
        """Return the work of cutting in a label [J], and its largest force on the edge [N].

        None: the recording has no columns of labels.
        """
        own = [name for name in self.columns if label_of_column(name) == label]
        if not own:
            return None
        work, force = own
        return self.at_end(work), float(self.column(force).max(initial=0.0))

    @property
    def is_audited(self) -> bool:
        """Whether the energy account was kept."""
        return len(self) > 0 and bool(np.isfinite(self.at_end("residual_j")))


def read_forces(path: Path, n_bytes: int | None = None) -> Recording:
    """Return the recording that a run wrote as `forces.csv`.

    A last row without an end of line is left out: a run that was killed did not finish it.

    Args:
        path: The file.
        n_bytes: How much of it is read [bytes]; None: all.

    Raises:
        ValueError: the file is no such table.
        OSError: the file cannot be read.
    """
    with path.open("rb") as file:
        text = _text_lines(file, n_bytes)
        header = next(text, "").strip()
        columns = header.split(",")
        if not _are_of_a_run(columns):
            raise ValueError(
                f"{path}: the first line is '{header[:200]}'; it must be the columns of a run"
            )
        recording = Recording(columns)
        while lines := list(islice(text, _LINES_PER_READ)):
            if whole := [line for line in lines if line.endswith("\n")]:
                rows = np.loadtxt(whole, delimiter=",", ndmin=2)
                if rows.shape[1] != len(columns):
                    raise ValueError(f"{path}: the rows have not as many numbers as columns")
                for row in rows:
                    recording.append(row)
    return recording


def _are_of_a_run(columns: Sequence[str]) -> bool:
    """Return whether these are names of columns, from the time on, with whole vectors.

    Some may be missing, since the file is older than they are, and others may be unknown here.
    """
    there = set(columns)
    quantities = (names for group in COLUMNS.values() for names in group.quantities.values())
    others = [name for name in columns if label_of_column(name) is None]
    vectors = (name.split("_x_") for name in others if "_x_" in name)
    wholes = [*quantities, *(vector_columns(*parts) for parts in vectors)]
    is_whole = all(there.issuperset(names) or there.isdisjoint(names) for names in wholes)
    return columns[0] == "time_s" and len(there) == len(columns) and is_whole


def _is_held(column: str) -> bool:
    """Return whether a column is the first one of an attachment."""
    return re.fullmatch(r"held_\d+_x_n", column) is not None


def _text_lines(file: BinaryIO, n_bytes: int | None) -> Iterator[str]:
    """Yield the lines of the first bytes of a file."""
    rest = math.inf if n_bytes is None else n_bytes
    while rest > 0 and (line := file.readline()):
        rest -= len(line)
        yield line.decode("ascii")


def lines_of_rows(rows: FloatArray) -> bytes:
    """Return rows as lines of text with the fewest digits that give the same bits again.

    JSON's numbers are those digits, and its encoder takes a fifth of the time of `repr`; it has no
    word for what is not finite.
    """
    if np.isinf(rows).any():
        return "".join(",".join(map(repr, row)) + "\n" for row in rows.tolist()).encode("ascii")
    lines = msgspec.json.encode(rows.tolist())[2:-2].replace(b"],[", b"\n")
    return lines.replace(b"null", b"nan") + b"\n"


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
        self._shape = (-1, n_columns)
        self._row_bytes = 8 * n_columns
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
        self.room_for_a_row()
        self.end_row(0, row)

    def room_for_a_row(self) -> tuple[FloatArray, int]:
        """Return the rows in memory, and the number of the next one among them.

        Raises:
            RunError: see `append`.
        """
        at = self._n - self._first
        if at == len(self._room):
            self._write()
            if at > ROWS_PER_WRITE:
                self._take_room(ROWS_PER_WRITE)
            self._first, at = self._n, 0
        return self._room, at

    def end_row(self, n_written: int, others: Sequence[float]) -> None:
        """Add the row that begins with numbers that are written, and goes on with others.

        Args:
            n_written: How many were written into the room for it.
            others: All that follow.
        """
        at, n = self._n - self._first, self._shape[1]
        # NumPy takes three times as long for fifty numbers of a list.
        struct.pack_into(f"{n - n_written}d", self._memory, 8 * (at * n + n_written), *others)
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
        mapped = mmap.mmap(self._file.fileno(), self._n * self._row_bytes, access=mmap.ACCESS_READ)
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
            self._file.seek(begin * self._row_bytes)
            if self._file.readinto(found.data.cast("B")) != found.nbytes:
                raise RunError("the temporary file of the recording cannot be read")
            yield found

    def _write(self) -> None:
        """Write the rows that are in memory."""
        left = self._memory[: (self._n - self._first) * self._row_bytes]
        try:
            if self._file is None:
                self._file = unnamed_file(self.folder)
            self._file.seek(self._first * self._row_bytes)
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
