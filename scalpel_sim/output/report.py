"""The table that a run prints. `bench table1` compares with the paper's figures."""

from collections.abc import Iterator
from math import degrees
from typing import Any

from rich.console import Console
from rich.table import Table

from scalpel_sim.output.run_outcome import COMPLETE
from scalpel_sim.output.score_table import score_table
from scalpel_sim.output.summary import Summary
from scalpel_sim.recording.recording import TERMS
from tissue import LAWS

STAGE_NAMES = {
    "RX": "relaxation",
    "RD": "rendering",
    "GC": "geometric changes",
    "CD": "collision detection",
}
"""Names of the stages of the paper's Table 1, in its order."""

LARGEST_GAP = 0.05
"""Difference between the area that the blade paid for and that of the cut from which the table says
so."""

MOST_PIECES = 8
"""Number of pieces that the table shows, the largest; `summary.json` has them all."""

G_PER_KG = 1e3
_KPA_PER_PA = 1e-3
CM3_PER_M3 = 1e6
_MM_PER_M = 1e3
_MM2_PER_M2 = 1e6
_CM3_PER_M3 = 1e6
_MJ_PER_J = 1e3


SATURATIONS = {
    "force_limited": "force above the device's limit",
    "torque_limited": "torque above the device's limit",
    "slew_limited": "force changed too fast for the device",
    "absurd": "absurd answers",
    "silent": "tissue silent for 10 ms",
    "faded": "force faded or ramped",
}
"""Counters of the bridge that the table shows where they are not zero, and their labels."""


WORKS = {
    "work_of_blade": "work of the blade",
    "work_of_loads": "work of loads and graspers",
    "work_of_supports": "work of supports",
}
"""The works of the account, and their labels."""


_Rows = Iterator[tuple[str, str]]
"""Labels and figures."""


def print_summary(summary: Summary, console: Console) -> None:
    """Print the figures of a run as a table."""
    table = _table(f"{summary.scene}: {summary.settings['stroke']} stroke", n_figures=1)
    for label, figure in _figures(summary):
        table.add_row(label, figure)
    table.add_section()
    for stage, name in STAGE_NAMES.items():
        table.add_row(f"{stage}  {name}", f"{summary.share[stage]:.1%}")
    table.add_row("other (arm, bridge)", f"{summary.share['other']:.1%}")
    console.print(table)
    if summary.labels:
        console.print(_labels(summary))
    if summary.interfaces:
        console.print(_interfaces(summary))
    if summary.score is not None:
        console.print(score_table(summary.score))
    if summary.warnings:
        warnings = Table(title="warnings", title_justify="left", show_header=False, show_lines=True)
        warnings.add_column(style="bold", no_wrap=True)
        for warning in summary.warnings:
            warnings.add_row(warning["kind"], warning["message"])
        console.print(warnings)
    if summary.energies_j is not None:
        console.print(_account(summary.energies_j, summary.residual_of_work))


def _labels(summary: Summary) -> Table:
    """Return the figures of the labelled parts of the body as a table."""
    table = Table(title="parts of the body", title_justify="left")
    table.add_column("label", style="bold")
    for name in ("volume", "cut area", "pieces", "work of cutting", "peak force on the edge"):
        table.add_column(name, justify="right")
    for row in summary.labels:
        name = row["name"] or (f"{row['label']}" if row["label"] else "the rest")
        work, force = row["work_of_cutting_j"], row["edge_force_peak_n"]
        table.add_row(
            f"{name} (to spare)" if row["spare"] else name,
            f"{_CM3_PER_M3 * row['volume_m3']:,.3g} cm\u00b3",
            f"{_MM2_PER_M2 * row['cut_area_m2']:,.1f} mm\u00b2",
            f"{row['pieces']}",
            "" if work is None else f"{_MJ_PER_J * work:.2f} mJ",
            "" if force is None else f"{force:.3f} N",
        )
    return table


def _interfaces(summary: Summary) -> Table:
    """Return the figures of the layers between parts of the body as a table."""
    table = Table(title="layers between parts", title_justify="left")
    table.add_column("between", style="bold")
    for name in ("area", "dissected"):
        table.add_column(name, justify="right")
    for row in summary.interfaces:
        areas = (_MM2_PER_M2 * row[name] for name in ("area_m2", "cut_area_m2"))
        table.add_row(" and ".join(row["between"]), *(f"{area:,.1f} mm\u00b2" for area in areas))
    return table


