"""Symmetry: a blade in the middle of a symmetric body is pushed to no side."""

import numpy as np

from scalpel_sim.validate.block import COARSE, FINE, SIZE, block_tissue, lead, rubber, through
from scalpel_sim.validate.findings import Findings, Known, Line, Scene
from tissue import BladeShape, Law, TetrahedralMesh, block

_LARGEST = 0.05
"""Lateral force over cutting force: the specification's bound."""
_STIFFNESS = 30e3
"""Young's modulus [Pa]. Below 10 kPa, where the edge drags the tissue along by more than 2 mm, the
lips buckle to one side, as a symmetric body may."""
DRIFTS = Known(
    0.0,
    0.3,
    "under law springs the friction of the faces draws the lips to one side, and what the edge "
    "holds sideways does not slip: it adds up along the cut. Without friction, and under law "
    "neo_hookean, it does not",
)
_NEAR = 1e-9
"""Nodes that lie closer together are one [m]; cells are millimetres."""


def mirrored(cells: tuple[int, int, int]) -> TetrahedralMesh:
    """Return the block as two halves that are mirror images across x."""
    half = block((cells[0] // 2, *cells[1:]), (0.5 * SIZE[0], *SIZE[1:]))
    other = half.positions * (-1.0, 1.0, 1.0) + (SIZE[0], 0.0, 0.0)
    rounded = np.round(np.concatenate((half.positions, other)) / _NEAR) * _NEAR
    points, place = np.unique(rounded, axis=0, return_inverse=True)
    turned = half.tetrahedra[:, [1, 0, 2, 3]] + len(half.positions)  # else inside out
    return TetrahedralMesh(points, place.ravel()[np.concatenate((half.tetrahedra, turned))])


def lateral_share(law: Law, cells: tuple[int, int, int], blade: BladeShape | None) -> float:
    """Cut through the middle, and return the mean lateral force over the cutting force."""
    material = rubber(law, young_modulus=_STIFFNESS, blade_friction=0.3)
    tissue = block_tissue(material, mesh=mirrored(cells), blade=blade)
    record = lead(tissue, through(0.1, x=0.5 * SIZE[0]))
    lateral = np.abs(record.of_steady(record.force[:, 0])).mean()
    return float(lateral / record.of_steady(record.resistance).mean())


def measure(quick: bool) -> Findings:
    """Cut mirrored blocks under both laws, with a line and with a scalpel."""
    laws: tuple[Law, ...] = ("neo_hookean", "springs")
    lines = []
    for law in laws:
        for cells in (COARSE,) if quick else (COARSE, FINE):
            for blade in (None,) if quick else (None, BladeShape()):
                kind = "line" if blade is None else "scalpel"
                name = f"{law}, {' × '.join(map(str, cells))} cells, {kind}"
                share = lateral_share(law, cells, blade)
                known = DRIFTS if law == "springs" and blade else None
                name += ": |lateral force| / cutting force"
                lines.append(Line(name, share, 0.0, _LARGEST, known=known))
    return Findings(lines)


SCENE = Scene(
    name="symmetry",
    title="Symmetry",
    about=(
        "A block whose halves are mirror images is cut through its middle. What pushes the blade "
        "to a side there comes from the method and not from the body: the mean of its magnitude "
        "is compared with the cutting force."
    ),
    measure=measure,
)
