"""The report of a run: one page for a person who has read nothing else, to keep and to print."""

import base64
import html
from collections.abc import Iterator, Sequence
from pathlib import Path
from string import Template
from typing import NamedTuple

import numpy as np

from scalpel_sim.scoring.judged_terms import JudgedTerm
from tissue import FloatArray

_PAGE = Path(__file__).with_name("report_page.html")

_WIDTH, _HEIGHT = 860, 260
"""Size of the plot of the force, in units of the picture."""

_LEFT, _RIGHT, _ABOVE, _BELOW = 68, 14, 30, 38
"""Margins of the plot."""

_MOST_COLUMNS = 600
"""Columns of the plot, of which each has its lowest and its highest force."""

_LEAST_PEAK = 0.1
"""Upper end of the plot at least [N]: else noise would fill it."""


class ReportPicture(NamedTuple):
    """A picture of a run."""

    png: bytes
    """The file."""
    caption: str
    """Description of the picture."""


class ForceCurve(NamedTuple):
    """A force over time."""

    times: FloatArray
    """Instants [s], shape (n,)."""
    forces: FloatArray
    """Forces then [N], shape (n,)."""
    limit: float | None = None
    """Force that was not to be passed [N]; None: any might."""


class RunReport(NamedTuple):
    """Contents of a report."""

    title: str
    """Heading of the page."""
    by: str
    """Hand or script, and date."""
    asked: Sequence[str]
    """Request, in sentences."""
    criteria: Sequence[JudgedTerm]
    """Figures, the judged ones first."""
    pictures: Sequence[ReportPicture]
    """Pictures of the run."""
    force: ForceCurve
    """Force on the blade."""
    warnings: Sequence[str]
    """Requests that the run did not fulfil."""
    facts: Sequence[tuple[str, str]]
    """Labels and texts: how the run was made, and how to repeat it."""


def report_html(report: RunReport) -> str:
    """Return the page: one document that needs nothing else."""
    parts = [
        *_verdict(report.criteria),
        *_section("What was to be done", [f"<p>{_text(each)}</p>" for each in report.asked]),
        *_section("What it looked like", _pictures(report.pictures)),
        *_section(_heading(report.criteria), _criteria(report.criteria)),
        *_section("Force on the blade", [_plot(report.force)]),
        *_section("What did not go as planned", _list(report.warnings)),
        *_section("How this was made", _facts(report.facts)),
    ]
    title, by = _text(report.title), _text(report.by)
    page = Template(_PAGE.read_text("utf-8"))
    return page.substitute(title=title, by=by, body="\n".join(parts))


def _section(title: str, parts: Sequence[str]) -> Iterator[str]:
    """Yield a section with its heading; nothing where it is empty."""
    if parts:
        yield f"<section><h2>{title}</h2>"
        yield from parts
        yield "</section>"


def _verdict(criteria: Sequence[JudgedTerm]) -> Iterator[str]:
    """Yield whether all that was asked for is met."""
    judged = [each for each in criteria if each.is_met is not None]
    if not judged:
        return
    met = sum(bool(each.is_met) for each in judged)
    is_passed = met == len(judged)
    word, look = ("Passed", "good") if is_passed else ("Not passed", "bad")
    missed = ", ".join(each.name.lower() for each in judged if not each.is_met)
    rest = "" if is_passed else f"; missed: {missed}"
    yield f'<p class="verdict {look}"><strong>{word}.</strong> '
    yield f"{met} of {len(judged)} criteria are met{_text(rest)}.</p>"


def _heading(criteria: Sequence[JudgedTerm]) -> str:
    """Return the heading of what was measured."""
    are_judged = any(each.is_met is not None for each in criteria)
    return "How well it was done" if are_judged else "What was measured"


def _criteria(criteria: Sequence[JudgedTerm]) -> list[str]:
    """Return the table of what was measured."""
    if not criteria:
        return []
    are_judged = any(each.is_met is not None for each in criteria)
    heads = ["what", "measured", *(("asked for", "met") if are_judged else ())]
    rows = ["<table><thead><tr>", *(f'<th scope="col">{each}</th>' for each in heads), "</tr>"]
    rows.append("</thead><tbody>")
    for each in criteria:
        rows.append(f'<tr><th scope="row">{_text(each.name)}<small>{_text(each.meaning)}</small>')
        rows.append(f'</th><td class="figure" data-label="measured">{_text(each.figure)}</td>')
        if are_judged:
            rows.append(f'<td class="figure" data-label="asked for">{_text(each.wanted)}</td>')
            rows.append(_met(each.is_met))
        rows.append("</tr>")
    return [*rows, "</tbody></table>"]


