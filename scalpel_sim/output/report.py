"""The table that a run prints, with the paper's figures beside ours where it has them."""

from collections.abc import Callable
from typing import Any

from rich.console import Console
from rich.table import Table

from scalpel_sim.output.energy_terms import TERMS
from scalpel_sim.output.summary import COMPLETE, STAGES, Summary
from scalpel_sim.output.table_1 import TABLE_1

STAGE_NAMES = dict(
    zip(STAGES, ("relaxation", "pictures", "topology, geometry", "collision"), strict=True)
)

MOST_PIECES = 8
"""Pieces that the table has rows for, the largest; `summary.json` has them all."""

G_PER_KG = 1e3
_KPA_PER_PA = 1e-3
CM3_PER_M3 = 1e6
_MM_PER_M = 1e3
_MM2_PER_M2 = 1e6
_MJ_PER_J = 1e3


_PAPER = {"grid2": TABLE_1[2, 2, 2], "slab": TABLE_1[4, 6, 4]}
"""By scene. The paper has no such figures for the other bodies."""


def _add_quality(row: Callable[[str, str], None], quality: dict[str, float]) -> None:
    """Add how far the cut is off the blade's path, and what following it costs."""
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
    row("path error, mean", f"{mean} mm, {sizes[0]:.2g} node sizes")
    row("path error, largest", f"{largest} mm, {sizes[1]:.2g} node sizes")
    guards = quality["smallest_altitude_m"] / quality["guard_m"] if quality["guard_m"] > 0.0 else 0
    row("smallest altitude", f"{altitude} mm" + (f", {guards:.2g} x the guard" if guards else ""))
    row("smallest altitude before", f"{before} mm")
    row("growth of tetrahedra", f"{quality['tetrahedra_growth']:.2f}")
    row("growth of the frequency bound", f"{quality['frequency_growth']:.2f}")
    row("growth of substeps", f"{quality['substep_growth']:.2f}")


def _add_springs(row: Callable[[str, str], None], springs: dict[str, float]) -> None:
    """Add what the springs are like on this mesh, beside what they stand for."""
    mean, softest, stiffest = (
        springs[f"young_modulus_{which}pa"] * _KPA_PER_PA for which in ("", "softest_", "stiffest_")
    )
    error = springs["young_modulus_error"]
    row("springs: Young's modulus", f"{mean:.3g} kPa, {error:+.1%}")
    row("springs: by direction", f"{softest:.3g} to {stiffest:.3g} kPa")
    row("springs: Poisson's ratio", f"{springs['poisson_ratio']:.2f}")


SATURATIONS = {
    "force_limited": "force above the device's limit",
    "torque_limited": "torque above the device's limit",
    "slew_limited": "force changed too fast for the device",
    "absurd": "absurd answers",
    "silent": "tissue silent for 10 ms",
    "faded": "force faded or ramped",
}
"""What the bridge counts of what came between tissue and arm, and what the table calls it."""


def _add_counters(row: Callable[[str, str], None], counters: dict[str, Any]) -> None:
    """Add what came between the tissue and the arm, where anything did."""
    for name, label in SATURATIONS.items():
        if counters.get(name):
            row(label, f"{counters[name]:,} frames")
    passivity = counters.get("passivity", {})
    if passivity.get("frames"):
        away = passivity["injected_away"] * _MJ_PER_J
        row("damped for passivity", f"{passivity['frames']:,} frames, {away:.2g} mJ")


def print_table(summary: Summary, console: Console) -> None:
    """Print the figures of a run as a table."""
    paper = _PAPER.get(summary.scene)
    table = Table(
        title=f"{summary.scene}: {summary.settings['stroke']} stroke",
        title_justify="left",
        show_header=False,
    )
    table.add_column(style="bold")
    table.add_column(justify="right")
    if paper is not None:
        table.show_header = True
        table.columns[1].header = "this run"
        table.add_column("paper (1998)", justify="right", style="dim")

    def row(label: str, ours: str, theirs: str = "") -> None:
        table.add_row(label, ours, *([theirs] if paper else []))

    if summary.status != COMPLETE:
        row("status", summary.status)
    row("simulated time", f"{summary.simulated_seconds:.3f} s")
    row("real-time factor", f"{summary.real_time_factor:.2f}")
    row(
        "tetrahedra before",
        f"{summary.tetrahedra_initial:,}",
        f"{paper.tetrahedra_initial:,}" if paper else "",
    )
    row(
        "tetrahedra after",
        f"{summary.tetrahedra_final:,}",
        f"{paper.tetrahedra_final:,}" if paper else "",
    )
    row("pieces", "unknown" if summary.pieces is None else str(summary.pieces))
    for number, piece in enumerate(summary.each_piece[:MOST_PIECES], 1):
        row(f"piece {number}, {'held' if piece['held'] else 'loose'}", _piece(piece))
    if summary.quality is not None:
        _add_quality(row, summary.quality)
    if "springs" in summary.settings:
        _add_springs(row, summary.settings["springs"])
    row("cut area", f"{summary.cut_area_m2 * _MM2_PER_M2:,.0f} mm²")
    row("peak force", f"{summary.force_peak_n:.3f} N")
    row("mean force", f"{summary.force_mean_n:.3f} N")
    for pair, frames in summary.touched.items():
        row(f"met: {pair}", f"{frames:,} frames")
    row("work of the blade", f"{summary.work_of_blade_j * _MJ_PER_J:.2f} mJ")
    _add_counters(row, summary.counters)
    row(
        "frames/s, median",
        f"{summary.frame_rate_median:,.0f}",
        f"{paper.frame_rate} (mean)" if paper else "",
    )
    row("frames/s, 99th percentile", f"{summary.frame_rate_p99:,.0f}")
    table.add_section()
    for stage, meaning in STAGE_NAMES.items():
        row(
            f"{stage}  {meaning}",
            f"{summary.share[stage]:.1%}",
            f"{paper.percent[stage]} %" if paper else "",
        )
    row("other (arm, bridge)", f"{summary.share['other']:.1%}")
    console.print(table)
    if summary.energies_j is not None:
        console.print(_account(summary.energies_j, summary.residual_of_work))


def _account(energies: dict[str, float], residual_of_work: float | None) -> Table:
    """Return where the work of the blade went; shares are of that work, and add up to 100 %."""
    work = energies["work_of_blade"]
    table = Table(title="where the work of the blade went", title_justify="left", show_header=False)
    table.add_column(style="bold")
    table.add_column(justify="right")
    table.add_column(justify="right")

    def row(label: str, energy: float, share: float | None) -> None:
        shown = "" if share is None else f"{share:.2%}"
        table.add_row(label, f"{energy * _MJ_PER_J:.4f} mJ", shown)

    row("work of the blade", work, 1.0 if work else None)
    table.add_section()
    for term in TERMS:
        if energies[term.name]:
            row(term.label, energies[term.name], energies[term.name] / work if work else None)
    row("not accounted for", energies["residual"], residual_of_work)
    return table


def _piece(piece: dict[str, Any]) -> str:
    """Return the figures of one piece."""
    volume, mass = piece["volume_m3"] * CM3_PER_M3, piece["mass_kg"] * G_PER_KG
    return f"{volume:.3g} cm³, {mass:.3g} g"
