"""Names of the physical groups of a Gmsh file."""

import re

from tissue.io.byte_reader import ByteReader, shown

_SECTION = re.compile(rb"(?ms)^[ \t]*\$PhysicalNames[ \t]*\r?\n(.*?)^[ \t]*\$EndPhysicalNames\b")
_LINE = re.compile(r'\s*([0-9]+)\s+(-?[0-9]+)\s+"(.*)"\s*')


def group_names(reader: ByteReader) -> dict[int, str]:
    """Return the names of the physical groups of volumes, by their numbers."""
    section = _SECTION.search(reader.data)
    if section is None:
        return {}
    lines = [line for line in section[1].decode("utf-8", "replace").splitlines() if line.strip()]
    names = {}
    for line in lines[1:]:  # after their number
        match = _LINE.fullmatch(line)
        if match is None:
            reader.fail(
                f'expected dimension, number and "name" of a group, found {shown(line)}',
                section.start(1),
            )
        if match[1] == "3":
            names[abs(int(match[2]))] = match[3]
    return names
