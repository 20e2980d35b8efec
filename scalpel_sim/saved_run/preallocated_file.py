"""An HDF5 file whose tables are preallocated, in which one atomic write shows a step.

HDF5 keeps no order among what it writes, and a file that is open for writing can be left
unreadable. So h5py only lays the file out, with spare capacity in each table, and closes it. From
then on numbers are written there, and after them the lengths of tables, at the places where HDF5
has them. Last comes one write within a page of memory, which a kill cannot divide: the number of
steps, and the length of the table of their times. Until then a reader sees the steps before.

Room that is not used is a hole in the file, and takes no space on the disk.
"""

import math
import os
import re
import struct
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, BinaryIO, NamedTuple

import numpy as np

from scalpel_sim.errors import RunError

if TYPE_CHECKING:  # loading it takes 0.15 s, and most runs are not recorded
    import h5py

STEPS = "VTKHDF/Steps"
"""Group of the steps, whose attribute `NSteps` is their number, as VTKHDF has it."""

STEP_TIMES = f"{STEPS}/Values"
"""Table of their times. Its length is `NSteps`: VTK takes all of it."""

_PAGE = 4096
"""Length of a page, within which a write is done as a whole [bytes]: the smallest of any system."""

_MARKER = (0x5CA1_BE15_C0FF_EE77).to_bytes(8, "little")
"""Number of steps of a file that is being laid out, by which its place is found."""

_HEAD = 1 << 16
"""Length of the start of a file, in which that is [bytes]."""

_PREFIX = struct.Struct("<BxHII4x")
"""Start of an object header of version 1: version, number of messages, references, length."""

_MESSAGE = struct.Struct("<HHB3x")
"""Start of a message in it: type, length, flags."""

_DATASPACE = struct.Struct("<BBB5x")
"""Start of the message that has the shape of a table: version, dimensions, flags."""

_TYPE_OF_DATASPACE, _HAS_LARGEST = 1, 1
"""Type of that message; flag that the largest shape follows the shape."""

_BYTES_PER_COPY = 1 << 24
"""Length of what is copied at once [bytes]."""

Describe = Callable[["h5py.File"], None]
"""Writes what does not grow into a file that is being laid out."""


class GrowingTable(NamedTuple):
    """A table of the file."""

    name: str
    """Its path in the file."""
    kind: str
    """Type of its numbers, as NumPy writes it: `f4`."""
    width: tuple[int, ...] = ()
    """Shape of a row."""
    capacity: int = 1
    """Rows that it can take."""

    @property
    def row_bytes(self) -> int:
        """Length of a row [bytes]."""
        return int(np.dtype(self.kind).itemsize * math.prod(self.width))


class _Place(NamedTuple):
    """Where a table is in the file."""

    data: int
    """Where its numbers begin [bytes]; 0: it has none."""
    shape: int
    """Where its shape is, followed by the largest one that it may have [bytes]."""


