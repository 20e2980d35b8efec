"""Liver against published experiments: a blade goes in, out, and in again, as experimenters do."""

from dataclasses import replace
from typing import NamedTuple

from scalpel_sim.validate.block import Record, block_tissue, lead
from scalpel_sim.validate.findings import (
    Band,
    Curve,
    Findings,
    Known,
    Line,
    Plot,
    Scene,
    Source,
)
from scalpel_sim.validate.puncturing import into
from tissue import MATERIALS, BladeShape, Material, block

_SIZE, _CELLS = (0.1, 0.08, 0.05), (10, 8, 5)
"""A piece of liver [m]."""
_EDGE = 0.02
"""Length of edge [m]."""
_DEEP, _SPEED = 0.035, 0.05
"""[m], [m/s]."""
_BESIDE = 3e-3
"""How far beside a plane of the mesh it is cut [m]: a third of a cell."""
_STIFFNESS = 15e3
"""Young's modulus [Pa] of liver where it is pressed hard. That of the preset, 4.7 kPa, was measured
with waves of small strain: with it the blade would dent the tissue by J / E = 35 mm, more than a
liver is thick, before it cuts. The steady force does not depend on it."""
NEEDLE = (158.0, 170.0)
"""Gokgol et al.: 164 +- 6 J/m2, bovine, needles."""
TWICE = (76.0, 186.0)
"""Azar and Hayward: pig, from first and second insertions [J/m2]."""
BLADE = (187.0, 225.0)
"""Chanthasopeephan et al.: pig, blade [J/m2]."""
BETWEEN = (0.55, 0.75)
"""Share of the way in between which the first insertion cuts steadily, and the second is in what
the first has cut."""
GIVES = Known(
    148.0,
    170.0,
    "tissue that is dragged along by J / E = 11 mm, 1.5 nodes of this mesh, gives way by itself in "
    "places, and a few percent of the work go into its motion",
)
_LOWER = Known(
    148.0,
    187.0,
    "the toughness here is that of needles in bovine liver; what was measured with blades in pig "
    "liver is 14 to 37 % more, which includes the friction of the faces, the other animal, and the "
    "capsule, none of which was measured apart",
)


class Insertions(NamedTuple):
    """What was felt on the way in, twice at the same place."""

    first: Record
    second: Record
    force: float
    """Steady force over length of edge, first time [N/m]."""
    toughness: float
    """Force of the first time less that of the second at the same depth, over length of edge: what
    cutting took, without friction and what only bends [J/m2]."""


def liver(friction: float) -> Material:
    """Return the liver of the presets, as stiff as where it is pressed hard."""
    material = MATERIALS["liver"].material
    return replace(material, young_modulus=_STIFFNESS, blade_friction=friction)


def insert_twice(material: Material) -> Insertions:
    """Push a blade in, draw it out, and push it in again: what cutting took is the difference."""
    mesh = block(_CELLS, _SIZE)
    blade = BladeShape(height=8e-3)
    tissue = block_tissue(material, mesh=mesh, held="left,right,bottom", blade=blade, audit=True)
    middle = (0.5 * _SIZE[0] + _BESIDE, 0.5 * _SIZE[1])
    down = into(_EDGE, _DEEP, _SPEED, middle=middle, top=_SIZE[2])
    first, _, second = (lead(tissue, way) for way in (down, down[::-1], down))
    n = len(first.work)
    steady = slice(round(BETWEEN[0] * n), round(BETWEEN[1] * n))
    less = first.force[steady, 2] - second.force[steady, 2]
    return Insertions(
        first,
        second,
        force=float(first.force[steady, 2].mean() / _EDGE),
        toughness=float(less.mean() / _EDGE),
    )


def _judge(friction: float, found: Insertions) -> list[Line]:
    """Return the lines of two insertions."""
    name = f"friction {friction:g}"
    return [
        Line(f"{name}: steady force / edge against toughness by needles, bovine", found.force,
             *NEEDLE, unit="N/m", known=GIVES),
        Line(f"{name}: toughness by first less second insertion, against the same of pigs",
             found.toughness, *TWICE, unit="J/m²"),
        Line(f"{name}: steady force / edge against that of blades, pig", found.force, *BLADE,
             unit="N/m", known=_LOWER),
    ]  # fmt: skip


def measure(quick: bool) -> Findings:
    """Insert twice, without friction and with some."""
    lines, curves = [], []
    for friction in (0.0,) if quick else (0.0, 0.2):
        found = insert_twice(liver(friction))
        lines += _judge(friction, found)
        for which, record in (("first", found.first), ("second", found.second)):
            depth = (_SIZE[2] - record.tip[:, 2]) * 1e3
            force = record.force[:, 2] / _EDGE
            curves.append(Curve(f"{which} time, friction {friction:g}", depth, force))
    bands = [
        Band("blade, pig: 187 to 225", *BLADE),
        Band("needles, bovine: 164 ± 6", *NEEDLE),
        Band("two insertions, pig: 76 to 186", *TWICE),
    ]
    plot = Plot(
        "A blade of 20 mm into liver",
        "depth of the edge [mm]",
        "force / edge [N/m = J/m²]",
        curves,
        bands,
    )
    return Findings(lines, [plot])


SCENE = Scene(
    name="liver",
    title="Force against depth: liver",
    about=(
        "A scalpel with an edge of 20 mm is pushed 35 mm into a piece of liver, drawn out, and "
        "pushed in again at the same place: the difference of the forces is what cutting took, as "
        "Azar and Hayward measured it. The toughness is that of Gokgol et al. for bovine "
        "liver and nothing is fitted. The force rises with depth until the capsule parts, and then "
        "stays, as in experiments; the second time only the uncut rest and friction resist. "
        "Not reproduced: the saw-tooth of real liver, which loads and lets go by turns "
        "(Chanthasopeephan et al.); a continuum of one toughness has its mean, and the "
        "dips here are those of the mesh, where the blade goes from element to element. There "
        "is no published curve here point by point: only figures of texts that could be looked up "
        "are compared."
    ),
    measure=measure,
    sources=[
        Source(
            "Gokgol, Basdogan and Canadinc 2012, doi:10.1016/j.medengphy.2011.09.030",
            "164 ± 6 J/m², 3 bovine livers, needles of 4 diameters",
        ),
        Source(
            "Azar and Hayward 2008, ISBMS, with the data of Maurin et al.; range after Liu et al. "
            "2022, table 2, doi:10.1186/s10033-022-00767-4",
            "toughness of pig liver from the difference of two insertions at the same place; 76 to "
            "186 J/m²",
        ),
        Source(
            "Chanthasopeephan, Desai and Lau 2003 and 2006; range after Liu et al. 2022, table 2",
            "pig liver, blade: 187 to 225 J/m²; the force is made of linear loadings and sudden "
            "unloadings, at each of which a crack grows",
        ),
        Source(
            "Samur et al. 2007, doi:10.1016/j.media.2007.04.001",
            "an effective Young's modulus of pig liver under an indenter of 10 to 15 kPa",
            is_confirmed=False,
        ),
    ],
)
