"""Small writers of the formats that `read_mesh` reads, written from their specifications.

Each file also has a point, a line and a triangle, as in the output of meshers.
"""

import base64
import lzma
import struct
import zlib
from collections.abc import Callable

import numpy as np

from tissue import TetrahedralMesh

FIRST_TAG = 7
"""Tag of the first node in Gmsh files; tags need not begin at 1."""


def gmsh_1(mesh: TetrahedralMesh) -> bytes:
    """Return a mesh in the Gmsh 1.0 format."""
    nodes = [
        f"{i + FIRST_TAG} {x!r} {y!r} {z!r}" for i, (x, y, z) in enumerate(mesh.positions.tolist())
    ]
    cells = _cells(mesh)
    elements = [
        f"{k} {kind} {label} 2 {len(c)} {_spaced(c)}"
        for k, ((kind, c), label) in enumerate(zip(cells, _labels(mesh), strict=True), start=1)
    ]
    lines = ["$NOD", str(len(nodes)), *nodes, "$ENDNOD", "$ELM", str(len(cells)), *elements]
    return "\n".join([*lines, "$ENDELM", ""]).encode()


def gmsh_2(mesh: TetrahedralMesh, order: str = "") -> bytes:
    """Return a mesh in the Gmsh 2.2 format: as text, or binary in byte order "<" or ">"."""
    cells = _cells(mesh)
    if not order:
        nodes = "".join(
            f"{i + FIRST_TAG} {x!r} {y!r} {z!r}\n"
            for i, (x, y, z) in enumerate(mesh.positions.tolist())
        ).encode()
        elements = "".join(
            f"{k} {kind} 2 {label} 1 {_spaced(c)}\n"
            for k, ((kind, c), label) in enumerate(zip(cells, _labels(mesh), strict=True), start=1)
        ).encode()
    else:
        nodes = b"".join(
            struct.pack(order + "i3d", i + FIRST_TAG, *p) for i, p in enumerate(mesh.positions)
        )
        elements = b"".join(
            struct.pack(f"{order}3i{3 + len(c)}i", kind, 1, 2, k, label, 1, *c)
            for k, ((kind, c), label) in enumerate(zip(cells, _labels(mesh), strict=True), start=1)
        )
        nodes, elements = nodes + b"\n", elements + b"\n"
    return (
        _gmsh_header("2.2", order)
        + _gmsh_names(mesh)
        + b"$Nodes\n%d\n%b$EndNodes\n" % (len(mesh.positions), nodes)
        + b"$Elements\n%d\n%b$EndElements\n" % (len(cells), elements)
    )


def gmsh_4(mesh: TetrahedralMesh, order: str = "") -> bytes:
    """Return a mesh in the Gmsh 4.1 format, its nodes in two blocks.

    It is text, or binary in byte order "<" or ">".
    """
    n, cells = len(mesh.positions), _cells(mesh)
    nodes = [("Q", [2, n, FIRST_TAG, n + FIRST_TAG - 1])]
    for dimension, block in ((2, range(3)), (3, range(3, n))):
        is_parametric = int(dimension == 2)
        nodes += [("i", [dimension, 1, is_parametric]), ("Q", [len(block)])]
        nodes += [("Q", [i + FIRST_TAG]) for i in block]
        nodes += [("d", [*mesh.positions[i], *([0.5, 0.25] * is_parametric)]) for i in block]
    groups = sorted(set(_labels(mesh)[3:]))
    entities = [("Q", [0, 0, 0, len(groups)])]
    for label in groups:
        entities += [("i", [label + 1]), ("d", [0.0, 0.0, 0.0, 1.0, 1.0, 1.0])]
        entities += [("Q", [int(label > 0)]), ("i", [label] * (label > 0)), ("Q", [0])]
    elements = [("Q", [3 + len(groups), len(cells), 1, len(cells)])]
    tag = 1
    parts = [(0, 15, 0), (1, 1, 0), (2, 2, 0), *((3, 4, label) for label in groups)]
    for dimension, kind, label in parts:
        labelled = zip(cells, _labels(mesh), strict=True)
        block = [c for (k, c), its in labelled if k == kind and (dimension < 3 or its == label)]
        elements += [("i", [dimension, label + 1, kind]), ("Q", [len(block)])]
        for c in block:
            elements.append(("Q", [tag, *c]))
            tag += 1
    return (
        _gmsh_header("4.1", order)
        + _gmsh_names(mesh)
        + b"$Entities\n%b\n$EndEntities\n" % _numbers(entities, order)
        + b"$Nodes\n%b\n$EndNodes\n" % _numbers(nodes, order)
        + b"$Elements\n%b\n$EndElements\n" % _numbers(elements, order)
    )


