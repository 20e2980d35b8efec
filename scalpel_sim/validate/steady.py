"""Steady cutting: the force is toughness times depth, whatever the speed, the mesh and the law."""

import itertools
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from scalpel_sim.validate.block import (
    COARSE,
    FINE,
    MIDDLE,
    THICKNESS,
    Record,
    block_tissue,
    lead,
    rubber,
    through,
)
from scalpel_sim.validate.findings import Curve, Findings, Known, Line, Plot, Scene, Source, within
from tissue import Law, Material

STIFF_ENOUGH = 30e3
"""Young's modulus [Pa] at which tetrahedra bear all three toughnesses on both meshes
(`tissue.input_checks.TOUGHEST`): 60 J/m2 are 2 mm of it, and a node of the finer mesh is 2.4
mm. Springs bear the least of them."""
_NEAR = 0.05
"""How far the force may be off: the issue's bound."""
RIPPLE = 0.10
"""How much it may swing, as its standard deviation over its mean."""
MOST_APART = 0.05
"""How much the two meshes may differ."""
PLACES = ((MIDDLE, 0.05), (0.0187, 0.1), (0.0225, 0.1))
"""Where it is cut, across [m], and how fast [m/s]: between planes of both meshes."""
SPRINGS_GIVE = Known(
    0.75,
    1.0,
    "under law springs, tissue ahead of the edge gives way by itself where it is strained most, "
    "and part of the work goes into its motion and not into area: the force is up to a fifth low "
    "and swings, from 20 J/m² on at this stiffness. Law neo_hookean does not",
)
SPRINGS_APART = SPRINGS_GIVE._replace(low=-0.1, high=0.1)
SPRINGS_SWING = SPRINGS_GIVE._replace(low=0.0, high=0.25)
TOUGH = Known(
    0.92,
    1.08,
    "60 J/m² drag 2 mm of tissue along, nearly a node of the finer mesh: a few percent of the work "
    "go into tissue that gives way by itself",
)


class Steady(NamedTuple):
    """A steady cut in figures."""

    record: Record
    force: float
    """Mean [N]."""
    ripple: float
    """Standard deviation over mean."""


def cut(material: Material, cells: tuple[int, int, int], place: float, speed: float) -> Steady:
    """Cut through the block and return what resisted while it was steady.

    Args:
        material: Of the block.
        cells: Of its mesh.
        place: Where, across [m].
        speed: [m/s].
    """
    record = lead(block_tissue(material, cells), through(speed, x=place))
    force = record.of_steady(record.resistance)
    return Steady(record, float(force.mean()), float(force.std() / force.mean()))


def judge(name: str, measured: Sequence[Steady], law: Law, toughness: float) -> list[Line]:
    """Return the lines of steady cuts of one body of that toughness [J/m2]: the worst of them."""
    shares = [each.force / (toughness * THICKNESS) for each in measured]
    worst = max(shares, key=lambda share: abs(share - 1.0))
    ripple = max(each.ripple for each in measured)
    force_known = SPRINGS_GIVE if law == "springs" else TOUGH if toughness > 20.0 else None
    ripple_known = SPRINGS_SWING if law == "springs" else None
    return [
        Line(f"{name}: force / (toughness × depth)", worst, *within(_NEAR), known=force_known),
        Line(f"{name}: ripple", ripple, 0.0, RIPPLE, known=ripple_known),
    ]


def measure(quick: bool) -> Findings:
    """Cut with three toughnesses, two speeds, two meshes and both laws, in several places."""
    toughnesses = (20.0,) if quick else (5.0, 20.0, 60.0)
    places = PLACES[1:2] if quick else PLACES
    laws: tuple[Law, ...] = ("neo_hookean", "springs")
    lines, curves = [], []
    for law, toughness in itertools.product(laws, toughnesses):
        material = rubber(law, young_modulus=STIFF_ENOUGH, toughness=toughness)
        means = []
        for cells in (COARSE, FINE):
            measured = [cut(material, cells, *place) for place in places]
            means.append(np.mean([each.force for each in measured]))
            name = f"{law}, {toughness:g} J/m², {' × '.join(map(str, cells))} cells"
            lines += judge(name, measured, law, toughness)
            if law == "neo_hookean":
                curves += _curves(measured[0].record, toughness, cells)
        apart = float(means[1] / means[0] - 1.0)
        name = f"{law}, {toughness:g} J/m²: force in the fine over that in the coarse mesh, less 1"
        known = SPRINGS_APART if law == "springs" and toughness > 20.0 else None
        lines.append(Line(name, apart, -MOST_APART, MOST_APART, known=known))
    title = f"Steady cuts through {THICKNESS * 1e3:g} mm of neo-Hookean solid"
    plot = Plot(title, "edge along the block [mm]", "force [N]", curves)
    return Findings(lines, [plot])


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
        "Each figure is the worst of three cuts between the planes of the mesh, at 50 and 100 "
        "mm/s; ripple is the standard deviation over the mean."
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
