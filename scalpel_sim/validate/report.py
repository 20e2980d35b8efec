"""The report of a validation: a table on the console, a page of Markdown, JSON, and plots.

Plots are drawn without pyplot, which would look for a display.
"""

import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import msgspec
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
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
    Findings,
    Plot,
    Reference,
    ValidationScene,
)

_STYLES = {PASS: "green", KNOWN: "yellow", FAIL: "bold red"}
_NOT_CONFIRMED = "(not looked up: an estimate)"
_FORMAT = "scalpel-sim validation 1"
"""First entry of the file; the number changes where readers of older files would fail."""
# Okabe and Ito's palette, whose colours remain distinct in colour blindness.
_CURVE_COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#222222")
_BAND_COLOURS = ("#999999", "#e69f00", "#56b4e9")
_DOTS_PER_INCH = 100
_MOST_MARKERS = 12
"""Curves of no more points than this are drawn as points."""
_MOST_INSIDE = 5
"""A legend of more entries than this stands next to the plot."""


class SceneRun(NamedTuple):
    """A scene that was run."""

    scene: ValidationScene
    findings: Findings
    seconds: float
    """Wall time of the run on this machine [s]."""


class VerdictCounts(NamedTuple):
    """Number of checks by verdict."""

    passed: int
    known: int
    failed: int


def count_verdicts(runs: Sequence[SceneRun]) -> VerdictCounts:
    """Return how many checks passed, deviate as known, and failed."""
    verdicts = [check.verdict for run in runs for check in run.findings.checks]
    return VerdictCounts(*(verdicts.count(verdict) for verdict in (PASS, KNOWN, FAIL)))


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


def validation_as_json(runs: Sequence[SceneRun], *, quick: bool, versions: dict[str, str]) -> str:
    """Return all findings as JSON text."""
    content = {
        "format": _FORMAT,
        "quick": quick,
        "versions": versions,
        "passed": count_verdicts(runs).failed == 0,
        "counts": count_verdicts(runs)._asdict(),
        "scenes": [_scene_entry(run) for run in runs],
    }
    return json.dumps(content, indent=2, ensure_ascii=False, allow_nan=False)


def _scene_entry(run: SceneRun) -> dict[str, Any]:
    """Return a scene as JSON has it."""
    scene = run.scene
    return {
        "name": scene.name,
        "title": scene.title,
        "about": scene.about,
        "seconds": round(run.seconds, 1),
        "lines": [check_entry(check) for check in run.findings.checks],
        "notes": list(run.findings.notes),
        "sources": [msgspec.to_builtins(reference) for reference in scene.references],
    }


def check_entry(check: Check) -> dict[str, Any]:
    """Return a check as JSON has it."""
    return {
        "name": check.name,
        "figure": _finite(check.value),
        "unit": check.unit,
        "low": _finite(check.low),
        "high": _finite(check.high),
        "verdict": check.verdict,
        "basis": check.basis,
        "why": check.known.why if check.known and check.verdict == KNOWN else "",
    }


def _finite(number: float) -> float | None:
    """Return a number, or None where it is not finite: JSON has no such numbers."""
    return number if math.isfinite(number) else None


def draw_plot(plot: Plot, path: Path) -> None:
    """Write a plot as a PNG file."""
    figure = Figure(figsize=(8.0, 4.2), layout="constrained")
    axes = figure.subplots()
    axes.set_title(plot.title, loc="left", fontsize=11, fontweight="bold")
    for band, colour in zip(plot.bands, _BAND_COLOURS, strict=False):
        axes.axhspan(band.low, band.high, color=colour, alpha=0.25, lw=0.0, label=band.label)
    colour = _CURVE_COLOURS[-1]
    n_drawn = 0
    for curve in plot.curves:
        if curve.is_theory:
            axes.plot(curve.x, curve.y, color=colour, lw=1.0, ls="--", label=curve.label or None)
            continue
        colour = _CURVE_COLOURS[n_drawn % len(_CURVE_COLOURS)]
        n_drawn += 1
        as_points = len(curve.x) <= _MOST_MARKERS
        shape = {"marker": "o", "ls": "", "ms": 5} if as_points else {"lw": 1.4}
        axes.plot(curve.x, curve.y, color=colour, label=curve.label, **shape)
    axes.set_xlabel(plot.x)
    axes.set_ylabel(plot.y)
    axes.spines[["top", "right"]].set_visible(False)
    axes.grid(color="0.9", lw=0.6)
    axes.set_axisbelow(True)
    if len(axes.get_legend_handles_labels()[0]) > _MOST_INSIDE:
        figure.legend(frameon=False, fontsize=8, loc="outside right upper")
    else:
        axes.legend(frameon=False, fontsize=8, loc="best")
    FigureCanvasAgg(figure).print_figure(path, dpi=_DOTS_PER_INCH, format="png")
