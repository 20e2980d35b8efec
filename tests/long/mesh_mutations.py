"""Mesh files with bytes, words, lines or numbers changed, and files of meshes that are broken."""

import logging
import os
import re
import struct
from collections.abc import Callable
from functools import cache
from itertools import pairwise
from pathlib import Path

import numpy as np

from tests.tissue.io import mesh_writers as write
from tests.tissue.io.test_mesh_io import BLOCK, FILES, UNCOUNTED
from tissue import TetrahedralMesh, read_mesh
from tissue.mesh.mesh_arrays import MeshError
from tissue.mesh.validation import expect_sound

WORDS = (
    *(b"nan", b"inf", b"-inf", b"-1", b"0", b"1", b"2", b"3", b"4", b"5", b"10", b"1e9", b"4e9"),
    *(b"4000000000", b"4294967295", b"9223372036854775807", b"99999999999999999999"),
    *(b"1e308", b"-0.0", b"", b"$", b"x"),
)
"""What a word of a text is replaced by."""

NUMBERS = (
    *(struct.pack(f"{order}{code}", x) for order in "<>" for code in "df" for x in (np.nan, -1.0)),
    *(struct.pack(f"{order}d", x) for order in "<>" for x in (np.inf, 4e9, 1e300)),
    *(struct.pack(f"{order}q", x) for order in "<>" for x in (-1, 4_000_000_000, 2**63 - 1, 0)),
    *(struct.pack(f"{order}i", x) for order in "<>" for x in (-1, 0, 4, 2**31 - 1)),
)
"""What some bytes of binary data are replaced by."""

COORDINATES = (np.nan, np.inf, -np.inf, -1.0, 4e9, 1e300, 0.0, 1e-300)
"""What a coordinate of a mesh is replaced by."""

LARGEST_TAG = 2**31 - 1 - write.FIRST_TAG

LABELLED = BLOCK._replace(
    labels=np.array([0, 1, 5])[np.arange(len(BLOCK.tetrahedra)) % 3],
    label_names={1: "fat", 5: "skin"},
)
"""No label is 2: what is left of such a tetrahedron in Gmsh's text when its type is lost is a whole
triangle with two tags."""

TETGEN = dict(zip(("mesh.node", "mesh.ele"), write.tetgen(LABELLED), strict=True))
"""The files of nodes and of tetrahedra, of which one is damaged."""

WRITERS: dict[str, Callable[[TetrahedralMesh], bytes]] = {
    "1.msh": write.gmsh_1,
    "2.msh": write.gmsh_2,
    "2binary.msh": lambda mesh: write.gmsh_2(mesh, "<"),
    "4.msh": write.gmsh_4,
    "2.vtk": lambda mesh: write.vtk_legacy(mesh, "2.0", False),
    "2binary.vtk": lambda mesh: write.vtk_legacy(mesh, "2.0", True),
    "5binary.vtk": lambda mesh: write.vtk_legacy(mesh, "5.1", True),
    "text.vtu": lambda mesh: write.vtu(mesh, "ascii"),
    "binary.vtu": write.vtu,
    "zlib.vtu": lambda mesh: write.vtu(mesh, "appended", is_compressed=True),
    "text.mesh": write.medit,
    "binary.meshb": lambda mesh: write.medit_binary(mesh, 3, "<"),
    "mesh.inp": write.abaqus,
    "mesh.bdf": lambda mesh: write.nastran(mesh, "free"),
    "large.bdf": lambda mesh: write.nastran(mesh, "large"),
}

RECORD = re.compile(rb"(?m)^(?:CTETRA\*(?:.*)\n\*.*|CTETRA,.*|[0-9]+(?:, [0-9]+){4})$")
"""A tetrahedron in a format that does not say how many there are."""


REFUSED, READ = "refused", "read whole"
"""What comes of a file."""


