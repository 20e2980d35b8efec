"""Writes the tables of docs/scenes.md from the schema.

Run it as `python -m scalpel_sim.scene.page docs/scenes.md`.
"""

import re
import sys
from collections.abc import Mapping
from pathlib import Path

import msgspec

from scalpel_sim.scene.arm_tables import WaypointTable
from scalpel_sim.scene.body import BodyTable, OneOfBodiesTable
from scalpel_sim.scene.case import CaseContent
from scalpel_sim.scene.observe_table import ObserveTable
from scalpel_sim.scene.scene import Scene
from scalpel_sim.scene.task_table import TaskTable
from scalpel_sim.strokes.kinds import STROKES
from scalpel_sim.tables.key_texts import has_usual, texts_of, usual_text
from scalpel_sim.tables.problems import as_toml, kinds_of, row_table_of, table_of
from scalpel_sim.tables.values import Kind

_PLACE = re.compile(r"(<!-- keys of (\w+) -->\n).*?(<!-- end -->)", re.DOTALL)

_KINDS = {
    place: {name: kind.keys for name, kind in STROKES.items() if kind.is_planned == is_planned}
    for place, is_planned in (("planned", True), ("drawn", False))
}


def with_tables(page: str) -> str:
    """Return a page with the keys of each table that it names.

    They stand between `<!-- keys of TABLE -->` and `<!-- end -->`.

    Raises:
        KeyError: there is no such table.
    """
    return _PLACE.sub(lambda found: f"{found[1]}{_keys(found[2])}{found[3]}", page)


def _keys(name: str) -> str:
    """Return the lines of one table of the page."""
    if name in _KINDS:
        return _kinds(_KINDS[name])
    tables: dict[str, type[msgspec.Struct] | None] = {"motion": WaypointTable, "scene": Scene}
    for root in (CaseContent, Scene):
        tables |= {
            key: table_of(kind) or row_table_of(kind) for key, kind in kinds_of(root).items()
        }
    for name_of_table, within in (("task", TaskTable), ("observe", ObserveTable)):
        tables |= {
            f"{name_of_table}_{key}": table_of(kind) or row_table_of(kind)
            for key, kind in kinds_of(within).items()
        }
    tables["one_of_bodies"] = row_table_of(kinds_of(Scene)["body"])
    tables["case_blade"] = table_of(kinds_of(CaseContent)["blade"])
    tables["case_support"] = row_table_of(kinds_of(CaseContent)["support"])
    table = tables[name]
    assert table is not None, name
    return _rows(table)


def _rows(table: type[msgspec.Struct]) -> str:
    """Return a line for each key: its name, its usual value and its meaning."""
    lines, texts = ["| key | meaning |", "|---|---|"], texts_of(table)
    known = msgspec.structs.fields(BodyTable) if table is OneOfBodiesTable else ()
    for field in msgspec.structs.fields(table)[len(known) :]:
        if table is Scene and (table_of(field.type) or row_table_of(field.type)):
            continue
        lines.append(f"| `{field.encode_name}`{_usual(field)} | {texts[field.name]} |")
    return "\n".join(lines) + "\n"


def _usual(field: msgspec.structs.FieldInfo) -> str:
    """Return the usual value of a key in brackets, as a file has it."""
    if not has_usual(field):
        return ""
    is_plain = isinstance(field.default, (bool, str))
    return f" ({as_toml(field.default) if is_plain else usual_text(field.default)})"


def _kinds(kinds: Mapping[str, Kind]) -> str:
    """Return a line for each kind: its name, what it does, and its keys."""
    lines = ["| kind | what it does | keys it needs | keys it may have |", "|---|---|---|---|"]
    for name, kind in kinds.items():
        needed, possible = (", ".join(f"`{key}`" for key in keys) for keys in kind[1:])
        lines.append(f"| `{name}` | {kind.about} | {needed} | {possible} |")
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    path = Path(sys.argv[1])
    path.write_text(with_tables(path.read_text(encoding="utf-8")), encoding="utf-8")