def vtk_legacy(
    mesh: TetrahedralMesh, version: str, is_binary: bool, dtype: str = "double"
) -> bytes:
    """Return a mesh in the VTK legacy format.

    Cells are sizes and nodes in version 2.0, offsets and connectivity in version 5.1.
    """
    cells = [(_VTK_KINDS[kind], [i - FIRST_TAG for i in c]) for kind, c in _cells(mesh)]

    def array(values: object, code: str) -> bytes:
        values = np.ravel(values)
        text = " ".join(repr(v) for v in values.tolist()).encode()
        return (values.astype(">" + code).tobytes() if is_binary else text) + b"\n"

    kind = b"BINARY" if is_binary else b"ASCII"
    head = b"# vtk DataFile Version %b\na title\n%b\nDATASET UNSTRUCTURED_GRID\n"
    parts = [head % (version.encode(), kind)]
    parts.append(b"FIELD FieldData 1\nTIME 1 1 double\n" + array([0.5], "f8"))
    parts.append(b"POINTS %d %b\n" % (len(mesh.positions), dtype.encode()))
    parts.append(array(mesh.positions, "f8" if dtype == "double" else "f4"))
    parts.append(b"METADATA\nINFORMATION 0\n\n")
    flat = np.concatenate([c for _, c in cells])
    if version == "5.1":
        offsets = np.cumsum([0, *(len(c) for _, c in cells)])
        parts.append(b"CELLS %d %d\n" % (len(offsets), len(flat)))
        parts.append(b"OFFSETS vtktypeint64\n" + array(offsets, "i8"))
        parts.append(b"CONNECTIVITY vtktypeint64\n" + array(flat, "i8"))
    else:
        sized = np.concatenate([[len(c), *c] for _, c in cells])
        parts.append(b"CELLS %d %d\n" % (len(cells), len(sized)) + array(sized, "i4"))
    parts.append(b"CELL_TYPES %d\n" % len(cells) + array([k for k, _ in cells], "i4"))
    if mesh.labels is None:
        parts.append(b"POINT_DATA %d\n" % len(mesh.positions))
        return b"".join(parts)
    quality = np.linspace(0.0, 1.0, len(cells))
    parts.append(b"CELL_DATA %d\nSCALARS quality double\nLOOKUP_TABLE default\n" % len(cells))
    parts.append(array(quality, "f8") + b"FIELD FieldData 1\nregion 1 %d int\n" % len(cells))
    parts.append(array(_labels(mesh), "i4"))
    return b"".join(parts)


