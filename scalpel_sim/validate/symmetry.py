"""Symmetry: there is no lateral force on a blade in the middle of a symmetric body."""

import numpy as np

from scalpel_sim.validate.block import (
    BLOCK_SIZE,
    COARSE_CELLS,
    FINE_CELLS,
    block_tissue,
    run_stroke,
    soft_material,
    straight_cut,
)
from scalpel_sim.validate.findings import Findings, lines_of
from tissue import BladeShape, TetrahedralMesh, block

_LINES = lines_of("symmetry")
_STIFFNESS = 30e3
"""Young's modulus [Pa]. Below 10 kPa, where the edge drags the tissue along by more than 2 mm, the
cut faces buckle to one side, as those of a symmetric body may."""
_NEAR = 1e-9
"""Nodes closer together than this are merged [m]; cells are millimetres wide."""


def mirrored_block(cells: tuple[int, int, int]) -> TetrahedralMesh:
    """Return the block as two halves that are mirror images across x."""
    half = block((cells[0] // 2, *cells[1:]), (0.5 * BLOCK_SIZE[0], *BLOCK_SIZE[1:]))
    other = half.positions * (-1.0, 1.0, 1.0) + (BLOCK_SIZE[0], 0.0, 0.0)
    rounded = np.round(np.concatenate((half.positions, other)) / _NEAR) * _NEAR
    points, place = np.unique(rounded, axis=0, return_inverse=True)
    turned = half.tetrahedra[:, [1, 0, 2, 3]] + len(half.positions)  # else inside out
    return TetrahedralMesh(points, place.ravel()[np.concatenate((half.tetrahedra, turned))])


def _lateral_share(law: str, cells: tuple[int, int, int], blade: BladeShape | None) -> float:
    """Cut through the middle; return the mean lateral force over the mean cutting force."""
    material = soft_material(law, young_modulus=_STIFFNESS, blade_friction=0.3)
    tissue = block_tissue(material, mesh=mirrored_block(cells), blade=blade)
    record = run_stroke(tissue, straight_cut(0.1, x=0.5 * BLOCK_SIZE[0]))
    lateral = np.abs(record.steady_rows(record.force[:, 0])).mean()
    return float(lateral / record.steady_resistance)


def measure_symmetry(quick: bool) -> Findings:
    """Cut mirrored blocks under both laws, with a bare edge and with a scalpel."""
    laws: tuple[str, ...] = ("neo_hookean", "springs")
    checks = []
    for law in laws:
        for cells in (COARSE_CELLS,) if quick else (COARSE_CELLS, FINE_CELLS):
            for blade in (None,) if quick else (None, BladeShape()):
                tool = "bare edge" if blade is None else "scalpel"
                name = f"{law}, {' × '.join(map(str, cells))} cells, {tool}"
                share = _lateral_share(law, cells, blade)
                checks.append(_LINES["lateral"].check(name, share))
    return Findings(checks)