def read_one(case: int, folder: str) -> str:
    """Read one file that is damaged: it must be refused by name, or give a sound mesh.

    Return which of the two, `REFUSED` or `READ`. Where tetrahedra are left out of it this is said.

    In three cases of four a good file is damaged; in the others a broken mesh is written.
    """
    random = np.random.default_rng(case)
    if random.random() < 0.75:
        return _read(_damaged_file(random, _good_files()), folder)
    return _read(_file_of_a_broken_mesh(random), folder)


def _read(file: tuple[str, bytes, int], folder: str) -> str:
    """Read a damaged file: its name, its bytes, and how many tetrahedra it has."""
    name, data, n_tetrahedra = file
    said = _Said()
    logging.getLogger("tissue").handlers = [said]
    logging.getLogger("tissue").propagate = False
    path = Path(folder) / name
    for other, good in TETGEN.items():
        (Path(folder) / other).write_bytes(good)
    path.write_bytes(data)
    try:
        mesh = read_mesh(path)
    except MeshError as error:
        message = str(error)
        assert message.startswith(f"{path}: "), message
        assert "\n" not in message and message.isprintable(), message
        return REFUSED
    expect_sound(mesh)
    n, is_said = len(mesh.tetrahedra), any("left out" in each for each in said.messages)
    assert n >= n_tetrahedra or is_said, f"{n} of {n_tetrahedra} tetrahedra are left of {name}"
    return READ


FORMATS = {
    "Gmsh": (".msh",),
    "VTK legacy": (".vtk",),
    "VTU": (".vtu",),
    "Medit": (".mesh", ".meshb"),
    "TetGen": (".node", ".ele"),
    "Abaqus": (".inp",),
    "Nastran": (".bdf",),
}
"""Suffixes of the files of each format."""


def read_one_of_a_format(case: int, folder: str) -> str:
    """Damage a good file of one format after another and read it, as `read_one` does."""
    random = np.random.default_rng(case)
    suffixes = FORMATS[format_of(case)]
    files = [each for each in _good_files() if each[0].endswith(suffixes)]
    return _read(_damaged_file(random, files), folder)


def format_of(case: int) -> str:
    """Return the format of a case."""
    return list(FORMATS)[case % len(FORMATS)]


class _Said(logging.Handler):
    """Keeps what is logged."""

    def __init__(self) -> None:
        super().__init__()
        self.messages: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        self.messages.append(record.getMessage())


def _n_left(good: bytes, data: bytes) -> int:
    """Return how many tetrahedra of a file without a count are still there, where they were."""
    start, end = (b"TYPE=C3D4\n", b"*") if b"TYPE=C3D4" in good else (b"BULK\n", b"ENDDATA")
    kept = data.partition(start)[2].partition(end)[0].splitlines()
    lines = {b"\n".join(pair) for pair in pairwise(kept)} | set(kept)
    return sum(each[0] in lines for each in RECORD.finditer(good))


@cache
def _good_files() -> list[tuple[str, bytes, int]]:
    """Return name, bytes and number of tetrahedra of each good file."""
    folder = os.environ.get("SCALPEL_SIM_TEST_MESHES")
    labelled = {f"labelled {name}": writer(LABELLED) for name, writer in WRITERS.items()}
    counted = {n: d for n, d in labelled.items() if not n.endswith((".inp", ".bdf"))}
    content = FILES | UNCOUNTED | TETGEN | counted
    files = [(name, data, len(BLOCK.tetrahedra)) for name, data in content.items()]
    if folder:
        for path in sorted(Path(folder).glob("*.[mv][st][hk]")):
            mesh = read_mesh(path, 0.01)
            files.append((path.name, path.read_bytes(), len(mesh.tetrahedra)))
    return files


def _damaged_file(
    random: np.random.Generator, files: list[tuple[str, bytes, int]]
) -> tuple[str, bytes, int]:
    name, data, n_tetrahedra = files[random.integers(len(files))]
    good = data
    for _ in range(random.integers(1, 5)):
        change = _CHANGES[random.integers(len(_CHANGES))]
        data = change(data, random)
    return name, data, _n_left(good, data) if name in UNCOUNTED else n_tetrahedra


def _at(data: bytes, random: np.random.Generator) -> int:
    return int(random.integers(0, max(len(data), 1)))


