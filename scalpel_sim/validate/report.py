"""The report of a validation: a table on the console, and a page of Markdown."""

import math
from collections.abc import Sequence

from rich.console import Console
from rich.table import Table

from scalpel_sim.validate.findings import (
    FAIL,
    KNOWN,
    PASS,
    PUBLISHED,
    REGRESSION,
    THEORY,
    Check,
    Reference,
)
from scalpel_sim.validate.results import SceneRun, VerdictCounts, count_verdicts

_STYLES = {PASS: "green", KNOWN: "yellow", FAIL: "bold red"}
_NOT_CONFIRMED = "(not looked up: an estimate)"


def print_checks(runs: Sequence[SceneRun], console: Console) -> None:
    """Print every check of every scene, and how many passed."""
    table = Table(title="Validation", title_justify="left")
    for heading in ("scene", "quantity", "value", "bounds", "basis", ""):
        table.add_column(heading, justify="right" if heading == "value" else "left")
    for run in runs:
        for i, check in enumerate(run.findings.checks):
            name = run.scene.name if i == 0 else ""
            verdict = f"[{_STYLES[check.verdict]}]{check.verdict}[/]"
            table.add_row(
                name, check.name, value_text(check), bounds_text(check), check.basis, verdict
            )
        table.add_section()
    console.print(table)
    for why in known_reasons(runs):
        console.print(f"known: {why}", markup=False, highlight=False, soft_wrap=True)
    console.print(verdict_sentence(count_verdicts(runs)))


def value_text(check: Check) -> str:
    """Return the value of a check with its unit."""
    return f"{check.value:.4g} {check.unit}".rstrip()


def bounds_text(check: Check) -> str:
    """Return the bounds of a check."""
    if check.low == check.high:
        return f"{check.low:g}"
    if math.isinf(check.high):
        return f"at least {check.low:.4g}"
    if check.low == 0.0:
        return f"at most {check.high:.4g}"
    if check.low == -check.high:
        return f"± {check.high:.4g}"
    return f"{check.low:.4g} to {check.high:.4g}"


def verdict_sentence(counts: VerdictCounts) -> str:
    """Return the number of checks by verdict as a sentence."""
    text = f"{counts.passed} of {sum(counts)} checks are within their bounds"
    if counts.known:
        text += f", {counts.known} known"
    return text + (f", {counts.failed} failed." if counts.failed else ".")


def known_reasons(runs: Sequence[SceneRun]) -> list[str]:
    """Return the explanations of the known deviations, each once."""
    checks = (check for run in runs for check in run.findings.checks)
    whys = (check.known.why for check in checks if check.known and check.verdict == KNOWN)
    return list(dict.fromkeys(whys))


def validation_page(
    runs: Sequence[SceneRun], pictures: dict[str, list[str]], *, quick: bool
) -> str:
    """Return the report as a page of Markdown.

    Args:
        runs: The scenes.
        pictures: Names of the files with the plots, by name of the scene.
        quick: Whether the short version was run, which the page then says.
    """
    parts = [
        "# Validation\n",
        "Forces of the engine against theory and published figures. "
        f"`scalpel-sim validate{' --quick' if quick else ''}` makes this page.\n",
        f"**{verdict_sentence(count_verdicts(runs))}**\n",
        "Each line says what its bounds come from. `theory`: a formula, a law of conservation or "
        "an invariance, independent of how the engine computes the value. `published`: a figure of "
        "an experiment. `regression`: what was put in comes back, as the engine's own law says; "
        "that shows that the engine does what it is told, and not that tissue does so.\n",
        f"{_bases(runs)}\n",
        "Where a scene takes a figure from a publication, it is put in, so that its line is a "
        "regression.\n",
        "A line is `known` where it is out of its bounds for a physical reason, given below its "
        "table, and within 2 % of what was measured before. Every other line that is out has "
        "failed, and the command then ends with exit code 3.\n",
    ]
    for run in runs:
        parts += _section(run, pictures.get(run.scene.name, []))
    return "\n".join(parts)


def _bases(runs: Sequence[SceneRun]) -> str:
    """Return how many lines of each basis there are, and how many of them pass."""
    checks = [check for run in runs for check in run.findings.checks]
    parts = []
    for basis in (THEORY, PUBLISHED, REGRESSION):
        verdicts = [check.verdict for check in checks if check.basis == basis]
        found = f"{verdicts.count(PASS)} of {len(verdicts)} pass" if verdicts else "none"
        parts.append(f"{basis}: {found}")
    return "; ".join(parts) + "."


def _section(run: SceneRun, pictures: Sequence[str]) -> list[str]:
    """Return the parts of the page on one scene."""
    scene, findings = run.scene, run.findings
    rows = [
        f"| {_cell(check.name)} | {value_text(check)} | {bounds_text(check)} | {check.basis} "
        f"| {check.verdict} |"
        for check in findings.checks
    ]
    table = ["| quantity | value | bounds | basis | |", "|---|---|---|---|---|", *rows]
    parts = [f"## {scene.title}\n", f"{scene.about}\n", "\n".join(table) + "\n"]
    parts += [f"Known: {why}.\n" for why in known_reasons([run])]
    parts += [f"{note}.\n" for note in findings.notes]
    parts += [f"![{scene.title}]({name})\n" for name in pictures]
    if scene.references:
        entries = (_reference(reference) for reference in scene.references)
        parts.append("\n".join(["Sources:\n", *entries]) + "\n")
    return parts


def _reference(reference: Reference) -> str:
    """Return a reference as an item of a list."""
    mark = "" if reference.is_confirmed else f" {_NOT_CONFIRMED}"
    return f"- {reference.citation}: {reference.says}{mark}"


def _cell(text: str) -> str:
    """Return text as a cell of a table: a bar would end it."""
    return text.replace("|", "\\|")
