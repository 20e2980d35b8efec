"""Gmsh files (`.msh`): the header, and the choice of the reader of that version."""

from tissue.io.byte_reader import ByteReader, shown
from tissue.io.gmsh_1_and_2 import read_gmsh_1, read_gmsh_2
from tissue.io.gmsh_4 import read_gmsh_4
from tissue.types import TetrahedralMesh


def read_gmsh(data: bytes) -> TetrahedralMesh:
    """Read Gmsh 1.0, 2.0 to 2.2 and 4.1, text and binary; the mesh is not checked.

    Source: the Gmsh reference manual, "Gmsh file formats".

    Raises:
        MeshError: The bytes are not such a file, or it holds no tetrahedra.
    """
    reader = ByteReader(data)
    first = reader.line_with_text()
    if first == "$NOD":
        return read_gmsh_1(reader)
    if first != "$MeshFormat":
        reader.fail(f"expected $MeshFormat or $NOD, found {shown(first)}: not a Gmsh file", 0)

    at = reader.at
    words = reader.line().split()
    if len(words) != 3 or words[1] not in ("0", "1"):
        reader.fail(f"expected version, file type (0 or 1), data size; found {words}", at)
    version, file_type, data_size = words
    if version not in ("2", "2.0", "2.1", "2.2", "4.1"):
        reader.fail(
            f"expected version 2.0 to 2.2 or 4.1, found {shown(version)}: save it as 4.1", at
        )
    if data_size != "8":
        reader.fail(f"expected data size 8, found {shown(data_size)}", at)
    byte_order = _byte_order(reader) if file_type == "1" else ""
    read = read_gmsh_4 if version == "4.1" else read_gmsh_2
    return read(reader, byte_order)


def _byte_order(reader: ByteReader) -> str:
    """Return "<" or ">": binary files hold the number 1 after the header."""
    at = reader.at
    one = bytes(reader.binary(4, "u1", "bytes that hold the number 1"))
    orders = {b"\x01\x00\x00\x00": "<", b"\x00\x00\x00\x01": ">"}
    if one not in orders:
        reader.fail(f"expected the number 1 in four bytes, found {one.hex(' ')}", at)
    return orders[one]
