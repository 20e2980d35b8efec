"""Liver against published experiments: a blade is inserted, withdrawn, and inserted again."""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

from scalpel_sim.validate.block import StrokeRecord, block_tissue, insertion, run_stroke
from scalpel_sim.validate.findings import Band, Check, Curve, Findings, Plot, lines_of
from tissue import MATERIALS, BladeSegment, BladeShape, Energies, Material, Tissue, block

_LINES = lines_of("liver")
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
    checks = [_LINES["toughness"].check(name, found.toughness / toughness)]
    if friction == 0.0:
        share = found.force / (toughness * 0.5 * (1.0 + found.cut))
        checks.append(_LINES["force"].check(name, share))
    return checks


def check_deep_insertion(force: float, cut: float) -> list[Check]:
    """Return the checks of an insertion so deep that the cut is steady.

    Args:
        force: Force over the length of the edge [N/m].
        cut: Area that was cut, at rest, over what the edge swept.
    """
    name = f"friction 0, {100.0 * _DEEP:g} cm deep"
    return [
        _LINES["deep_area"].check(name, cut),
        _LINES["deep_force"].check(name, force / _LIVER.toughness),
    ]


def _insert_deep() -> list[Check]:
    """Insert a blade without friction until the cut is steady."""
    material = replace(_LIVER, blade_friction=0.0)
    tissue, down = _piece(material, _DEEP_SIZE, _DEEP_CELLS, _DEEP)
    record = run_stroke(tissue, down)
    rows = _between(record, _DEEP_SHARES)
    force = float(record.force[rows, 2].mean() / _EDGE)
    return check_deep_insertion(force, _cut_over_swept(record, rows))


def measure_liver(quick: bool) -> Findings:
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
