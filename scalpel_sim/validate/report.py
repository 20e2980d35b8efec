"""What a validation found, for a person: a table on the console, and a page of Markdown."""

import math
from collections.abc import Sequence

from rich.console import Console
from rich.table import Table

from scalpel_sim.validate.findings import FAIL, KNOWN, PASS, Line, Source
from scalpel_sim.validate.results import Counts, Done, counts

STYLES = {PASS: "green", KNOWN: "yellow", FAIL: "bold red"}
_NOT_CONFIRMED = "(not looked up: take it for an estimate)"


def print_table(done: Sequence[Done], console: Console) -> None:
    """Print every line of every scene, and how many passed."""
    table = Table(title="Validation", title_justify="left")
    for heading in ("scene", "what", "figure", "asked", ""):
        table.add_column(heading, justify="right" if heading == "figure" else "left")
    for each in done:
        for i, line in enumerate(each.findings.lines):
            name = each.scene.name if i == 0 else ""
            verdict = f"[{STYLES[line.verdict]}]{line.verdict}[/]"
            table.add_row(name, line.name, figure(line), asked(line), verdict)
        table.add_section()
    console.print(table)
    for why in reasons(done):
        console.print(f"known: {why}", markup=False, highlight=False, soft_wrap=True)
    console.print(summary(counts(done)))


def figure(line: Line) -> str:
    """Return the figure of a line with its unit."""
    return f"{line.figure:.4g} {line.unit}".rstrip()


def asked(line: Line) -> str:
    """Return the bounds of a line."""
    if line.low == line.high:
        return f"{line.low:g}"
    if math.isinf(line.high):
        return f"at least {line.low:.4g}"
    if line.low == 0.0:
        return f"at most {line.high:.4g}"
    if line.low == -line.high:
        return f"± {line.high:.4g}"
    return f"{line.low:.4g} to {line.high:.4g}"


def summary(found: Counts) -> str:
    """Return how it ended in a sentence."""
    total = sum(found)
    text = f"{found.passed} of {total} lines within their bounds"
    if found.known:
        text += f", {found.known} known to be out of them and explained"
    return text + (f", {found.failed} failed." if found.failed else ".")


def reasons(done: Sequence[Done]) -> list[str]:
    """Return why the known lines are out of their bounds, each reason once."""
    lines = (line for each in done for line in each.findings.lines)
    whys = (line.known.why for line in lines if line.known and line.verdict == KNOWN)
    return list(dict.fromkeys(whys))


def as_markdown(done: Sequence[Done], pictures: dict[str, list[str]], *, quick: bool) -> str:
    """Return the report as a page.

    Args:
        done: The scenes.
        pictures: Names of the files with the plots, by name of the scene.
        quick: Whether the short set was run, which the page then says.
    """
    parts = [
        "# Validation\n",
        "Forces of the engine against theory and published figures. "
        f"`scalpel-sim validate{' --quick' if quick else ''}` makes this page.\n",
        f"**{summary(counts(done))}**\n",
        "A line is `known` where its figure is out of the bounds asked for by no more than what "
        "is measured and explained below it; a line that is out by more has failed, and the "
        "command then ends with exit code 1.\n",
    ]
    for each in done:
        parts += _section(each, pictures.get(each.scene.name, []))
    return "\n".join(parts)


def _section(done: Done, pictures: Sequence[str]) -> list[str]:
    scene, findings = done.scene, done.findings
    rows = [
        f"| {_cell(line.name)} | {figure(line)} | {asked(line)} | {line.verdict} |"
        for line in findings.lines
    ]
    table = ["| what | figure | asked | |", "|---|---|---|---|", *rows]
    parts = [f"## {scene.title}\n", f"{scene.about}\n", "\n".join(table) + "\n"]
    parts += [f"Known: {why}.\n" for why in reasons([done])]
    parts += [f"{note}.\n" for note in findings.notes]
    parts += [f"![{scene.title}]({name})\n" for name in pictures]
    if scene.sources:
        parts.append(
            "\n".join(["Sources:\n", *(_source(source) for source in scene.sources)]) + "\n"
        )
    return parts


def _source(source: Source) -> str:
    mark = "" if source.is_confirmed else f" {_NOT_CONFIRMED}"
    return f"- {source.citation}: {source.says}{mark}"


def _cell(text: str) -> str:
    """Return text as a cell of a table: a bar would end it."""
    return text.replace("|", "\\|")