class PreallocatedFile:
    """A file that was laid out, and is open to write rows and their number at their places.

    Args:
        path: The file, which is replaced.
        tables: The tables with their capacities; `STEP_TIMES` is one of them.
        describe: Writes what does not grow.

    Raises:
        RunError: this version of HDF5 lays files out otherwise.
        OSError: the system refuses.
    """

    def __init__(self, path: Path, tables: Iterable[GrowingTable], describe: Describe) -> None:
        import h5py

        self.path = path
        self._tables = {table.name: table for table in tables}
        self._shown = dict.fromkeys(self._tables, -1)
        times = self._tables[STEP_TIMES]
        # The form of before 1.8 has no checksums, and no mark of a file that is open.
        with _said_in_short(), h5py.File(path, "w", libver=("earliest", "v108")) as file:
            file.create_group(STEPS).attrs.create("NSteps", np.frombuffer(_MARKER, "<i8")[0])
            found = {STEP_TIMES: _new_table(file, times)}  # next to the number: in one page with it
            for table in self._tables.values():
                if table is not times:
                    found[table.name] = _new_table(file, table)
            describe(file)
        self._file: BinaryIO = path.open("r+b", buffering=0)
        self._places = {
            name: _Place(data, self._place_of_shape(header))
            for name, (data, header) in found.items()
        }
        self._counter = self._read(0, _HEAD).find(_MARKER)
        shape = self._places[STEP_TIMES].shape
        self._page_begin = min(self._counter, shape)
        end = max(self._counter + 8, shape + 16)
        if self._counter < 0 or self._page_begin // _PAGE != (end - 1) // _PAGE:
            raise _unknown_layout(path)
        self._page = bytearray(self._read(self._page_begin, end - self._page_begin))

    @property
    def starts(self) -> dict[str, int]:
        """Where the numbers of each table begin [bytes]."""
        return {name: place.data for name, place in self._places.items()}

    @property
    def shown(self) -> dict[str, int]:
        """Number of rows of each table that readers see; -1 before the first `show`."""
        return dict(self._shown)

    def has_capacity(self, name: str, n_rows: int) -> bool:
        """Return whether a table can take so many rows."""
        return n_rows <= self._tables[name].capacity

    def write(self, name: str, first: int, content: bytes) -> None:
        """Write rows of a table at their place.

        Args:
            name: The table.
            first: Number of the first row.
            content: Their bytes.
        """
        self._write(self._places[name].data + first * self._tables[name].row_bytes, content)

    def copy(
        self,
        source: Path,
        starts: Mapping[str, int],
        lengths: Mapping[str, int],
        after: Mapping[str, int] = MappingProxyType({}),
    ) -> None:
        """Copy the first rows of all tables from another file.

        Args:
            source: That file.
            starts: Where its tables begin [bytes].
            lengths: Numbers of rows.
            after: Numbers of rows that are here already.
        """
        with source.open("rb", buffering=0) as file:
            for name, table in self._tables.items():
                here = after.get(name, 0) * table.row_bytes
                file.seek(starts[name] + here)
                place, left = self._places[name].data + here, lengths[name] * table.row_bytes - here
                while left > 0:
                    content = file.read(min(left, _BYTES_PER_COPY))
                    if not content:
                        raise OSError(f"{source} is shorter than it was")
                    self._write(place, content)
                    place, left = place + len(content), left - len(content)

    def show(self, lengths: Mapping[str, int]) -> None:
        """Show so many rows of each table to readers, and as many steps as `STEP_TIMES` has rows.

        A step is seen after the rows that it has, and not any more before they go.
        """
        are_fewer = lengths[STEP_TIMES] < self._shown[STEP_TIMES]
        if are_fewer:
            self._show_steps(lengths[STEP_TIMES])
        for name, length in lengths.items():
            if name != STEP_TIMES and length != self._shown[name]:
                table = self._tables[name]
                # HDF5 takes nothing of no length that has a place: an empty table shows a row.
                shape = (max(length, min(table.capacity, 1)), *table.width)
                self._write(
                    self._places[name].shape, struct.pack(f"<{2 * len(shape)}q", *shape, *shape)
                )
        if not are_fewer:
            self._show_steps(lengths[STEP_TIMES])
        self._shown = dict(lengths)

    def move_to(self, path: Path) -> None:
        """Give the file another name; a file of that name is replaced."""
        self._file.close()  # no file that is open can be moved on Windows
        self.path.replace(path)
        self.path = path
        self._file = path.open("r+b", buffering=0)

    def close(self) -> None:
        """Close the file as it is. May be called twice."""
        self._file.close()

    def _show_steps(self, n: int) -> None:
        """Write the number of steps and the length of the table of times, at once."""
        struct.pack_into("<q", self._page, self._counter - self._page_begin, n)
        struct.pack_into("<qq", self._page, self._places[STEP_TIMES].shape - self._page_begin, n, n)
        self._write(self._page_begin, bytes(self._page))

    def _place_of_shape(self, header: int) -> int:
        """Return where the shape of a table is whose object header begins there [bytes]."""
        version, n_messages, _, n_bytes = _PREFIX.unpack(self._read(header, _PREFIX.size))
        place = header + _PREFIX.size
        for _ in range(n_messages if version == 1 else 0):
            kind, length, _ = _MESSAGE.unpack(self._read(place, _MESSAGE.size))
            place += _MESSAGE.size
            if kind == _TYPE_OF_DATASPACE:
                version, _, flags = _DATASPACE.unpack(self._read(place, _DATASPACE.size))
                if version == 1 and flags == _HAS_LARGEST:
                    return place + _DATASPACE.size
            place += length
            if place >= header + _PREFIX.size + n_bytes:
                break
        raise _unknown_layout(self.path)

    def _read(self, where: int, n_bytes: int) -> bytes:
        """Return the bytes at a place."""
        self._file.seek(where)
        return self._file.read(n_bytes)

    def _write(self, where: int, content: bytes) -> None:
        """Write bytes at a place."""
        self._file.seek(where)
        rest = memoryview(content)
        while rest:  # a disk that gets full takes a part
            rest = rest[self._file.write(rest) :]


@contextmanager
def _said_in_short() -> Iterator[None]:
    """Turn an error of HDF5 into that of the system, without addresses."""
    try:
        yield
    except OSError as error:
        found = re.search(r"errno = (\d+)", str(error))
        if found is None:
            raise
        raise OSError(int(found[1]), os.strerror(int(found[1]))) from error


def _new_table(file: "h5py.File", table: GrowingTable) -> tuple[int, int]:
    """Make a table in one piece, as it is; return where its numbers and its header are [bytes]."""
    from h5py import h5d, h5o, h5p, h5s, h5t

    how = h5p.create(h5p.DATASET_CREATE)
    how.set_layout(h5d.CONTIGUOUS)
    how.set_alloc_time(h5d.ALLOC_TIME_EARLY)
    how.set_fill_time(h5d.FILL_TIME_NEVER)  # or holes would take space
    links = h5p.create(h5p.LINK_CREATE)
    links.set_create_intermediate_group(True)
    kind = h5t.py_create(np.dtype(table.kind).newbyteorder("<"))
    space = h5s.create_simple((table.capacity, *table.width))
    made = h5d.create(file.id, table.name.encode(), kind, space, how, links)
    return made.get_offset() or 0, h5o.get_info(made).addr


def _unknown_layout(path: Path) -> RunError:
    """Return the error of a version of HDF5 that lays files out in another way."""
    return RunError(
        f"{path}: this version of HDF5 lays files out otherwise than those that were tested; "
        "install another version of h5py"
    )