def _flip(data: bytes, random: np.random.Generator) -> bytes:
    at = _at(data, random)
    bit = 1 << int(random.integers(8))
    return data[:at] + bytes(each ^ bit for each in data[at : at + 1]) + data[at + 1 :]


def _replace_byte(data: bytes, random: np.random.Generator) -> bytes:
    at = _at(data, random)
    return data[:at] + random.bytes(1) + data[at + 1 :]


def _cut_end(data: bytes, random: np.random.Generator) -> bytes:
    return data[: _at(data, random)]


def _cut_out(data: bytes, random: np.random.Generator) -> bytes:
    at = _at(data, random)
    return data[:at] + data[at + int(random.integers(1, 60)) :]


def _double(data: bytes, random: np.random.Generator) -> bytes:
    at = _at(data, random)
    return data[: at + int(random.integers(1, 60))] + data[at:]


def _replace_word(data: bytes, random: np.random.Generator) -> bytes:
    at = _at(data, random)
    start = 1 + max(data.rfind(blank, 0, at) for blank in (b" ", b"\n", b'"'))
    end = start
    while end < len(data) and data[end : end + 1] not in b' \n"':
        end += 1
    return data[:start] + WORDS[random.integers(len(WORDS))] + data[end:]


def _replace_number(data: bytes, random: np.random.Generator) -> bytes:
    at = _at(data, random)
    number = NUMBERS[random.integers(len(NUMBERS))]
    return data[:at] + number + data[at + len(number) :]


def _swap_lines(data: bytes, random: np.random.Generator) -> bytes:
    lines = data.split(b"\n")
    i, j = random.integers(0, len(lines), 2)
    lines[i], lines[j] = lines[j], lines[i]
    return b"\n".join(lines)


def _repeat_line(data: bytes, random: np.random.Generator) -> bytes:
    """Write one line over another: a cell occurs twice and another is missing."""
    lines = data.split(b"\n")
    i, j = random.integers(0, len(lines), 2)
    lines[i] = lines[j]
    return b"\n".join(lines)


def _swap_numbers(data: bytes, random: np.random.Generator) -> bytes:
    """Exchange two runs of as many bytes as a cell of tetrahedra has."""
    changed, size = bytearray(data), int(random.choice([4, 8, 16, 32]))
    a, b = random.integers(0, max(len(data) - size, 1), 2)
    changed[a : a + size], changed[b : b + size] = data[b : b + size], data[a : a + size]
    return bytes(changed)


_CHANGES = (
    *(_flip, _replace_byte, _cut_end, _cut_out, _double, _replace_word, _replace_word),
    *(_replace_number, _swap_lines, _repeat_line, _swap_numbers),
)


def _file_of_a_broken_mesh(random: np.random.Generator) -> tuple[str, bytes, int]:
    """Return a well-formed file, of the block with some numbers or cells changed."""
    positions, tetrahedra = BLOCK.positions.copy(), BLOCK.tetrahedra.copy()
    for _ in range(random.integers(1, 4)):
        kind, i, j = random.integers(6), *random.integers(0, len(tetrahedra), 2)
        if kind == 0:
            node = random.integers(len(positions))
            positions[node, random.integers(3)] = random.choice(COORDINATES)
        elif kind == 1:
            wrong = (-1, -2, len(positions), LARGEST_TAG, *range(len(positions)))
            tetrahedra[i, random.integers(4)] = random.choice(wrong)
        elif kind == 2:
            tetrahedra[[i, j]] = tetrahedra[[j, i]]
        elif kind == 3:
            tetrahedra[i] = tetrahedra[j, random.permutation(4)]
        elif kind == 4:
            tetrahedra[i] = tetrahedra[i, random.permutation(4)]
        else:
            tetrahedra = np.delete(tetrahedra, i, axis=0)
    name = list(WRITERS)[random.integers(len(WRITERS))]
    mesh = TetrahedralMesh(positions, tetrahedra)
    return name, WRITERS[name](mesh), len(tetrahedra)