def headline(summary: Summary) -> list[tuple[str, str]]:
    """Return labels and figures of what a person wants to know first."""
    rows = [
        ("cut area", f"{_MM2_PER_M2 * summary.cut_area_m2:,.0f} mm\u00b2"),
        ("force, mean", f"{summary.force_mean_n:.2f} N"),
        ("force, peak", f"{summary.force_peak_n:.2f} N"),
        ("work of the blade", f"{_MJ_PER_J * summary.work_of_blade_j:.1f} mJ"),
    ]
    if summary.pieces is not None:
        rows.insert(1, ("pieces", f"{summary.pieces}"))
    return rows


def _table(title: str, n_figures: int) -> Table:
    """Return an empty table of a label and some figures a row."""
    table = Table(title=title, title_justify="left", show_header=False)
    table.add_column(style="bold")
    for _ in range(n_figures):
        table.add_column(justify="right")
    return table


def _figures(summary: Summary) -> _Rows:
    """Yield all figures but the shares of the stages."""
    if summary.status != COMPLETE:
        yield "status", summary.status
    yield "simulated time", f"{summary.simulated_seconds:.3f} s"
    yield "real-time factor", _speed(summary)
    yield "tetrahedra before", f"{summary.tetrahedra_initial:,}"
    yield "tetrahedra after", f"{summary.tetrahedra_final:,}"
    yield "pieces", "unknown" if summary.pieces is None else str(summary.pieces)
    for number, piece in enumerate(summary.each_piece[:MOST_PIECES], 1):
        volume, mass = piece["volume_m3"] * CM3_PER_M3, piece["mass_kg"] * G_PER_KG
        held = "held" if piece["held"] else "loose"
        yield f"piece {number}, {held}", f"{volume:.3g} cm³, {mass:.3g} g"
    if summary.quality is not None:
        yield from _quality(summary.quality)
    if "springs" in summary.settings:
        yield from _springs(summary.settings["springs"])
    yield from _cut(summary)
    yield from _counters(summary.counters)
    yield "frames/s, median", f"{summary.frame_rate_median:,.0f}"
    yield "frames/s, 99th percentile", f"{summary.frame_rate_p99:,.0f}"


def _speed(summary: Summary) -> str:
    """Return the real-time factor, with options that make a run faster where it is below 1."""
    factor = f"{summary.real_time_factor:.2f}"
    if summary.real_time_factor >= 1.0:
        return factor
    settings = summary.settings
    faster = []
    law = LAWS.get(settings.get("material", {}).get("law"))
    stiffens = law is not None and law.stiffens
    if settings.get("relaxation") == "global" and not stiffens:
        faster.append("--relaxation verlet")
    if settings.get("audit"):
        faster.append("--no-audit")
    hint = f"; try {', '.join(faster)}" if faster else ""
    return f"{factor}: slower than real time{hint}"


def _quality(quality: dict[str, float]) -> _Rows:
    """Yield the distance of the cut from the blade's path, and its effect on mesh and time step."""
    mean, largest, altitude, before = (
        f"{quality[name] * _MM_PER_M:.3g}"
        for name in (
            "path_error_mean_m",
            "path_error_largest_m",
            "smallest_altitude_m",
            "smallest_altitude_initial_m",
        )
    )
    sizes = quality["path_error_mean_node_sizes"], quality["path_error_largest_node_sizes"]
    yield "path error, mean", f"{mean} mm, {sizes[0]:.2g} node sizes"
    yield "path error, largest", f"{largest} mm, {sizes[1]:.2g} node sizes"
    guards = quality["smallest_altitude_m"] / quality["guard_m"] if quality["guard_m"] > 0.0 else 0
    yield "smallest altitude", f"{altitude} mm" + (f", {guards:.2g} x the guard" if guards else "")
    yield "smallest altitude before", f"{before} mm"
    yield "growth of tetrahedra", f"{quality['tetrahedra_growth']:.2f}"
    yield "growth of the frequency bound", f"{quality['frequency_growth']:.2f}"
    yield "growth of substeps", f"{quality['substep_growth']:.2f}"
    yield "mass added to light nodes", f"{1e2 * quality['added_mass']:.2g} %"
    if quality["most_added_mass"] > quality["added_mass"]:
        yield "the most in the run", f"{1e2 * quality['most_added_mass']:.2g} %"
    if quality["inverted"] > 0.0:
        yield "tetrahedra inside out", f"{1e2 * quality['inverted']:.2g} %"


