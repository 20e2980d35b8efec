"""Files that a case leaves behind: a table as CSV, plots, JSON, and a summary on the console."""

import csv
import json
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from rich.console import Console
from rich.table import Table

from scalpel_sim.errors import RunError
from scalpel_sim.scene.case import TIME, CaseContent
from scalpel_sim.validate.cases.expected import ExpectedCurve
from scalpel_sim.validate.cases.runner import CaseRecord
from scalpel_sim.validate.findings import FAIL, Check, Curve, Plot
from scalpel_sim.validate.report import bounds_text, check_entry, draw_plot, value_text
from tissue.support import whole_file

TABLE_FILE, SUMMARY_FILE = "case.csv", "case.json"

_FORMAT = "scalpel-sim case 1"
"""First entry of the JSON; the number changes where readers of older files would fail."""


class CaseFindings(NamedTuple):
    """A case that was run."""

    case: CaseContent
    record: CaseRecord
    checks: Sequence[Check]
    """One for each expectation."""
    curves: Sequence[ExpectedCurve | None]
    """The curve of each expectation; None for a value."""
    seconds: float
    """Wall time of the run on this machine [s]."""

    @property
    def has_passed(self) -> bool:
        """Whether every expectation is met; true where there is none."""
        return all(check.verdict != FAIL for check in self.checks)


def write_case(folder: Path, found: CaseFindings, versions: dict[str, str]) -> list[str]:
    """Write the table, the summary and a plot of each record; return the names of the files.

    Raises:
        RunError: a file cannot be written.
    """
    try:
        _write_table(folder / TABLE_FILE, found.record)
        text = case_as_json(found, versions)
        with whole_file(folder / SUMMARY_FILE) as unfinished:
            unfinished.write_text(text + "\n", encoding="utf-8")
        plots = {f"{record.name}.png": record.name for record in found.case.record}
        for file, name in plots.items():
            draw_plot(_plot(found, name), folder / file)
    except OSError as error:
        raise RunError(
            f"{error.filename or folder}: cannot be written ({error.strerror or error}); "
            "choose another --out"
        ) from error
    return [TABLE_FILE, SUMMARY_FILE, *plots]


def case_as_json(found: CaseFindings, versions: dict[str, str]) -> str:
    """Return the findings as JSON text."""
    record = found.record
    content = {
        "format": _FORMAT,
        "title": found.case.title,
        "versions": versions,
        "passed": found.has_passed,
        "seconds": round(found.seconds, 1),
        "records": {
            name: {"unit": record.units[name], **_extremes(record, name)}
            for name in record.columns
            if name != TIME
        },
        "expected": [
            {**check_entry(check), "source": expected.source}
            for check, expected in zip(found.checks, found.case.expected, strict=True)
        ],
        "energies_j": record.energies._asdict() | {"residual": record.energies.residual},
        "pieces": record.n_pieces,
    }
    return json.dumps(content, indent=2, ensure_ascii=False, allow_nan=False)


def print_case(found: CaseFindings, console: Console) -> None:
    """Print the records, the expectations and the account of energy."""
    title, record = found.case.title, found.record
    table = Table(title=title, title_justify="left")
    for heading in ("record", "least", "largest", "last", "unit"):
        table.add_column(heading, justify="left" if heading in ("record", "unit") else "right")
    for name in record.columns:
        if name != TIME:
            numbers = (f"{value:.4g}" for value in _extremes(record, name).values())
            table.add_row(name, *numbers, record.units[name])
    console.print(table)
    for check, expected in zip(found.checks, found.case.expected, strict=True):
        text = f"{check.verdict}: {check.name}: {value_text(check)}, wanted {bounds_text(check)}"
        console.print(f"{text} ({expected.source})", markup=False, highlight=False, soft_wrap=True)
    energies = record.energies
    work = sum(energies[:3])
    console.print(
        f"work put in: {work:.4g} J, not accounted for: {energies.residual:.2g} J; "
        f"pieces at the end: {record.n_pieces}",
        highlight=False,
    )


def _write_table(path: Path, record: CaseRecord) -> None:
    """Write the columns, their units in the line of names."""
    with whole_file(path) as unfinished, unfinished.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow([f"{name}_{record.units[name].lower()}" for name in record.columns])
        writer.writerows(
            [f"{value:.9g}" for value in row] for row in zip(*record.columns.values(), strict=True)
        )


def _plot(found: CaseFindings, name: str) -> Plot:
    """Return the plot of a record: over time, or against what an expected curve is against."""
    record = found.record
    pairs = zip(found.case.expected, found.curves, strict=True)
    expected = [(e, c) for e, c in pairs if e.record == name and c is not None]
    against = expected[0][0].against if expected else TIME
    curves = [Curve(name, record.columns[against], record.columns[name])]
    curves += [
        Curve(f"expected: {e.source}", c.x, c.y, is_theory=True)
        for e, c in expected
        if e.against == against
    ]
    x, y = (f"{each} [{record.units[each]}]" for each in (against, name))
    return Plot(found.case.title, x, y, curves)


def _extremes(record: CaseRecord, name: str) -> dict[str, float]:
    """Return the least, largest and last value of a record."""
    column = record.columns[name]
    return {
        "least": float(column.min()),
        "largest": float(column.max()),
        "last": float(column[-1]),
    }
