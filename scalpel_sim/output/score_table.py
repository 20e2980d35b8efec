"""The table of a score, as a run prints it."""

from collections.abc import Iterator
from typing import Any

from rich.table import Table

_MM_PER_M = 1e3
_MM2_PER_M2 = 1e6
_MM3_PER_M3 = 1e9
_MJ_PER_J = 1e3

_Rows = Iterator[tuple[str, str]]
"""Labels and figures."""


def score_table(score: dict[str, Any]) -> Table:
    """Return the figures of a score (`scoring.score.Score.figures`) as a table."""
    table = Table(title=f"score: {score['kind']}", title_justify="left", show_header=False)
    table.add_column(style="bold")
    table.add_column(justify="right")
    for rows in (_success(score), _cut(score), _tissue(score), _hands(score)):
        for label, figure in rows:
            table.add_row(label, figure)
    return table


def _success(score: dict[str, Any]) -> _Rows:
    """Yield whether the task is done."""
    if score["success"] is not None:
        yield "success", "yes" if score["success"] else f"no: {', '.join(score['failed'])}"
    elif score["unknown"]:
        yield "success", f"not known, as is {', '.join(score['unknown'])}"


def _cut(score: dict[str, Any]) -> _Rows:
    """Yield the terms of the plan."""
    terms, tolerance = score["terms"], _MM_PER_M * score["tolerance_m"]
    if "covered" not in terms:
        return
    planned = _MM2_PER_M2 * score["planned_area_m2"]
    yield "covered", f"{terms['covered']:.1%} of {planned:,.0f} mm\u00b2"
    off = _MM2_PER_M2 * terms["off_plan"]
    yield "off the plan", f"{off:,.1f} mm\u00b2, by more than {tolerance:g} mm"
    mean, most = (_MM_PER_M * terms[name] for name in ("path_error", "path_error_largest"))
    yield "distance from the plan", f"{mean:.2f} mm (rms), {most:.2f} mm at most"
    if "depth_error" in terms:
        yield "error of depth, mean", f"{_MM_PER_M * terms['depth_error']:.2f} mm"


def _tissue(score: dict[str, Any]) -> _Rows:
    """Yield what became of the parts of the body."""
    terms = score["terms"]
    for row in score["spared"]:
        cut, distance = row["cut_area_m2"], row["distance_m"]
        figure = "no cut"
        if cut > 0.0:
            figure = f"{_MM2_PER_M2 * cut:,.1f} mm\u00b2 cut"
        elif distance is not None:
            figure = f"whole, {_MM_PER_M * distance:.2f} mm from the cut"
        yield f"to spare: {row['label']}", figure
    for row in score["strains"]:
        name = row["label"] or "tissue"
        yield (
            f"{name} strained above {row['limit']:g}",
            f"{_MM3_PER_M3 * row['volume_m3']:,.0f} mm\u00b3",
        )
    if "removed" in terms:
        healthy = _MM3_PER_M3 * terms["healthy"]
        yield (
            "cut out",
            f"{terms['removed']:.1%} of the target, {healthy:,.0f} mm\u00b3 of the rest",
        )
    if "exposed" in terms:
        yield "exposed", f"{terms['exposed']:.1%} of the target"


def _hands(score: dict[str, Any]) -> _Rows:
    """Yield what each instrument did."""
    for hand in score["instruments"]:
        name, above = hand["name"], hand["force_above_n"]
        limit = hand["force_limit_n"]
        beyond = "" if limit is None else f", {above:.3f} N above {limit:g} N"
        yield f"force of {name}", f"{hand['force_n']:.3f} N{beyond}"
        yield f"impulse of {name}", f"{hand['impulse_ns']:.3f} N s"
        way = f"{_MM_PER_M * hand['path_length_m']:,.0f} mm, jerk {hand['jerk_m_s3']:.2g} m/s\u00b3"
        yield f"way of {name}", way
        if hand["held"] is not None:
            yield f"held by {name}", f"{hand['held']:.0%} of the time, dropped {hand['dropped']}"
    cutting = _MJ_PER_J * score["work_of_cutting_j"]
    yield (
        "work of the blade",
        f"{_MJ_PER_J * score['work_of_blade_j']:.2f} mJ, {cutting:.2f} mJ cut",
    )
