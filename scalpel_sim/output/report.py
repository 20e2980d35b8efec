"""The table that a run prints, with the paper's figures beside ours where there are any."""

from typing import Any

from rich.console import Console
from rich.table import Table

from scalpel_sim.output.run_outcome import COMPLETE
from scalpel_sim.output.summary import TABLE_1, Summary
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
_MJ_PER_J = 1e3


_PAPER = {"grid2": TABLE_1[2, 2, 2], "slab": TABLE_1[4, 6, 4]}
"""Rows of the paper's Table 1 by scene. The paper has no such figures for the other bodies."""

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


class _Rows:
    """The table of a run, with a column of the paper's figures where there are any."""

    def __init__(self, summary: Summary) -> None:
        self.paper = _PAPER.get(summary.scene)
        self.table = Table(
            title=f"{summary.scene}: {summary.settings['stroke']} stroke",
            title_justify="left",
            show_header=self.paper is not None,
        )
        self.table.add_column(style="bold")
        self.table.add_column("this run" if self.paper else "", justify="right")
        if self.paper is not None:
            self.table.add_column("paper (1998)", justify="right", style="dim")

    def add(self, label: str, ours: str, theirs: str = "") -> None:
        """Add a row; `theirs` is left out where the paper has no figures for the scene."""
        self.table.add_row(label, ours, *([theirs] if self.paper else []))


def print_summary(summary: Summary, console: Console) -> None:
    """Print the figures of a run as a table."""
    rows = _Rows(summary)
    if summary.status != COMPLETE:
        rows.add("status", summary.status)
    rows.add("simulated time", f"{summary.simulated_seconds:.3f} s")
    rows.add("real-time factor", _speed(summary))
    _add_mesh(rows, summary)
    if "springs" in summary.settings:
        _add_springs(rows, summary.settings["springs"])
    _add_cut(rows, summary)
    _add_counters(rows, summary.counters)
    _add_times(rows, summary)
    console.print(rows.table)
    if summary.warnings:
        console.print(_warnings(summary.warnings))
    if summary.energies_j is not None:
        console.print(_account(summary.energies_j, summary.residual_of_work))


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


def _add_mesh(rows: _Rows, summary: Summary) -> None:
    """Add the size of the mesh, the pieces, and the quality of the cut."""
    paper = rows.paper
    rows.add(
        "tetrahedra before",
        f"{summary.tetrahedra_initial:,}",
        f"{paper.tetrahedra_initial:,}" if paper else "",
    )
    rows.add(
        "tetrahedra after",
        f"{summary.tetrahedra_final:,}",
        f"{paper.tetrahedra_final:,}" if paper else "",
    )
    rows.add("pieces", "unknown" if summary.pieces is None else str(summary.pieces))
    for number, piece in enumerate(summary.each_piece[:MOST_PIECES], 1):
        rows.add(f"piece {number}, {'held' if piece['held'] else 'loose'}", _piece(piece))
    if summary.quality is not None:
        _add_quality(rows, summary.quality)


def _add_quality(rows: _Rows, quality: dict[str, float]) -> None:
    """Add the distance of the cut from the blade's path, and its effect on mesh and time step."""
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
    rows.add("path error, mean", f"{mean} mm, {sizes[0]:.2g} node sizes")
    rows.add("path error, largest", f"{largest} mm, {sizes[1]:.2g} node sizes")
    guards = quality["smallest_altitude_m"] / quality["guard_m"] if quality["guard_m"] > 0.0 else 0
    rows.add(
        "smallest altitude", f"{altitude} mm" + (f", {guards:.2g} x the guard" if guards else "")
    )
    rows.add("smallest altitude before", f"{before} mm")
    rows.add("growth of tetrahedra", f"{quality['tetrahedra_growth']:.2f}")
    rows.add("growth of the frequency bound", f"{quality['frequency_growth']:.2f}")
    rows.add("growth of substeps", f"{quality['substep_growth']:.2f}")
    rows.add("mass added to light nodes", f"{1e2 * quality['added_mass']:.2g} %")
    if quality["most_added_mass"] > quality["added_mass"]:
        rows.add("the most in the run", f"{1e2 * quality['most_added_mass']:.2g} %")
    if quality["inverted"] > 0.0:
        rows.add("tetrahedra inside out", f"{1e2 * quality['inverted']:.2g} %")


