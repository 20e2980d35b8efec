"""Steady cutting: the force is toughness times depth, whatever the speed, the mesh and the law."""

import itertools
from typing import NamedTuple

import numpy as np

from scalpel_sim.validate.block import (
    COARSE,
    FINE,
    THICKNESS,
    Record,
    block,
    lead,
    rubber,
    through,
)
from scalpel_sim.validate.findings import Curve, Findings, Line, Plot, Scene, Source, within
from tissue.material import Law, Material

STIFF_ENOUGH = 30e3
"""Young's modulus [Pa] at which all three toughnesses are within what both laws bear on both meshes
(`tissue.caveats.TOUGHEST`): 60 J/m2 are 2 mm of it, and a node of the finer mesh is 2.4 mm."""
NEAR = 0.05
"""How far the force may be off: the issue's bound."""
RIPPLE = 0.10
"""How much it may swing, as its standard deviation over its mean."""
MOST_APART = 0.05
"""How much the two meshes may differ."""


class Steady(NamedTuple):
    """A steady cut in figures."""

    record: Record
    force: float
    """Mean [N]."""
    ripple: float
    """Standard deviation over mean."""


def cut(material: Material, cells: tuple[int, int, int], speed: float) -> Steady:
    """Cut through the block and return what resisted while it was steady."""
    record = lead(block(material, cells), through(speed))
    force = record.of_steady(record.resistance)
    return Steady(record, float(force.mean()), float(force.std() / force.mean()))


def judge(name: str, measured: Steady, toughness: float) -> list[Line]:
    """Return the lines of a steady cut through a body of that toughness [J/m2]."""
    theory = toughness * THICKNESS
    return [
        Line(f"{name}: force / (toughness × depth)", measured.force / theory, *within(NEAR)),
        Line(f"{name}: ripple", measured.ripple, 0.0, RIPPLE),
    ]


def measure(quick: bool) -> Findings:
    """Cut with three toughnesses, two speeds, two meshes and both laws."""
    toughnesses = (20.0,) if quick else (5.0, 20.0, 60.0)
    speeds = (0.1,) if quick else (0.05, 0.1)
    laws: tuple[Law, ...] = ("neo_hookean", "springs")
    lines, curves = [], []
    for law, toughness, speed in itertools.product(laws, toughnesses, speeds):
        material = rubber(law, young_modulus=STIFF_ENOUGH, toughness=toughness)
        forces = []
        for cells in (COARSE, FINE):
            measured = cut(material, cells, speed)
            forces.append(measured.force)
            lines += judge(_name(law, toughness, speed, cells), measured, toughness)
            if law == "neo_hookean" and speed == speeds[0]:
                curves += _curves(measured.record, toughness, cells)
        apart = forces[1] / forces[0] - 1.0
        name = f"{law}, {toughness:g} J/m², {speed * 1e3:g} mm/s: fine over coarse mesh, less 1"
        lines.append(Line(name, apart, -MOST_APART, MOST_APART))
    title = f"Steady cut through {THICKNESS * 1e3:g} mm"
    plot = Plot(title, "edge along the block [mm]", "force [N]", curves)
    return Findings(lines, [plot])


def _name(law: str, toughness: float, speed: float, cells: tuple[int, int, int]) -> str:
    count = " × ".join(map(str, cells))
    return f"{law}, {toughness:g} J/m², {speed * 1e3:g} mm/s, {count} cells"


def _curves(record: Record, toughness: float, cells: tuple[int, int, int]) -> list[Curve]:
    name = f"{toughness:g} J/m², {' × '.join(map(str, cells))} cells"
    x = record.y * 1e3
    curve = Curve(name, x, record.resistance)
    if cells == COARSE:
        return [curve]
    theory = np.full(2, toughness * THICKNESS)
    return [curve, Curve("", x[[0, -1]], theory, is_theory=True)]


SCENE = Scene(
    name="steady",
    title="Steady cutting force",
    about=(
        "An upright edge is led through a block that is held left and right, and the mean force "
        "while it is in with its whole length is compared with toughness × depth: all work goes "
        "into area. It must depend on neither speed nor mesh, else a policy learns the mesh. "
        "Ripple is the standard deviation over the mean."
    ),
    measure=measure,
    sources=[
        Source(
            "Mahvash and Hayward 2001, Haptics-e 2(3)",
            "work of the tool = toughness × area + change of elastic energy; in steady cutting the "
            "force is toughness × width, whatever the stiffness",
            is_confirmed=False,
        )
    ],
)