def vtu(
    mesh: TetrahedralMesh,
    form: str = "binary",
    order: str = "<",
    header: str = "UInt64",
    is_compressed: bool = False,
    appended_is_raw: bool = True,
    compress: Callable[[bytes], bytes] = zlib.compress,
    block_size: int = 100,
) -> bytes:
    """Return a mesh in the VTK XML format, in any of its encodings of numbers.

    Args:
        mesh: The mesh.
        form: "ascii", "binary" or "appended".
        order: Byte order, "<" or ">".
        header: Type of the sizes in front of binary data.
        is_compressed: Whether binary data is compressed.
        appended_is_raw: Whether appended data is raw, else base64.
        compress: How: by zlib or, if it is `lzma.compress`, by LZMA.
        block_size: What is compressed at once [bytes]; small, so that there are many blocks.
    """
    pack = None if not is_compressed else (compress, block_size)
    cells = [(_VTK_KINDS[kind], [i - FIRST_TAG for i in c]) for kind, c in _cells(mesh)]
    appended = b""

    def array(name: str, dtype: str, values: object) -> bytes:
        nonlocal appended
        code = {"Float64": "f8", "Int64": "i8", "UInt8": "u1"}[dtype]
        offset = b' offset="%d"' % len(appended) if form == "appended" else b""
        data = np.ravel(values).astype(order + code).tobytes()
        if form == "ascii":
            text = " ".join(repr(v) for v in np.ravel(values).tolist()).encode()
        elif form == "appended":
            appended += _vtu_data(data, order, header, pack, appended_is_raw)
            text = b""
        else:
            text = _vtu_data(data, order, header, pack, is_raw=False)
        components = b' NumberOfComponents="3"' if name == "Points" else b""
        return b'<DataArray type="%b" Name="%b"%b format="%b"%b>%b</DataArray>\n' % (
            *(dtype.encode(), name.encode(), components, form.encode(), offset),
            text,
        )

    body = b'<Piece NumberOfPoints="%d" NumberOfCells="%d">\n' % (len(mesh.positions), len(cells))
    body += b"<Points>" + array("Points", "Float64", mesh.positions) + b"</Points>\n<Cells>"
    body += array("connectivity", "Int64", np.concatenate([c for _, c in cells]))
    body += array("offsets", "Int64", np.cumsum([len(c) for _, c in cells]))
    body += array("types", "UInt8", [k for k, _ in cells]) + b"</Cells>\n"
    if mesh.labels is not None:
        body += b"<CellData>" + array("quality", "Float64", np.linspace(0.0, 1.0, len(cells)))
        body += array("region", "Int64", _labels(mesh)) + b"</CellData>\n"
    body += b"</Piece>\n"
    endian = b"LittleEndian" if order == "<" else b"BigEndian"
    name = b"LZMA" if compress is lzma.compress else b"ZLib"
    compressor = b' compressor="vtk%bDataCompressor"' % name if is_compressed else b""
    if form == "appended":
        encoding = b"raw" if appended_is_raw else b"base64"
        appended = b'<AppendedData encoding="%b">_%b</AppendedData>\n' % (encoding, appended)
    return (
        b'<?xml version="1.0"?>\n'
        b'<VTKFile type="UnstructuredGrid" version="1.0" byte_order="%b" header_type="%b"%b>\n'
        b"<UnstructuredGrid>\n%b</UnstructuredGrid>\n%b</VTKFile>\n"
        % (endian, header.encode(), compressor, body, appended)
    )


def medit(mesh: TetrahedralMesh) -> bytes:
    """Return a mesh in the Medit format, as text."""
    rows = [
        "MeshVersionFormatted 2",
        "Dimension 3",
        "# nodes",
        "Vertices",
        str(len(mesh.positions)),
    ]
    rows += [f"{x!r} {y!r} {z!r} 0" for x, y, z in mesh.positions.tolist()]
    for kind, name in ((1, "Edges"), (2, "Triangles"), (4, "Tetrahedra")):
        cells = _with_labels(mesh, kind)
        rows += [name, str(len(cells))]
        rows += [_spaced([n - FIRST_TAG + 1 for n in nodes] + [label]) for nodes, label in cells]
    return "\n".join([*rows, "Corners", "1", "1", "End", ""]).encode()


