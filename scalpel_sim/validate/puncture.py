"""Puncture and withdrawal: rise, peak, drop and plateau of the force; then friction alone."""

from typing import NamedTuple

from scalpel_sim.validate.block import (
    COARSE_CELLS,
    FINE_CELLS,
    THICKNESS,
    StrokeRecord,
    block_tissue,
    insertion_and_withdrawal,
    run_stroke,
    soft_material,
)
from scalpel_sim.validate.findings import Check, Curve, Findings, Plot, lines_of
from tissue import BladeShape, Energies

_LINES = lines_of("puncture")
_NARROW = 0.001
"""Length of an edge that breaks in all at once [m]: shorter than an element."""
_WIDE = 0.02
"""Length of an edge with faces large enough for friction [m]."""
_DEPTH, _SPEED = 0.012, 0.05
"""Depth of the insertion [m], and speed [m/s]."""
_TOUGHNESS = 20.0
"""Toughness below the skin [J/m2]."""
_FRICTION = 0.2
"""Coefficient of friction on the faces of the blade."""


class InsertionForces(NamedTuple):
    """The forces of an insertion."""

    record: StrokeRecord
    peak: float
    """Largest force [N]."""
    plateau: float
    """Mean force on the second half of the insertion [N]."""
    after_peak: float
    """Force 10 steps after the peak [N]."""
    area_before: float
    """Area cut until 2 steps before the peak [m2]."""


class WithdrawalForces(NamedTuple):
    """A withdrawal, from where the faces slide all along to where the blade is nearly out."""

    resistance: float
    """Mean force against the withdrawal [N]."""
    area: float
    """Area cut during the withdrawal [m2]."""
    excess_work: float
    """Work of the blade less friction and the energy that the tissue stored and damped, over the
    work of friction."""


def _puncture(length: float, skin: float, cells: tuple[int, int, int] = FINE_CELLS) -> StrokeRecord:
    """Insert and withdraw an edge.

    Args:
        length: Length of the edge [m].
        skin: Toughness of the skin over that of the tissue below.
        cells: Cells of the block.
    """
    material = soft_material(
        toughness=_TOUGHNESS, skin_toughness=skin * _TOUGHNESS, blade_friction=_FRICTION
    )
    tissue = block_tissue(material, cells, held="left,right,bottom", blade=BladeShape(), audit=True)
    return run_stroke(tissue, insertion_and_withdrawal(length, _DEPTH, _SPEED))


def _insertion_forces(record: StrokeRecord) -> InsertionForces:
    """Return the forces of the insertion."""
    n = len(record.work) // 2
    force = record.force[:, 2]
    peak = int(force[:n].argmax())
    cutting = record.energy_rows[max(peak - 2, 0), Energies._fields.index("cutting")]
    return InsertionForces(
        record,
        peak=float(force[peak]),
        plateau=float(force[n // 2 : n].mean()),
        after_peak=float(force[peak + 10]),
        area_before=float(cutting / _TOUGHNESS),
    )


def _withdrawal_forces(record: StrokeRecord) -> WithdrawalForces:
    """Return the forces of the withdrawal."""
    n = len(record.work) // 2
    first, last = n + round(0.2 * n), n + round(0.7 * n)
    spent = Energies(*(record.energy_rows[last] - record.energy_rows[first]))
    stored = spent.elastic + spent.kinetic + spent.held + spent.damping
    return WithdrawalForces(
        resistance=float(-record.force[first:last, 2].mean()),
        area=float(record.area[-1] - record.area[n - 1]),
        excess_work=(spent.work_of_blade - stored - spent.friction) / spent.friction,
    )


def check_insertion(name: str, found: InsertionForces, expected: float) -> list[Check]:
    """Return the checks of an insertion.

    Args:
        name: Name of the puncture.
        found: Its forces.
        expected: Peak by theory [N].
    """
    return [
        _LINES["peak"].check(name, found.peak / expected),
        _LINES["early_area"].check(name, found.area_before * 1e6),
        _LINES["plateau"].check(name, found.plateau / found.peak),
    ]


def check_withdrawal(name: str, found: WithdrawalForces, plateau: float) -> list[Check]:
    """Return the checks of a withdrawal; `plateau` is the force of the insertion [N]."""
    return [
        _LINES["withdrawal"].check(name, found.resistance, high=plateau),
        _LINES["late_area"].check(name, found.area * 1e6),
        _LINES["excess_work"].check(name, found.excess_work),
    ]


def measure_puncture(quick: bool) -> Findings:
    """Puncture skins of several toughnesses with a narrow edge, and one with a wide edge."""
    checks: list[Check] = []
    curves = []
    for skin in (3.0,) if quick else (1.5, 2.0, 3.0):
        name = f"edge of {_NARROW * 1e3:g} mm, skin × {skin:g}"
        found = _insertion_forces(_puncture(_NARROW, skin))
        checks += check_insertion(name, found, skin * _TOUGHNESS * _NARROW)
        if skin == 3.0:
            checks.append(_LINES["drop"].check(name, found.after_peak / found.peak))
        curves.append(_curve(name, found.record, _NARROW))
    name = f"edge of {_WIDE * 1e3:g} mm, skin × 1.5"
    record = _puncture(_WIDE, 1.5, COARSE_CELLS if quick else FINE_CELLS)
    found = _insertion_forces(record)
    if not quick:
        share = found.peak / (1.5 * _TOUGHNESS * _WIDE)
        checks.append(_LINES["wide_peak"].check(name, share))
    checks += check_withdrawal(name, _withdrawal_forces(record), found.plateau)
    curves.append(_curve(name, record, _WIDE))
    plot = Plot(
        "Puncture and withdrawal",
        "depth of the edge [mm]",
        "force upwards / (toughness × edge)",
        curves,
    )
    return Findings(checks, [plot])


def _curve(name: str, record: StrokeRecord, length: float) -> Curve:
    """Return the curve of force over depth."""
    depth = (THICKNESS - record.tip[:, 2]) * 1e3
    return Curve(name, depth, record.force[:, 2] / (_TOUGHNESS * length))
