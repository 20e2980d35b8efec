"""Files that are made to mislead a reader: each is refused before it costs memory or an element."""

import lzma
import re
import subprocess
import sys
import zlib

import numpy as np
import pytest

from tests.tissue.io import mesh_writers as write
from tests.tissue.io.test_mesh_io import BLOCK, FILES, refusal_of
from tissue import block, read_mesh
from tissue.io import byte_reader
from tissue.io.vtu import MAX_RATIO

N_ZEROS = 30_000_000
"""Numbers that a file of some hundred kilobytes says it holds: 240 MB."""

MEMORY_OF_A_REFUSAL = 50 << 20
"""Memory that a process may take to refuse a file of under a megabyte [byte]."""


def compressed(data, compress, size=1 << 24):
    """Return an array as VTK compresses it, in blocks of that size."""
    blocks = [compress(data[i : i + size]) for i in range(0, len(data), size)]
    numbers = [len(blocks), size, len(data) % size, *map(len, blocks)]
    return np.array(numbers, "<u8").tobytes() + b"".join(blocks)


def bomb(compress, compressor):
    """Return a small file that says it has very many nodes, all at the origin, and has them."""
    data = compressed(bytes(8 * N_ZEROS), compress)
    return (
        b'<VTKFile type="UnstructuredGrid" header_type="UInt64" compressor="%b">'
        b'<UnstructuredGrid><Piece NumberOfPoints="%d" NumberOfCells="1"><Points><DataArray '
        b'type="Float64" format="appended" offset="0"/></Points></Piece></UnstructuredGrid>'
        b'<AppendedData encoding="raw">_%b</AppendedData></VTKFile>'
    ) % (compressor.encode(), N_ZEROS // 3, data)


@pytest.mark.parametrize(
    ("compress", "compressor"),
    [(zlib.compress, "vtkZLibDataCompressor"), (lzma.compress, "vtkLZMADataCompressor")],
)
def test_a_file_that_unpacks_to_a_thousand_times_its_size_is_refused_unpacked(
    compress, compressor, tmp_path
):
    data = bomb(compress, compressor)
    assert len(data) < 1 << 20
    message = refusal_of(tmp_path, "bomb.vtu", data)
    assert (
        f"expected a NumberOfPoints that a file of this size can hold, found '{N_ZEROS // 3}'"
        in (message)
    )
    program = (
        "import resource, sys; from tissue import read_mesh\n"
        "before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss\n"
        "try: read_mesh(sys.argv[1])\n"
        "except ValueError: pass\n"
        "print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before)"
    )
    command = [sys.executable, "-c", program, str(tmp_path / "bomb.vtu")]
    found = subprocess.run(command, capture_output=True, text=True, check=True)
    unit = 1 if sys.platform == "darwin" else 1024
    assert int(found.stdout) * unit < MEMORY_OF_A_REFUSAL


def test_numbers_that_only_together_are_too_many_are_refused(tmp_path):
    original = write.vtu(BLOCK, "appended", is_compressed=True)
    n = MAX_RATIO * len(original) // 8 // 4
    data = re.sub(b'NumberOfCells="[0-9]+"', b'NumberOfCells="%d"' % n, original)
    data = re.sub(b'NumberOfPoints="[0-9]+"', b'NumberOfPoints="%d"' % n, data)
    assert "bytes of numbers, found" in refusal_of(tmp_path, "one.vtu", data)
    data = data.replace(b'NumberOfPoints="%d"' % n, b'NumberOfPoints="%d"' % (4 * n))
    assert "expected at most" in refusal_of(tmp_path, "together.vtu", data)


@pytest.mark.parametrize("compress", [zlib.compress, lzma.compress])
def test_the_mesh_that_compresses_best_is_read(compress, tmp_path):
    """A grid, in large blocks and by the strongest compression that VTK has."""
    mesh = block((12, 12, 12), (0.1, 0.1, 0.1))
    data = write.vtu(mesh, "appended", is_compressed=True, compress=compress, block_size=1 << 20)
    (tmp_path / "grid.vtu").write_bytes(data)
    assert np.array_equal(read_mesh(tmp_path / "grid.vtu").tetrahedra, mesh.tetrahedra)


def test_a_block_whose_bytes_are_altered_is_refused_by_its_checksum(tmp_path):
    data = write.vtu(BLOCK, "appended", is_compressed=True, compress=lambda b: zlib.compress(b, 0))
    at = data.index(b"_", data.index(b"<AppendedData")) + 100  # among the coordinates
    altered = data[:at] + bytes([data[at] ^ 1]) + data[at + 1 :]
    assert "expected compressed data, found an error in it" in refusal_of(
        tmp_path, "altered.vtu", altered
    )


def test_a_block_without_its_checksum_is_refused(tmp_path):
    data = write.vtu(BLOCK, is_compressed=True, compress=lambda b: zlib.compress(b)[:-4])
    assert "found one without its end" in refusal_of(tmp_path, "cut.vtu", data)


def test_entities_are_refused_in_any_encoding(tmp_path):
    xml = '<?xml version="1.0" encoding="UTF-16"?><!DOCTYPE a [<!ENTITY b "bb">]><a>&b;</a>'
    message = refusal_of(tmp_path, "bomb.vtu", xml.encode("utf-16"))
    assert "found what is not XML" in message
    ebcdic = b'<?xml version="1.0" encoding="cp037"?>' + xml[39:].encode("cp037")
    assert "found what is not XML" in refusal_of(tmp_path, "bomb.vtu", ebcdic)


# ------------------------------------------------------------------ cells of a wrong type


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        (b"24", "cell 3 is one of the tetrahedra with 10 nodes and has 4 nodes, not 10"),
        (b"14", "cell 3 is one of the pyramids and has 4 nodes, not 5"),
        (b"5", "cell 3 is one of the triangles and has 4 nodes, not 3"),
        (b"9", "cell 3, one of the quadrangles, has 4 nodes: besides tetrahedra there may be"),
        (b"8", "cell 3, one of the pixels, has 4 nodes"),
        (b"7", "cell 3, one of the polygons, has 4 nodes"),
        (b"4", "cell 3, one of the polylines, has 4 nodes"),
        (b"0", "cell 3, one of the empty cells, has 4 nodes"),
        (b"99", "1 cells of type 99"),
    ],
)
@pytest.mark.parametrize("name", ["vtk 2.0 text.vtk", "vtk 5.1 text.vtk", "text.vtu"])
def test_a_tetrahedron_under_another_type_is_refused_and_not_lost(name, wrong, message, tmp_path):
    types = b"1 3 5 10"
    assert FILES[name].count(types) == 1
    data = FILES[name].replace(types, b"1 3 5 " + wrong)
    assert message in refusal_of(tmp_path, name, data)