def medit_binary(mesh: TetrahedralMesh, version: int, order: str) -> bytes:
    """Return a mesh in the binary Medit format, version 2 to 4, in byte order "<" or ">"."""
    place, whole = "i" if version < 3 else "q", "i" if version < 4 else "q"
    data = struct.pack(order + "ii", 1, version)
    nodes = b"".join(struct.pack(f"{order}3d{whole}", *p, 0) for p in mesh.positions)
    sections = [(3, struct.pack(order + "i", 3))]
    sections.append((4, struct.pack(order + whole, len(mesh.positions)) + nodes))
    for kind, number in ((1, 5), (2, 6), (4, 8)):
        cells = _with_labels(mesh, kind)
        rows = [[*(n - FIRST_TAG + 1 for n in nodes), label] for nodes, label in cells]
        packed = b"".join(struct.pack(f"{order}{len(row)}{whole}", *row) for row in rows)
        sections.append((number, struct.pack(order + whole, len(rows)) + packed))
    for number, content in [*sections, (54, b"")]:
        head = struct.calcsize(f"{order}i{place}")
        after = len(data) + head + len(content) if content else 0
        data += struct.pack(f"{order}i{place}", number, after) + content
    return data


def tetgen(mesh: TetrahedralMesh, first: int = 0) -> tuple[bytes, bytes]:
    """Return the files of nodes and of tetrahedra in TetGen's format, numbered from `first` on."""
    nodes = [f"# a comment\n{len(mesh.positions)} 3 0 1"]
    nodes += [
        f"{i} {x!r} {y!r} {z!r} 0" for i, (x, y, z) in enumerate(mesh.positions.tolist(), first)
    ]
    cells = _with_labels(mesh, 4)
    elements = [f"{len(cells)} 4 1"]
    for i, (tags, label) in enumerate(cells, first):
        elements.append(f"{i} {_spaced([n - FIRST_TAG + first for n in tags])} {label}")
    return "\n".join([*nodes, ""]).encode(), "\n".join([*elements, "# the end", ""]).encode()


def abaqus(mesh: TetrahedralMesh) -> bytes:
    """Return a mesh in the Abaqus format, with a set of elements for each label."""
    rows = ["** a comment", "*HEADING", "a block", "*NODE"]
    rows += [
        f"{i + FIRST_TAG}, {x!r}, {y!r}, {z!r}"
        for i, (x, y, z) in enumerate(mesh.positions.tolist())
    ]
    rows += ["*Element, type=S3", _commas([9001, *_cells(mesh)[2][1]]), "*ELEMENT, TYPE=C3D4"]
    cells = _with_labels(mesh, 4)
    rows += [_commas([k, *nodes]) for k, (nodes, _) in enumerate(cells, 1)]
    for label in sorted({label for _, label in cells} - {0}):
        rows.append(f"*Elset, elset={mesh.label_names.get(label, f'set{label}')}")
        rows += [str(k) for k, (_, its) in enumerate(cells, 1) if its == label]
    return "\n".join([*rows, "*MATERIAL, NAME=a", "*ELASTIC", "1e4, 0.4", ""]).encode()


def nastran(mesh: TetrahedralMesh, form: str) -> bytes:
    """Return a mesh as Nastran bulk data in "free", "large" or "small" fields.

    Small fields hold five to seven digits of a coordinate.
    """

    def card(name: str, *fields: object) -> str:
        if form == "free":
            return ",".join([name, *map(_field, fields)])
        if form == "small":
            texts = [_field(f, 8) for f in fields]
            return f"{name:<8}" + "".join(f"{text:>8}" for text in texts)
        texts = [_field(f, 16) for f in fields]
        lines = [texts[i : i + 4] for i in range(0, len(texts), 4)]
        heads = [f"{name}*", *["*"] * len(lines)]
        pairs = zip(heads, lines, strict=False)
        return "\n".join(f"{head:<8}" + "".join(f"{t:>16}" for t in line) for head, line in pairs)

    rows = ["SOL 101", "CEND", "BEGIN BULK", "$ nodes"]
    rows += [card("GRID", i + FIRST_TAG, "", *p) for i, p in enumerate(mesh.positions.tolist())]
    rows.append(card("CTRIA3", 9001, 1, *_cells(mesh)[2][1]))
    cells = _with_labels(mesh, 4)
    rows += [card("CTETRA", k, label + 1, *nodes) for k, (nodes, label) in enumerate(cells, 1)]
    return "\n".join([*rows, card("PSOLID", 1, 1), "ENDDATA", ""]).encode()


