"""Compares materials by name with measured curves that none of their figures was fitted to."""

import itertools
import tomllib
from functools import cache
from pathlib import Path
from typing import Literal

import msgspec
import numpy as np

from scalpel_sim.validate.findings import (
    PUBLISHED,
    Check,
    Curve,
    Findings,
    KnownDeviation,
    Plot,
)
from scalpel_sim.validate.measured.homogeneous import (
    shear_moduli,
    stress_along,
    stretches_with_free_sides,
)
from tissue import MATERIALS, FloatArray

_CURVES = Path(__file__).with_name("curves.toml")


class Study(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A measurement of one or more curves."""

    spread: str
    """Kind of the spread: of specimens, of directions, or assumed."""
    source: str
    """Where the points come from."""
    why: str
    """Physical reason why the material deviates."""


class MeasuredCurve(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Measured points of a tissue, and the material by name that is held against them."""

    study: str
    """Name of the study."""
    material: str
    """Name of the material."""
    title: str
    """Measured quantity and its rate."""
    quantity: Literal["stress", "shear modulus"]
    """Cauchy's stress along the first axis, or the modulus of a small shear."""
    along: list[float]
    """Stretch along the first axis, a number for each point."""
    across: list[float] | None = None
    """Stretch along the second axis; None where its sides are free."""
    measured: list[float]
    """The quantity [kPa]."""
    lowest: list[float]
    """One end of its spread [kPa]."""
    highest: list[float]
    """The other end [kPa]."""
    known: list[float] | None = None
    """Ratio of material and measurement at the first and the last point, where it deviates."""


class MeasuredCurves(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The content of the file."""

    studies: dict[str, Study]
    curves: dict[str, MeasuredCurve]

    def study_of(self, curve: MeasuredCurve) -> Study:
        """Return what was read of the measurement of a curve."""
        return self.studies[curve.study]


@cache
def measured_curves() -> MeasuredCurves:
    """Return the measured curves, and the studies that they are of."""
    content = tomllib.loads(_CURVES.read_text(encoding="utf-8"))
    return msgspec.convert(content, MeasuredCurves)


@cache
def _simulated(
    material: str, quantity: str, along: tuple[float, ...], across: tuple[float, ...] | None
) -> FloatArray:
    """Return the quantity of a material at each point [kPa], shape (n,)."""
    which = MATERIALS[material].material
    if quantity == "shear modulus":
        return shear_moduli(which, along) * 1e-3
    pairs = zip(along, itertools.repeat(None) if across is None else across, strict=False)
    paths = [stretches_with_free_sides(which, *pair) for pair in pairs]
    found: FloatArray = stress_along(which, paths)[:, 0] * 1e-3
    return found


def simulate(curve: MeasuredCurve) -> FloatArray:
    """Return what the material of a curve has at its points [kPa], shape (n,)."""
    across = None if curve.across is None else tuple(curve.across)
    return _simulated(curve.material, curve.quantity, tuple(curve.along), across)


def check_curve(curve: MeasuredCurve, simulated: FloatArray) -> list[Check]:
    """Return the checks of the first and the last point of a curve, one where it has one.

    Args:
        curve: What was measured.
        simulated: The quantity at its points [kPa], shape (n,).
    """
    checks, why = [], measured_curves().study_of(curve).why
    for which in sorted({0, len(curve.along) - 1}):
        measured = curve.measured[which]
        low, high = sorted(end[which] / measured for end in (curve.lowest, curve.highest))
        known = KnownDeviation(curve.known[min(which, 1)], why) if curve.known else None
        checks.append(
            Check(
                f"{curve.material}: {curve.title}, at {curve.along[which]:g} of its length: "
                f"{curve.quantity} / measured",
                float(simulated[which]) / measured,
                low,
                high,
                basis=PUBLISHED,
                known=known,
            )
        )
    return checks


def measure_tissue_curves(quick: bool) -> Findings:
    """Hold each material against its measured curves."""
    content = measured_curves()
    curves = list(content.curves.values())
    found = [(curve, simulate(curve)) for curve in (curves[:1] if quick else curves)]
    checks = [check for curve, values in found for check in check_curve(curve, values)]
    used = dict.fromkeys(curve.study for curve, _ in found)
    notes = [
        f"{each.source}. Spread: {each.spread}" for each in map(content.studies.__getitem__, used)
    ]
    plots = [
        _plot(name, [pair for pair in found if pair[0].material == name])
        for name in dict.fromkeys(
            curve.material for curve, _ in found if curve.quantity == "stress"
        )
    ]
    return Findings(checks, plots, notes)


def _plot(name: str, found: list[tuple[MeasuredCurve, FloatArray]]) -> Plot:
    """Return the plot of the stresses of one material, simulated over measured."""
    lines = [
        Curve(curve.title, np.array(curve.along), values / np.array(curve.measured))
        for curve, values in found
        if curve.quantity == "stress"
    ]
    return Plot(
        f"{name}: stress of the material over what was measured",
        "length / length at rest",
        "simulated / measured",
        lines,
    )
