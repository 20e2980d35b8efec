"""Liver against published experiments: a blade is inserted, withdrawn, and inserted again."""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

from scalpel_sim.validate.block import StrokeRecord, block_tissue, insertion, run_stroke
from scalpel_sim.validate.findings import (
    REGRESSION,
    THEORY,
    Band,
    Check,
    Curve,
    Findings,
    Plot,
    Reference,
    ValidationScene,
    within,
)
from tissue import MATERIALS, BladeSegment, BladeShape, Energies, Material, Tissue, block

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
_LEVEL_SHARES = (0.55, 0.75)
"""Shares of the insertion between which the force of the first one changes little, and the second
one runs in the cut of the first."""
_DEEP_SIZE, _DEEP_CELLS, _DEEP = (0.1, 0.08, 0.15), (10, 8, 15), 0.1
"""Sides of a deeper piece [m], cells along them, and depth of an insertion [m] on which the cut
becomes steady: the dent that the edge made as it entered is made good over some four lengths of the
edge."""
_DEEP_SHARES = (0.7, 0.95)
"""Shares of that insertion between which the cut is steady."""
_FRICTIONS = (0.0, 0.2, 0.4)
"""Coefficients of friction of the blade."""
_NEAR_FORCE, _NEAR_TOUGHNESS = 0.05, 0.10
"""Largest relative errors of the force and the area, and of the toughness by two insertions."""


class Insertions(NamedTuple):
    """Two insertions at the same place."""

    first: StrokeRecord
    second: StrokeRecord
    force: float
    """Force of the first insertion over the length of the edge [N/m]."""
    cut: float
    """Area that it cut, at rest, over what the edge swept."""
    toughness: float
    """Difference between the forces of the first and the second insertion at the same depth, over
    the length of the edge [J/m2]: the share of cutting, without friction and bending."""


class PieceOfLiver(NamedTuple):
    """A piece of liver, and the poses of an edge that goes into it."""

    tissue: Tissue
    """The piece, with an account of its energy."""
    down: list[BladeSegment]
    """The poses."""


def _piece(
    material: Material, size: tuple[float, float, float], cells: Sequence[int], depth: float
) -> PieceOfLiver:
    """Return a piece of liver with sides of `size` [m], and an insertion of that `depth` [m]."""
    mesh, blade = block(cells, size), BladeShape(height=8e-3)
    tissue = block_tissue(material, mesh=mesh, held="left,right,bottom", blade=blade, audit=True)
    middle = (0.5 * size[0] + _BESIDE, 0.5 * size[1])
    return PieceOfLiver(tissue, insertion(_EDGE, depth, _SPEED, middle=middle, top=size[2]))


def _between(record: StrokeRecord, shares: tuple[float, float]) -> slice:
    """Return the rows between two shares of a stroke."""
    n = len(record.work)
    return slice(round(shares[0] * n), round(shares[1] * n))


def _cut_over_swept(record: StrokeRecord, rows: slice) -> float:
    """Return the area cut in these rows, at rest, over that which the edge swept."""
    cutting = record.energy_rows[rows, Energies._fields.index("cutting")]
    swept = _EDGE * (record.tip[rows, 2][0] - record.tip[rows, 2][-1])
    return float((cutting[-1] - cutting[0]) / (_LIVER.toughness * swept))


def _insert_twice(material: Material) -> Insertions:
    """Insert a blade, withdraw it, and insert it again at the same place."""
    tissue, down = _piece(material, _SIZE, _CELLS, _DEPTH)
    first, _, second = (run_stroke(tissue, poses) for poses in (down, down[::-1], down))
    rows = _between(first, _LEVEL_SHARES)
    difference = first.force[rows, 2] - second.force[rows, 2]
    return Insertions(
        first,
        second,
        force=float(first.force[rows, 2].mean() / _EDGE),
        cut=_cut_over_swept(first, rows),
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
        share = found.force / (toughness * 0.5 * (1.0 + found.cut))
        force = f"{name}: force / (toughness × edge × (1 + area cut / area swept) / 2)"
        checks.append(Check(force, share, *within(_NEAR_FORCE), basis=THEORY))
    return checks


def check_deep_insertion(force: float, cut: float) -> list[Check]:
    """Return the checks of an insertion so deep that the cut is steady.

    Args:
        force: Force over the length of the edge [N/m].
        cut: Area that was cut, at rest, over what the edge swept.
    """
    name = f"friction 0, {100.0 * _DEEP:g} cm deep"
    return [
        Check(f"{name}: area cut / area swept", cut, *within(_NEAR_FORCE), basis=THEORY),
        Check(f"{name}: steady force / (toughness × edge)",
              force / _LIVER.toughness, *within(_NEAR_FORCE), basis=REGRESSION),
    ]  # fmt: skip


def _insert_deep() -> list[Check]:
    """Insert a blade without friction until the cut is steady."""
    material = replace(_LIVER, blade_friction=0.0)
    tissue, down = _piece(material, _DEEP_SIZE, _DEEP_CELLS, _DEEP)
    record = run_stroke(tissue, down)
    rows = _between(record, _DEEP_SHARES)
    force = float(record.force[rows, 2].mean() / _EDGE)
    return check_deep_insertion(force, _cut_over_swept(record, rows))


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
    if not quick:
        checks += _insert_deep()
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
        "as Azar and Hayward measured it. The material is the preset's own: Young's modulus "
        "4.74 kPa and toughness 164 J/m² as published, of an exponential law. The toughness comes "
        "back, which is a regression. The published ranges in the plot are of other livers and "
        "tools, and were not put in. The force rises with depth until the capsule breaks, and then "
        "changes little, as in experiments; at the second insertion only the uncut rest and "
        "friction resist. Until some 6 cm deep the cut is not steady: the dent of the entry, where "
        "tissue gives way most, is made good, so that more is cut than the edge sweeps. The energy "
        "stored in the dent pays for half of the surplus and the blade for the other half, if the "
        "tissue is linear. An insertion of 10 cm into a deeper piece cuts what it sweeps, and its "
        "force is toughness × edge. Not reproduced: the saw-tooth of real liver, which loads and "
        "unloads by turns (Chanthasopeephan et al.); a continuum of one toughness has its mean. No "
        "published curve is compared point by point: only figures from texts that could be looked "
        "up."
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