def _springs(springs: dict[str, float]) -> _Rows:
    """Yield the elastic constants of the springs on this mesh."""
    mean, softest, stiffest = (
        springs[f"young_modulus_{which}pa"] * _KPA_PER_PA for which in ("", "softest_", "stiffest_")
    )
    error = springs["young_modulus_error"]
    yield "springs: Young's modulus", f"{mean:.3g} kPa, {error:+.1%}"
    yield "springs: by direction", f"{softest:.3g} to {stiffest:.3g} kPa"
    yield "springs: Poisson's ratio", f"{springs['poisson_ratio']:.2f}"


def _cut(summary: Summary) -> _Rows:
    """Yield the area of the cut, the forces, the collisions and the work."""
    asked = summary.asked_area_m2
    share = f", {summary.cut_area_m2 / asked:.0%} of what is planned" if asked else ""
    yield "cut area", f"{summary.cut_area_m2 * _MM2_PER_M2:,.0f} mm²{share}"
    if summary.finished_area_m2 > 0.0:
        finished = f"{summary.finished_area_m2 * _MM2_PER_M2:,.1f} mm² of the cut, at no work"
        yield "bridges finished", finished
    paid, cut = summary.cut_area_paid_m2, summary.cut_area_m2
    if paid is not None and cut > 0.0:
        off = f": more than {LARGEST_GAP:.0%} off" if abs(paid / cut - 1.0) > LARGEST_GAP else ""
        share = f"{paid / cut:.0%} of the cut{off}"
        yield "area paid for", f"{paid * _MM2_PER_M2:,.0f} mm², {share}"
    yield "peak force", f"{summary.force_peak_n:.3f} N"
    yield "mean force", f"{summary.force_mean_n:.3f} N"
    for number, each in enumerate(summary.strokes, 1):
        how = f"{each['ended']}, {each['time_s']:.3f} s, {each['force_n']:.3g} N"
        yield f"stroke {number}, {each['kind']}", how
    for number, each in enumerate(summary.cores, 1):
        if each["moved_m"] is not None:
            how = f"moved by {1e3 * each['moved_m']:.3g} mm, turned by"
            yield f"core {number}, {each['where']}", f"{how} {degrees(each['turned_rad']):.3g}°"
    for number, each in enumerate(summary.attachments, 1):
        name = f"attachment {number}" + (f", {each['where']}" if each["where"] else "")
        peak, end = each["force_peak_n"], each["force_at_end_n"]
        left = "" if each["points"] else ", released"
        yield name, f"{peak:.3f} N at most, {end:.3f} N at the end{left}"
    for hand in summary.hands:
        n_points = hand["points_held_most"]
        held = f", {n_points:,} points held at most" if n_points else ""  # else by friction
        yield f"peak force, {hand['name']}", f"{hand['force_peak_n']:.3f} N{held}"
    for pair, frames in summary.touched.items():
        yield f"collision: {pair}", f"{frames:,} frames"
    yield "work of the blade", f"{summary.work_of_blade_j * _MJ_PER_J:.2f} mJ"


def _counters(counters: dict[str, Any]) -> _Rows:
    """Yield what limited or replaced the answers of the tissue, where anything did."""
    for name, label in SATURATIONS.items():
        if counters.get(name):
            yield label, f"{counters[name]:,} frames"
    passivity = counters.get("passivity", {})
    if passivity.get("frames"):
        away = passivity["injected_away"] * _MJ_PER_J
        yield "damped for passivity", f"{passivity['frames']:,} frames, {away:.2g} mJ"


def _account(energies: dict[str, float], residual_of_work: float | None) -> Table:
    """Return the energy account as a table; the shares are of the work put in, 100 % in all."""
    work = sum(energies[name] for name in ("work_of_blade", "work_of_loads", "work_of_supports"))
    table = _table("where the work went", n_figures=2)

    def row(label: str, energy: float, share: float | None) -> None:
        percent = "" if share is None else f"{share:.2%}"
        table.add_row(label, f"{energy * _MJ_PER_J:.4f} mJ", percent)

    for name, label in WORKS.items():
        if energies[name] or name == "work_of_blade":
            row(label, energies[name], energies[name] / work if work else None)
    table.add_section()
    for term in TERMS:
        if energies[term.name]:
            row(term.label, energies[term.name], energies[term.name] / work if work else None)
    row("not accounted for", energies["residual"], residual_of_work)
    return table