def _add_springs(rows: _Rows, springs: dict[str, float]) -> None:
    """Add the elastic constants of the springs on this mesh."""
    mean, softest, stiffest = (
        springs[f"young_modulus_{which}pa"] * _KPA_PER_PA for which in ("", "softest_", "stiffest_")
    )
    error = springs["young_modulus_error"]
    rows.add("springs: Young's modulus", f"{mean:.3g} kPa, {error:+.1%}")
    rows.add("springs: by direction", f"{softest:.3g} to {stiffest:.3g} kPa")
    rows.add("springs: Poisson's ratio", f"{springs['poisson_ratio']:.2f}")


def _add_cut(rows: _Rows, summary: Summary) -> None:
    """Add the area of the cut, the forces, the collisions and the work."""
    asked = summary.asked_area_m2
    share = f", {summary.cut_area_m2 / asked:.0%} of what is asked" if asked else ""
    rows.add("cut area", f"{summary.cut_area_m2 * _MM2_PER_M2:,.0f} mm²{share}")
    if summary.finished_area_m2 > 0.0:
        finished = f"{summary.finished_area_m2 * _MM2_PER_M2:,.1f} mm² of the cut, at no work"
        rows.add("bridges finished", finished)
    paid, cut = summary.cut_area_paid_m2, summary.cut_area_m2
    if paid is not None and cut > 0.0:
        off = f": more than {LARGEST_GAP:.0%} off" if abs(paid / cut - 1.0) > LARGEST_GAP else ""
        share = f"{paid / cut:.0%} of the cut{off}"
        rows.add("area paid for", f"{paid * _MM2_PER_M2:,.0f} mm², {share}")
    rows.add("peak force", f"{summary.force_peak_n:.3f} N")
    rows.add("mean force", f"{summary.force_mean_n:.3f} N")
    for number, each in enumerate(summary.attachments, 1):
        name = f"attachment {number}" + (f", {each['where']}" if each["where"] else "")
        peak, end = each["force_peak_n"], each["force_at_end_n"]
        left = "" if each["points"] else ", let go"
        rows.add(name, f"{peak:.3f} N at most, {end:.3f} N at the end{left}")
    for hand in summary.hands:
        held = f"{hand['points_held_most']:,} points held at most"
        rows.add(f"peak force, {hand['name']}", f"{hand['force_peak_n']:.3f} N, {held}")
    for pair, frames in summary.touched.items():
        rows.add(f"collision: {pair}", f"{frames:,} frames")
    rows.add("work of the blade", f"{summary.work_of_blade_j * _MJ_PER_J:.2f} mJ")


def _add_counters(rows: _Rows, counters: dict[str, Any]) -> None:
    """Add what limited or replaced the answers of the tissue, where anything did."""
    for name, label in SATURATIONS.items():
        if counters.get(name):
            rows.add(label, f"{counters[name]:,} frames")
    passivity = counters.get("passivity", {})
    if passivity.get("frames"):
        away = passivity["injected_away"] * _MJ_PER_J
        rows.add("damped for passivity", f"{passivity['frames']:,} frames, {away:.2g} mJ")


def _add_times(rows: _Rows, summary: Summary) -> None:
    """Add the frame rates, and below a line the shares of the stages."""
    paper = rows.paper
    rows.add(
        "frames/s, median",
        f"{summary.frame_rate_median:,.0f}",
        f"{paper.frame_rate} (mean)" if paper else "",
    )
    rows.add("frames/s, 99th percentile", f"{summary.frame_rate_p99:,.0f}")
    rows.table.add_section()
    for stage, name in STAGE_NAMES.items():
        rows.add(
            f"{stage}  {name}",
            f"{summary.share[stage]:.1%}",
            f"{paper.percent[stage]} %" if paper else "",
        )
    rows.add("other (arm, bridge)", f"{summary.share['other']:.1%}")


def _account(energies: dict[str, float], residual_of_work: float | None) -> Table:
    """Return the energy account as a table; the shares are of the work put in, 100 % in all."""
    work = sum(energies[name] for name in ("work_of_blade", "work_of_loads", "work_of_supports"))
    table = Table(title="where the work went", title_justify="left", show_header=False)
    table.add_column(style="bold")
    table.add_column(justify="right")
    table.add_column(justify="right")

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


def _warnings(warnings: list[dict[str, Any]]) -> Table:
    """Return what the run was asked for and did not do as a table."""
    table = Table(title="warnings", title_justify="left", show_header=False, show_lines=True)
    table.add_column(style="bold", no_wrap=True)
    table.add_column()
    for warning in warnings:
        table.add_row(warning["kind"], warning["message"])
    return table


def _piece(piece: dict[str, Any]) -> str:
    """Return the figures of one piece."""
    volume, mass = piece["volume_m3"] * CM3_PER_M3, piece["mass_kg"] * G_PER_KG
    return f"{volume:.3g} cm³, {mass:.3g} g"
