"""Table 1 of Bielser, Maiwald and Gross (1998), as printed."""

from typing import NamedTuple

MACHINE = "SGI Indigo 2, R10000, 180 MHz"


class PaperRow(NamedTuple):
    """One row of Table 1. The frame rate is averaged over the cut."""

    tetrahedra_initial: int
    tetrahedra_final: int
    frame_rate: float
    percent: dict[str, float]
    """Share of each stage [%]: RX relaxation, RD rendering, GC geometric changes, CD collision
    detection."""


TABLE_1 = {
    (2, 2, 2): PaperRow(48, 354, 3.78, {"RX": 82.1, "RD": 11.4, "GC": 1.7, "CD": 0.3}),
    (2, 4, 3): PaperRow(144, 960, 2.24, {"RX": 88.9, "RD": 7.8, "GC": 0.4, "CD": 0.4}),
    (4, 6, 4): PaperRow(576, 2446, 1.14, {"RX": 92.2, "RD": 4.9, "GC": 0.1, "CD": 0.5}),
}
"""Rows of Table 1, by the number of cells along x, y and z."""