def _field(value: object, width: int = 24) -> str:
    """Return a field of a Nastran card; where room is short, an exponent has no E."""
    if not isinstance(value, float):
        return str(value)
    text = repr(value)
    for digits in range(17, 0, -1):
        if len(text) <= width:
            return text
        text = f"{value:.{digits}g}"
        text = text if "." in text or "e" in text else text + "."
        text = text.replace("e-0", "-").replace("e-", "-")
    return text


def _commas(values: list[int]) -> str:
    return ", ".join(map(str, values))


def _with_labels(mesh: TetrahedralMesh, kind: int) -> list[tuple[list[int], int]]:
    """Return nodes and label of the cells of one of Gmsh's types."""
    pairs = zip(_cells(mesh), _labels(mesh), strict=True)
    return [(nodes, label) for (k, nodes), label in pairs if k == kind]


def _labels(mesh: TetrahedralMesh) -> list[int]:
    """Return a label for each of the cells."""
    labels = np.zeros(len(mesh.tetrahedra), int) if mesh.labels is None else mesh.labels
    return [0, 0, 0, *labels.tolist()]


def _gmsh_names(mesh: TetrahedralMesh) -> bytes:
    if not mesh.label_names:
        return b""
    lines = [f'3 {label} "{name}"' for label, name in mesh.label_names.items()]
    rows = ["$PhysicalNames", str(len(lines) + 1), '2 1 "skin"', *lines, "$EndPhysicalNames", ""]
    return "\n".join(rows).encode()


_VTK_KINDS = {15: 1, 1: 3, 2: 5, 4: 10}
"""Number of a cell type in Gmsh to that in VTK."""


def _cells(mesh: TetrahedralMesh) -> list[tuple[int, list[int]]]:
    """Return the type and node tags of all cells, as Gmsh numbers them."""
    tetrahedra = (mesh.tetrahedra + FIRST_TAG).tolist()
    first = tetrahedra[0]
    return [(15, first[:1]), (1, first[:2]), (2, first[:3]), *((4, c) for c in tetrahedra)]


def _gmsh_header(version: str, order: str) -> bytes:
    one = struct.pack(order + "i", 1) + b"\n" if order else b""
    return b"$MeshFormat\n%b %d 8\n%b$EndMeshFormat\n" % (version.encode(), bool(order), one)


def _numbers(lines: list[tuple[str, list[float]]], order: str) -> bytes:
    if order:
        return b"".join(struct.pack(f"{order}{len(v)}{code}", *v) for code, v in lines)
    return "\n".join(
        _spaced([float(x) if code == "d" else x for x in v]) for code, v in lines
    ).encode()


def _spaced(values: list[float]) -> str:
    return " ".join(repr(v) for v in values)


def _vtu_data(
    data: bytes,
    order: str,
    header: str,
    pack: tuple[Callable[[bytes], bytes], int] | None,
    is_raw: bool,
) -> bytes:
    code = "I" if header == "UInt32" else "Q"
    if pack is None:
        whole = struct.pack(order + code, len(data)) + data
        return whole if is_raw else base64.b64encode(whole)
    compress, size = pack
    blocks = [compress(data[i : i + size]) for i in range(0, len(data), size)]
    numbers = [len(blocks), size, len(data) % size, *(len(b) for b in blocks)]
    parts = [struct.pack(f"{order}{len(numbers)}{code}", *numbers), b"".join(blocks)]
    return b"".join(parts if is_raw else [base64.b64encode(part) for part in parts])
