"""The account of energy: where the work of the blade goes, in every kind of stroke."""

from typing import NamedTuple

import numpy as np

from scalpel_sim.validate.block import (
    DT,
    LENGTH,
    MIDDLE,
    THICKNESS,
    Record,
    block_tissue,
    edge,
    lead,
    rubber,
    through,
)
from scalpel_sim.validate.findings import Curve, Findings, Line, Plot, Scene
from scalpel_sim.validate.puncturing import in_and_out
from tissue import BladeSegment, BladeShape, Energies, FloatArray

LARGEST_RESIDUAL = 0.005
"""Of the blade's work: the issue's bound."""
_SPEED = 0.05
"""[m/s]."""
_FRICTION = 0.3
SHOWN = ("work_of_blade", "cutting", "friction", "elastic", "damping")
"""What the plots show of the account."""
_MJ_PER_J = 1e3


class _Stroke(NamedTuple):
    """A way of the blade, and what it meets."""

    places: list[BladeSegment]
    toughness: float = 20.0
    """[J/m2]."""
    skin: float = 0.0
    """Toughness of the skin [J/m2]."""


def _press() -> list[BladeSegment]:
    """Push the edge 2 mm into the side of the block, and let go."""
    y = np.arange(-0.003, 0.002, _SPEED * DT)
    return [edge((MIDDLE, at, -0.005)) for at in np.concatenate((y, y[::-1]))]


def slanted() -> list[BladeSegment]:
    """A blade that leans to the side and drifts there by a tenth of its way: side load."""
    y = np.arange(-0.003, LENGTH, _SPEED * DT)
    return [edge((0.014 + 0.1 * at, at, -0.005), along=(0.3, 0.0, 1.0)) for at in y]


def curved() -> list[BladeSegment]:
    """An arc of 40 mm radius; the blade faces along it."""
    radius = 0.04
    angle = np.arange(-0.6, 0.6, _SPEED * DT / radius)
    return [
        edge(
            (MIDDLE - radius * (1.0 - np.cos(a)), 0.5 * LENGTH + radius * np.sin(a), -0.005),
            forward=(-np.sin(a), np.cos(a), 0.0),
        )
        for a in angle
    ]


def strokes(quick: bool) -> dict[str, _Stroke]:
    """Return the strokes by name."""
    deep = 0.6 * THICKNESS
    chosen = {
        "press": _Stroke(_press(), toughness=40.0),
        "puncture": _Stroke(in_and_out(0.01, deep, _SPEED), skin=60.0),
        "straight": _Stroke(through(_SPEED, end=1.15 * LENGTH)),
        "slanted": _Stroke(slanted()),
        "curved": _Stroke(curved()),
        "slicing": _Stroke(through(_SPEED, ratio=1.0)),
    }
    return {name: chosen[name] for name in ("press", "puncture")} if quick else chosen


def judge(name: str, energies: Energies) -> Line:
    """Return the line of an account."""
    share = energies.residual / energies.work_of_blade
    return Line(f"{name}: residual / work of the blade", share, -LARGEST_RESIDUAL, LARGEST_RESIDUAL)


def measure(quick: bool) -> Findings:
    """Do every stroke with a line that cuts, and with a scalpel that rubs."""
    lines, plots = [], []
    for name, stroke in strokes(quick).items():
        for blade in (None, BladeShape()):
            material = rubber(
                toughness=stroke.toughness, skin_toughness=stroke.skin, blade_friction=_FRICTION
            )
            record = lead(block_tissue(material, blade=blade, audit=True), stroke.places)
            kind = "line" if blade is None else f"scalpel, friction {_FRICTION:g}"
            lines.append(judge(f"{name}, {kind}", record.energies))
            if blade and name in ("puncture", "slanted"):
                plots.append(_plot(f"Energy of a stroke: {name}, {kind}", record))
    return Findings(lines, plots)


def _plot(title: str, record: Record) -> Plot:
    n = len(record.work)
    time: FloatArray = np.linspace(DT, n * DT, n)
    curves = [
        Curve(
            name.replace("_", " "),
            time,
            record.accounts[:, Energies._fields.index(name)] * _MJ_PER_J,
        )
        for name in SHOWN
    ]
    return Plot(title, "time [s]", "energy [mJ]", curves)


SCENE = Scene(
    name="audit",
    title="Audit of energy",
    about=(
        "The work of the blade, force times way, is compared with where it went: change of "
        "elastic and kinetic energy, toughness × area, breaking the skin, friction, damping, "
        "contact, changes of the mesh. Each is counted by itself where it happens; what is left "
        "over is the error of the motion. A force that does not close the account is made up."
    ),
    measure=measure,
)
