"""The table that a run prints, with the paper's figures beside ours where it has them."""

from typing import Any, NamedTuple

from rich.console import Console
from rich.table import Table

from scalpel_sim.summary import COMPLETE, STAGES, Summary

STAGE_NAMES = dict(
    zip(STAGES, ("relaxation", "pictures", "topology, geometry", "collision"), strict=True)
)

MOST_PIECES = 8
"""Pieces that the table has rows for, the largest; `summary.json` has them all."""

G_PER_KG = 1e3
CM3_PER_M3 = 1e6
MM2_PER_M2 = 1e6
MJ_PER_J = 1e3


class PaperRow(NamedTuple):
    """A row of Table 1 of Bielser, Maiwald and Gross (1998), measured on an SGI Indigo 2."""

    tetrahedra_initial: int
    tetrahedra_final: int
    frame_rate: float
    percent: dict[str, float]


TABLE_1 = {
    "grid2": PaperRow(48, 354, 3.78, {"RX": 82.1, "RD": 11.4, "GC": 1.7, "CD": 0.3}),
    "slab": PaperRow(576, 2446, 1.14, {"RX": 92.2, "RD": 4.9, "GC": 0.1, "CD": 0.5}),
}
"""By scene. The paper has no such figures for the other bodies."""


def print_table(summary: Summary, console: Console) -> None:
    """Print the figures of a run as a table."""
    paper = TABLE_1.get(summary.scene)
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
        row(f"  piece {number}, {'held' if piece['held'] else 'loose'}", _piece(piece))
    row("cut area", f"{summary.cut_area_m2 * MM2_PER_M2:,.0f} mm²")
    row("peak force", f"{summary.force_peak_n:.3f} N")
    row("mean force", f"{summary.force_mean_n:.3f} N")
    row("work of the blade", f"{summary.work_of_blade_j * MJ_PER_J:.2f} mJ")
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


def _piece(piece: dict[str, Any]) -> str:
    """Return the figures of one piece."""
    volume, mass = piece["volume_m3"] * CM3_PER_M3, piece["mass_kg"] * G_PER_KG
    return f"{piece['tetrahedra']:,} tetrahedra, {volume:.3g} cm³, {mass:.3g} g"
