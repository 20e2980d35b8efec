"""Liver against published experiments: a blade is inserted, withdrawn, and inserted again."""

from dataclasses import replace
from typing import NamedTuple

from scalpel_sim.validate.block import StrokeRecord, block_tissue, run_stroke
from scalpel_sim.validate.findings import (
    REGRESSION,
    Band,
    Check,
    Curve,
    Findings,
    Plot,
    Reference,
    ValidationScene,
    within,
)
from scalpel_sim.validate.puncturing import insertion
from tissue import MATERIALS, BladeShape, Material, block

_LIVER = MATERIALS["liver"].material
"""As published, and stiffening."""
_SIZE, _CELLS = (0.1, 0.08, 0.05), (10, 8, 5)
"""Sides of the piece of liver [m], and cells along them."""
_EDGE = 0.02
"""Length of edge [m]."""
_DEPTH, _SPEED = 0.035, 0.05
"""Depth of the insertion [m], and speed [m/s]."""
_BESIDE = 3e-3
"""Distance of the cut from a plane of the mesh [m]: a third of a cell."""
_BY_NEEDLES = (158.0, 170.0)
"""Toughness of bovine liver by needles, Gokgol et al. [J/m2]: 164 +- 6."""
_BY_INSERTIONS = (76.0, 186.0)
"""Toughness of pig liver by first and second insertions, Azar and Hayward [J/m2]."""
_BY_BLADES = (187.0, 225.0)
"""Toughness of pig liver by blades, Chanthasopeephan et al. [J/m2]."""
_STEADY_SHARES = (0.55, 0.75)
"""Shares of the insertion between which the first one cuts steadily, and the second one runs in the
cut of the first."""
_FRICTIONS = (0.0, 0.2, 0.4)
"""Coefficients of friction of the blade."""
_NEAR_FORCE, _NEAR_TOUGHNESS = 0.05, 0.10
"""Largest relative errors of the steady force, and of the toughness by two insertions."""


class Insertions(NamedTuple):
    """Two insertions at the same place."""

    first: StrokeRecord
    second: StrokeRecord
    force: float
    """Steady force of the first insertion over the length of the edge [N/m]."""
    toughness: float
    """Difference between the forces of the first and the second insertion at the same depth, over
    the length of the edge [J/m2]: the share of cutting, without friction and bending."""


def _insert_twice(material: Material) -> Insertions:
    """Insert a blade, withdraw it, and insert it again at the same place."""
    mesh = block(_CELLS, _SIZE)
    blade = BladeShape(height=8e-3)
    tissue = block_tissue(material, mesh=mesh, held="left,right,bottom", blade=blade, audit=True)
    middle = (0.5 * _SIZE[0] + _BESIDE, 0.5 * _SIZE[1])
    down = insertion(_EDGE, _DEPTH, _SPEED, middle=middle, top=_SIZE[2])
    first, _, second = (run_stroke(tissue, poses) for poses in (down, down[::-1], down))
    n = len(first.work)
    steady = slice(round(_STEADY_SHARES[0] * n), round(_STEADY_SHARES[1] * n))
    difference = first.force[steady, 2] - second.force[steady, 2]
    return Insertions(
        first,
        second,
        force=float(first.force[steady, 2].mean() / _EDGE),
        toughness=float(difference.mean() / _EDGE),
    )


def check_two_insertions(friction: float, found: Insertions) -> list[Check]:
    """Return the checks of two insertions."""
    name, toughness = f"friction {friction:g}", _LIVER.toughness
    checks = [
        Check(f"{name}: toughness by two insertions / toughness put in",
              found.toughness / toughness, *within(_NEAR_TOUGHNESS), basis=REGRESSION)
    ]  # fmt: skip
    if friction == 0.0:
        share = found.force / toughness
        force = f"{name}: steady force / (toughness × edge)"
        checks.append(Check(force, share, *within(_NEAR_FORCE), basis=REGRESSION))
    return checks


def _measure(quick: bool) -> Findings:
    """Insert twice, without friction and with some."""
    checks, curves = [], []
    for friction in _FRICTIONS[:1] if quick else _FRICTIONS:
        found = _insert_twice(replace(_LIVER, blade_friction=friction))
        checks += check_two_insertions(friction, found)
        for which, record in (("first", found.first), ("second", found.second)):
            depth = (_SIZE[2] - record.tip[:, 2]) * 1e3
            force = record.force[:, 2] / _EDGE
            curves.append(Curve(f"{which} time, friction {friction:g}", depth, force))
    bands = [
        Band("blade, pig: 187 to 225", *_BY_BLADES),
        Band("needles, bovine: 164 ± 6", *_BY_NEEDLES),
        Band("two insertions, pig: 76 to 186", *_BY_INSERTIONS),
    ]
    plot = Plot(
        "A blade of 20 mm into liver",
        "depth of the edge [mm]",
        "force / edge [N/m = J/m²]",
        curves,
        bands,
    )
    return Findings(checks, [plot])


LIVER_SCENE = ValidationScene(
    name="liver",
    title="Force against depth: liver",
    about=(
        "A scalpel with an edge of 20 mm is pushed 35 mm into a piece of liver, withdrawn, and "
        "pushed in again at the same place: the difference of the forces is the share of cutting, "
        "as Azar and Hayward measured it. The material is that of scene incision: Young's modulus "
        "4.74 kPa and toughness 164 J/m² as published, of an exponential law. The toughness comes "
        "back: both lines are regressions. The published ranges in the plot are of other livers "
        "and tools, and were not put in. The force rises with depth until the capsule breaks, and "
        "then stays constant, as in experiments; at the second insertion only the uncut rest and "
        "friction resist. Not reproduced: the saw-tooth of real liver, which loads and unloads by "
        "turns (Chanthasopeephan et al.); a continuum of one toughness has its mean. No published "
        "curve is compared point by point: only figures from texts that could be looked up."
    ),
    measure=_measure,
    references=[
        Reference(
            "Gokgol, Basdogan and Canadinc 2012, doi:10.1016/j.medengphy.2011.09.030",
            "164 ± 6 J/m², 3 bovine livers, needles of 4 diameters",
        ),
        Reference(
            "Azar and Hayward 2008, ISBMS, with the data of Maurin et al.; range after Liu et al. "
            "2022, table 2, doi:10.1186/s10033-022-00767-4",
            "toughness of pig liver from the difference of two insertions at the same place; 76 to "
            "186 J/m²",
        ),
        Reference(
            "Chanthasopeephan, Desai and Lau 2003 and 2006; range after Liu et al. 2022, table 2",
            "pig liver, blade: 187 to 225 J/m²; the force is made of linear loadings and sudden "
            "unloadings, at each of which a crack grows",
        ),
        Reference(
            "Dhar et al., Int. J. Med. Res. Rev. (ijmrr 1395)",
            "Young's modulus of liver in vivo by shear waves, 115 adults: 4.74 ± 0.91 kPa",
        ),
    ],
)
