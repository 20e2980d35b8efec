"""The audit of energy: where the work of the blade goes, in strokes of many shapes."""

from typing import NamedTuple

import numpy as np

from scalpel_sim.validate.block import (
    CUT_X,
    DT,
    LENGTH,
    THICKNESS,
    StrokeRecord,
    block_tissue,
    edge_at,
    insertion_and_withdrawal,
    run_stroke,
    soft_material,
    straight_cut,
)
from scalpel_sim.validate.findings import Check, Curve, Findings, Plot, lines_of
from tissue import BladeSegment, BladeShape, Energies, FloatArray

_LINES = lines_of("audit")
_SPEED = 0.05
"""Speed of the blade [m/s]."""
_FRICTION = 0.3
"""Coefficient of friction on the faces of the blade."""
_PLOTTED = ("work_of_blade", "cutting", "friction", "elastic", "damping")
"""Energies that the plots show."""
_MJ_PER_J = 1e3


class AuditStroke(NamedTuple):
    """A stroke, and the toughness of the tissue that it meets."""

    poses: list[BladeSegment]
    toughness: float = 20.0
    """Fracture toughness [J/m2]."""
    skin_toughness: float = 0.0
    """Toughness of the skin [J/m2]."""


def _pressing_poses() -> list[BladeSegment]:
    """Return poses that push the edge 2 mm into the side of the block and withdraw it."""
    y = np.arange(-0.003, 0.002, _SPEED * DT)
    return [edge_at((CUT_X, at, -0.005)) for at in np.concatenate((y, y[::-1]))]


def _slanted_poses() -> list[BladeSegment]:
    """Return poses that lean to the side and drift there by a tenth of the path: side load."""
    y = np.arange(-0.003, LENGTH, _SPEED * DT)
    return [edge_at((0.014 + 0.1 * at, at, -0.005), along=(0.3, 0.0, 1.0)) for at in y]


def _curved_poses() -> list[BladeSegment]:
    """Return poses on an arc of 40 mm radius; the blade faces along it."""
    radius = 0.04
    angle = np.arange(-0.6, 0.6, _SPEED * DT / radius)
    return [
        edge_at(
            (CUT_X - radius * (1.0 - np.cos(a)), 0.5 * LENGTH + radius * np.sin(a), -0.005),
            forward=(-np.sin(a), np.cos(a), 0.0),
        )
        for a in angle
    ]


def audit_strokes(quick: bool) -> dict[str, AuditStroke]:
    """Return the strokes by name; two of them in the short version."""
    depth = 0.6 * THICKNESS
    strokes = {
        "press": AuditStroke(_pressing_poses(), toughness=40.0),
        "puncture": AuditStroke(insertion_and_withdrawal(0.01, depth, _SPEED), skin_toughness=60.0),
        "straight": AuditStroke(straight_cut(_SPEED, end=1.15 * LENGTH)),
        "slanted": AuditStroke(_slanted_poses()),
        "curved": AuditStroke(_curved_poses()),
        "slicing": AuditStroke(straight_cut(_SPEED, ratio=1.0)),
    }
    return {name: strokes[name] for name in ("press", "puncture")} if quick else strokes


def check_residual(name: str, energies: Energies) -> Check:
    """Return the check of the residual of an audit."""
    return _LINES["residual"].check(name, energies.residual / energies.work_of_blade)


def measure_audit(quick: bool) -> Findings:
    """Run every stroke with a bare edge, and with a scalpel that has friction."""
    checks, plots = [], []
    for name, stroke in audit_strokes(quick).items():
        for blade in (None, BladeShape()):
            material = soft_material(
                toughness=stroke.toughness,
                skin_toughness=stroke.skin_toughness,
                blade_friction=_FRICTION,
            )
            record = run_stroke(block_tissue(material, blade=blade, audit=True), stroke.poses)
            tool = "bare edge" if blade is None else f"scalpel, friction {_FRICTION:g}"
            checks.append(check_residual(f"{name}, {tool}", record.energies))
            if blade and name in ("puncture", "slanted"):
                plots.append(_plot(f"Energy of a stroke: {name}, {tool}", record))
    return Findings(checks, plots)


def _plot(title: str, record: StrokeRecord) -> Plot:
    """Return the plot of the energies of a stroke."""
    n = len(record.work)
    time: FloatArray = np.linspace(DT, n * DT, n)
    curves = [
        Curve(
            name.replace("_", " "),
            time,
            record.energy_rows[:, Energies._fields.index(name)] * _MJ_PER_J,
        )
        for name in _PLOTTED
    ]
    return Plot(title, "time [s]", "energy [mJ]", curves)