def test_offsets_that_end_before_the_nodes_do_are_refused(tmp_path):
    n = int(
        re.search(rb"CONNECTIVITY vtktypeint64\n(.*)\n", FILES["vtk 5.1 text.vtk"])[0].count(b" ")
    )
    offsets = re.search(rb"OFFSETS vtktypeint64\n(.*)\n", FILES["vtk 5.1 text.vtk"])[1]
    fewer = b" ".join(str(max(0, int(each) - 1)).encode() for each in offsets.split())
    data = FILES["vtk 5.1 text.vtk"].replace(offsets, fewer)
    assert f"expected offsets from 0 to {n}, found 0 to {n - 1}" in refusal_of(
        tmp_path, "a.vtk", data
    )


@pytest.mark.parametrize(
    ("kind", "message"),
    [
        (b"2", "(triangles): expected 8 numbers on its line, found 9"),
        (b"3", "cell 5, one of the quadrangles, has 4 nodes"),
        (b"26", "cell 5, one of the lines with 4 nodes, has 4 nodes"),
        (b"11", "(tetrahedra with 10 nodes): expected 15 numbers on its line, found 9"),
        (b"77", "expected a type of element that Gmsh knows, found 77"),
    ],
)
def test_a_gmsh_tetrahedron_under_another_type_is_refused_and_not_lost(kind, message, tmp_path):
    data = FILES["gmsh 2.2 .msh"].replace(b"\n5 4 2 0 1 ", b"\n5 %b 2 0 1 " % kind)
    assert message in refusal_of(tmp_path, "a.msh", data)


def test_two_gmsh_elements_that_are_read_as_two_others_are_refused(tmp_path):
    """The first of two tetrahedra named as triangles shifts all numbers after it by one."""
    lines = FILES["gmsh 2.2 .msh"].split(b"\n")
    start = lines.index(b"$Elements")
    tetrahedra = [
        b"%d %b" % (k, line.split(b" ", 1)[1]) for k, line in enumerate(lines[start + 5 : -2], 1)
    ]
    first = tetrahedra[0].replace(b"1 4 2", b"1 2 2", 1)
    lines[start + 1 : -2] = [b"%d" % len(tetrahedra), first, *tetrahedra[1:]]
    message = refusal_of(tmp_path, "a.msh", b"\n".join(lines))
    assert "element 1 of 24 (triangles): expected 8 numbers on its line, found 9" in message


def test_a_triangle_in_the_place_of_a_tetrahedron_is_refused(tmp_path):
    lines = FILES["gmsh 2.2 .msh"].split(b"\n")
    at = lines.index(b"$Elements") + 2
    assert lines[at + 2].startswith(b"3 2 ") and lines[at + 3].startswith(b"4 4 ")
    lines[at + 3] = lines[at + 2]
    message = refusal_of(tmp_path, "a.msh", b"\n".join(lines))
    assert "element 3, one of the triangles, occurs twice" in message


def test_a_block_of_elements_of_another_dimension_is_refused(tmp_path):
    data = FILES["gmsh 4.1 .msh"].replace(b"\n3 1 4\n", b"\n3 1 3\n")
    assert "expected quadrangles in a block of dimension 2, found one of dimension 3" in refusal_of(
        tmp_path, "a.msh", data
    )


def test_lines_are_counted_over_the_borders_of_pieces(monkeypatch):
    data = b"1 2\n\n 3 4 5 \n6\n7 8"
    for size in range(1, len(data) + 1):
        monkeypatch.setattr(byte_reader, "PIECE", size)
        assert byte_reader.ByteReader(data).words_on_lines(len(data)).tolist() == [2, 3, 1, 2]