def _met(is_met: bool | None) -> str:
    """Return the cell that says whether a criterion is met: by a word and a sign, not by colour."""
    if is_met is None:
        return "<td></td>"
    look, word = ("good", "\u2713 yes") if is_met else ("bad", "\u2717 no")
    return f'<td class="met {look}" data-label="met">{word}</td>'


def _pictures(pictures: Sequence[ReportPicture]) -> list[str]:
    """Return pictures with captions, in the file."""
    if not pictures:
        return []
    found = ['<div class="pictures">']
    for each in pictures:
        data = base64.b64encode(each.png).decode("ascii")
        caption = _text(each.caption)
        found.append(f'<figure><img alt="{caption}" src="data:image/png;base64,{data}">')
        found.append(f"<figcaption>{caption}</figcaption></figure>")
    return [*found, "</div>"]


def _plot(curve: ForceCurve) -> str:
    """Return a force over time as a picture of lines, which is sharp in print."""
    if len(curve.times) == 0:
        return "<p>No frame was simulated.</p>"
    peak = float(curve.forces.max())
    top = max(_LEAST_PEAK, 1.08 * peak, 1.15 * (curve.limit or 0.0))
    end = max(float(curve.times[-1]), float(np.finfo(float).tiny))
    right, floor = _WIDTH - _RIGHT, _HEIGHT - _BELOW

    def x(time: float) -> float:
        return _LEFT + (right - _LEFT) * time / end

    def y(force: float) -> float:
        return floor - (floor - _ABOVE) * force / top

    points = " ".join(f"{x(t):.1f},{y(f):.1f}" for t, f in _thinned(curve))
    limit = "" if curve.limit is None else f", of {curve.limit:.2f} N that were allowed"
    label = f"Force on the blade over {end:.2f} s: at most {peak:.2f} N{limit}."
    lines = [
        f'<figure><svg viewBox="0 0 {_WIDTH} {_HEIGHT}" role="img" aria-label="{label}">',
        f'<path class="axis" d="M{_LEFT} {_ABOVE}V{floor}H{right}" fill="none"/>',
        f'<polyline class="curve" points="{points}"/>',
        f'<text x="{_LEFT - 8}" y="{y(0.0) + 4:.1f}" text-anchor="end">0</text>',
        f'<text x="{_LEFT - 8}" y="{y(peak) + 4:.1f}" text-anchor="end">{peak:.2f}</text>',
        f'<text class="least" x="{_LEFT}" y="16">force [N]</text>',
        f'<text x="{_LEFT}" y="{floor + 22}">0</text>',
        f'<text x="{right}" y="{floor + 22}" text-anchor="end">time {end:.2f} s</text>',
    ]
    if curve.limit is not None:
        at = f"{y(curve.limit):.1f}"
        lines.append(f'<path class="limit" d="M{_LEFT} {at}H{right}"/>')
        lines.append(
            f'<text class="limit-text" x="{right}" y="{y(curve.limit) - 6:.1f}" '
            f'text-anchor="end">limit {curve.limit:.2f} N</text>'
        )
    return "\n".join([*lines, f"</svg><figcaption>{label}</figcaption></figure>"])


def _thinned(curve: ForceCurve) -> Iterator[tuple[float, float]]:
    """Yield instants and forces: the lowest and the highest of each column of the plot."""
    for rows in np.array_split(np.arange(len(curve.times)), min(_MOST_COLUMNS, len(curve.times))):
        forces = curve.forces[rows]
        extremes = {int(rows[forces.argmin()]), int(rows[forces.argmax()])}
        for row in sorted(extremes):
            yield float(curve.times[row]), float(curve.forces[row])


def _list(texts: Sequence[str]) -> list[str]:
    """Return texts as a list."""
    items = [f"<li>{_text(each)}</li>" for each in texts]
    return ["<ul>", *items, "</ul>"] if items else []


def _facts(facts: Sequence[tuple[str, str]]) -> list[str]:
    """Return labels and texts."""
    rows = [f"<dt>{_text(label)}</dt><dd>{_text(text)}</dd>" for label, text in facts]
    return ["<dl>", *rows, "</dl>"] if rows else []


def _text(text: str) -> str:
    """Return a text in which no tag begins."""
    return html.escape(text)
