"""VTK legacy files (`.vtk`) with an unstructured grid, text and binary, up to version 5.1.

Labels are cell data, by the names in `label_arrays`.
"""

import re
from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

from tissue.core.array_types import FloatArray, IntArray
from tissue.io.byte_reader import ByteReader, as_floats, as_ints, count_in, shown
from tissue.io.cell_types import uniform_records
from tissue.io.mesh_file import MeshFile, mesh_file
from tissue.io.vtk_cells import cell_blocks, labels_among

_DTYPES = {
    "char": ">i1",
    "signed_char": ">i1",
    "unsigned_char": ">u1",
    "short": ">i2",
    "unsigned_short": ">u2",
    "int": ">i4",
    "unsigned_int": ">u4",
    "long": ">i8",
    "unsigned_long": ">u8",
    "vtkidtype": ">i8",
    "vtktypeint64": ">i8",
    "vtktypeint32": ">i4",
    "vtktypeuint64": ">u8",
    "vtktypeuint32": ">u4",
    "float": ">f4",
    "double": ">f8",
}
"""VTK's names of types; binary files are big-endian on every computer."""

_COMPONENTS = {"VECTORS": 3, "NORMALS": 3, "TENSORS": 9, "TENSORS6": 6}
"""Numbers that each cell or node has of arrays that do not say so."""

_NEXT_KEYWORD = re.compile(
    rb"(?i)\b(?:POINTS|CELLS|CELL_TYPES|OFFSETS|CONNECTIVITY|METADATA|FIELD|CELL_DATA|POINT_DATA)\b"
    rb"|\Z"
)


def read_vtk(data: bytes) -> MeshFile:
    """Read a VTK legacy file; the mesh is not checked.

    Source: "VTK file formats" in the VTK documentation.

    Raises:
        MeshError: The bytes are not such a file, or it holds no tetrahedra.
    """
    return _Reader(data).file()


class _Reader:
    """One file, and what has been found in it."""

    def __init__(self, data: bytes) -> None:
        self._reader = ByteReader(data)
        self._is_binary = False
        self._positions: FloatArray | None = None
        self._cells: tuple[IntArray, IntArray, IntArray] | None = None
        self._types: IntArray | None = None
        self._remarks: list[str] = []

    def file(self) -> MeshFile:
        """Read the header, then one part after another, until nodes and cells are there."""
        self._header()
        parts = {
            "POINTS": self._points,
            "CELLS": self._read_cells,
            "CELL_TYPES": self._cell_types,
            "FIELD": self._skip_field,
            "METADATA": self._skip_metadata,
        }
        reader = self._reader
        while self._positions is None or self._cells is None or self._types is None:
            reader.skip_blanks()
            at = reader.at
            words = reader.line().split()
            keyword = words[0].upper() if words else ""
            if keyword not in parts:
                missing = "POINTS, CELLS and CELL_TYPES"
                reader.fail(f"expected {missing}, found {shown(' '.join(words))}", at)
            parts[keyword](words, at)
        starts, sizes, flat = self._cells
        if len(self._types) != len(starts):
            reader.fail(f"expected {len(starts)} types of cells, found {len(self._types)}")
        arrays = self._cell_arrays(len(starts))
        labels, said = labels_among(self._types, list(arrays), arrays.__getitem__)
        blocks = cell_blocks(self._types, starts, sizes, flat, labels)
        form = "binary" if self._is_binary else "text"
        return mesh_file(
            f"VTK legacy, {form}", self._positions, blocks, remarks=(*self._remarks, *said)
        )

    def _cell_arrays(self, n_cells: int) -> dict[str, npt.NDArray[np.generic]]:
        """Read what follows the grid; return the cell data of one number for each cell."""
        reader, of_cells, count = self._reader, False, 0
        arrays: dict[str, npt.NDArray[np.generic]] = {}
        while True:
            reader.skip_blanks()
            at = reader.at
            words = reader.line().split()
            keyword = words[0].upper() if words else ""
            if not keyword:
                return arrays
            if keyword in ("CELL_DATA", "POINT_DATA"):
                of_cells, count = keyword == "CELL_DATA", self._count(words, 1, "values", at)
                if of_cells and count != n_cells:
                    reader.fail(f"expected data of {n_cells} cells, found {count}", at)
            elif keyword == "METADATA":
                self._skip_metadata(words, at)
            elif keyword == "FIELD":
                for name, values in self._field(words, at):
                    if of_cells and values.shape == (n_cells,):
                        arrays[name] = values
            elif keyword in ("SCALARS", *_COMPONENTS):
                name, values = self._attribute(words, count, at)
                if of_cells and values.shape == (n_cells,):
                    arrays[name] = values
            elif of_cells or not self._skips_point_data():
                self._remarks.append(f"data from {shown(words[0])} on are left out")
                return arrays

    def _skips_point_data(self) -> bool:
        """Go on to the cell data, and return whether there are some."""
        match = re.compile(rb"(?m)^[ \t]*CELL_DATA\b").search(self._reader.data, self._reader.at)
        if match:
            self._reader.at = match.start()
        return match is not None

    def _attribute(
        self, words: list[str], count: int, at: int
    ) -> tuple[str, npt.NDArray[np.generic]]:
        """Return name and numbers of scalars, vectors or tensors."""
        if len(words) < 3:
            self._reader.fail(f"expected name and type, found {shown(' '.join(words))}", at)
        n = _COMPONENTS.get(words[0].upper(), 1)
        if n == 1:
            n = self._count(words, 3, "components", at) if len(words) > 3 else 1
            table_at = self._reader.at
            if not self._reader.line().upper().startswith("LOOKUP_TABLE"):
                self._reader.at = table_at
        return words[1], self._values(count, n, words[2], at)

    def _field(self, words: list[str], at: int) -> Iterator[tuple[str, npt.NDArray[np.generic]]]:
        """Yield names and numbers of the arrays of a field."""
        for _ in range(self._count(words, 2, "arrays", at)):
            reader = self._reader
            reader.skip_blanks()
            array_at = reader.at
            array = reader.line().split()
            if array[:1] == ["METADATA"]:
                self._skip_metadata(array, array_at)
                reader.skip_blanks()
                array_at, array = reader.at, reader.line().split()
            n = self._count(array, 1, "components", array_at)
            count = self._count(array, 2, "values", array_at)
            yield array[0], self._values(count, n, " ".join(array[3:4]), array_at)

    def _values(self, count: int, n: int, dtype: str, at: int) -> npt.NDArray[np.generic]:
        """Return the numbers of an array: shape (count,), or (count, n) where n is not 1.

        Of text there is one line for each; it is skipped.
        """
        reader = self._reader
        if dtype.lower() == "string":
            for _ in range(count * n):
                reader.line()
            return np.zeros(0)
        code = self._dtype([dtype], 0, at)
        shape = (count,) if n == 1 else (count, n)
        if self._is_binary:
            return reader.binary(count * n, code, "values").reshape(shape)
        end = reader.after_words(count * n, "values")
        is_whole = code[1] in "iu"
        numbers = reader.ints(end, "whole numbers") if is_whole else reader.floats(end, "numbers")
        return numbers.reshape(shape)

    def _header(self) -> None:
        reader = self._reader
        first = reader.line()
        if not first.lower().startswith("# vtk datafile version"):
            reader.fail(f"expected '# vtk DataFile Version', found {shown(first)}", 0)
        reader.line()  # a title
        at = reader.at
        encoding = reader.line_with_text().upper()
        if encoding not in ("ASCII", "BINARY"):
            reader.fail(f"expected ASCII or BINARY, found {shown(encoding)}", at)
        self._is_binary = encoding == "BINARY"
        at = reader.at
        dataset = reader.line_with_text().upper().split()
        if dataset == ["DATASET", "POLYDATA"]:
            reader.fail(
                "only a surface, no tetrahedra: found DATASET POLYDATA, expected DATASET "
                "UNSTRUCTURED_GRID. Save it as STL, and fill it by `scalpel-sim mesh`",
                at,
            )
        if dataset != ["DATASET", "UNSTRUCTURED_GRID"]:
            found = shown(" ".join(dataset))
            reader.fail(f"expected DATASET UNSTRUCTURED_GRID, found {found}", at)

    def _points(self, words: list[str], at: int) -> None:
        n_nodes, dtype = self._count(words, 1, "points", at), self._dtype(words, 2, at)
        self._positions = self._floats(3 * n_nodes, dtype, "coordinates").reshape(n_nodes, 3)

    def _read_cells(self, words: list[str], at: int) -> None:
        """Read cells in the newer layout, where OFFSETS follows, or in the older one."""
        n_first, n_second = self._count(words, 1, "cells", at), self._count(words, 2, "entries", at)
        reader = self._reader
        reader.skip_blanks()
        if reader.data[reader.at : reader.at + 7].upper() != b"OFFSETS":
            flat = self._ints(n_second, ">i4", "entries of cells")
            self._cells = (*self._walk(flat, n_first, at), flat)
            return
        offsets = self._named_array("OFFSETS", n_first)
        flat = self._named_array("CONNECTIVITY", n_second)
        if n_first and (offsets[0] != 0 or offsets[-1] != n_second):
            reader.fail(
                f"expected offsets from 0 to {n_second}, found {offsets[0]} to {offsets[-1]}", at
            )
        self._cells = offsets[:-1], np.diff(offsets), flat

    def _walk(self, flat: IntArray, n_cells: int, at: int) -> tuple[IntArray, IntArray]:
        """Return where each cell's nodes begin and how many there are; each follows its size."""
        starts, sizes = [np.zeros(0, dtype=np.int64)], [np.zeros(0, dtype=np.int64)]
        start, n_read = 0, 0
        while n_read < n_cells:
            size = int(flat[start]) if start < len(flat) else 0
            records = uniform_records(flat, start, 1 + max(size, 0), [0], n_cells - n_read)
            if size < 0 or not len(records):
                self._reader.fail(f"expected {n_cells} cells, found {n_read} and no more", at)
            starts.append(start + 1 + (1 + size) * np.arange(len(records)))
            sizes.append(records[:, 0])
            start, n_read = start + records.size, n_read + len(records)
        if start != len(flat):
            self._reader.fail(f"expected {len(flat)} entries in {n_cells} cells, found {start}", at)
        return np.concatenate(starts), np.concatenate(sizes)

    def _named_array(self, name: str, count: int) -> IntArray:
        self._reader.skip_blanks()
        at = self._reader.at
        words = self._reader.line().split()
        if not words or words[0].upper() != name:
            self._reader.fail(f"expected {name}, found {shown(' '.join(words))}", at)
        return self._ints(count, self._dtype(words, 1, at), name.lower())

    def _cell_types(self, words: list[str], at: int) -> None:
        count = self._count(words, 1, "types of cells", at)
        self._types = self._ints(count, ">i4", "types of cells")

    def _skip_field(self, words: list[str], at: int) -> None:
        """Skip arrays that belong to the whole file, such as a time."""
        if not self._is_binary:
            self._reader.at = self._next_keyword()
            return
        for _ in range(self._count(words, 2, "arrays", at)):
            array_at = self._reader.at
            array = self._reader.line_with_text().split()
            n_components = self._count(array, 1, "components", array_at)
            count = n_components * self._count(array, 2, "values", array_at)
            self._reader.binary(count, self._dtype(array, 3, array_at), "values")

    def _skip_metadata(self, words: list[str], at: int) -> None:
        """Skip names and units of components, which end at a blank line."""
        del words, at
        while self._reader.at < len(self._reader.data) and self._reader.line():
            pass

    def _floats(self, count: int, dtype: str, what: str) -> FloatArray:
        if self._is_binary:
            return as_floats(self._reader.binary(count, dtype, what))
        at = self._reader.at
        numbers = self._reader.floats(self._next_keyword(), what)
        self._reader.expect(count, len(numbers), what, at)
        return numbers

    def _ints(self, count: int, dtype: str, what: str) -> IntArray:
        if self._is_binary:
            return as_ints(self._reader.binary(count, dtype, what))
        at = self._reader.at
        numbers = self._reader.ints(self._next_keyword(), what)
        self._reader.expect(count, len(numbers), what, at)
        return numbers

    def _next_keyword(self) -> int:
        match = _NEXT_KEYWORD.search(self._reader.data, self._reader.at)
        return match.start() if match else len(self._reader.data)

    def _count(self, words: list[str], k: int, what: str, at: int) -> int:
        return count_in(self._reader, words[k] if k < len(words) else "", what, at)

    def _dtype(self, words: list[str], k: int, at: int) -> str:
        name = words[k].lower() if k < len(words) else ""
        if name not in _DTYPES:
            self._reader.fail(f"expected a type of numbers, found {shown(name)}", at)
        return _DTYPES[name]
