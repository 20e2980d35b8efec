"""The back of a blade, pressed into skin, against a rigid strip of its size in a fine mesh."""

from typing import NamedTuple

import numpy as np

from scalpel_sim.validate.block import DT, block_tissue, edge_at, run_stroke
from scalpel_sim.validate.findings import Check, Curve, Findings, Plot, lines_of
from tissue import BladeShape, FloatArray, Material, TetrahedralMesh, Tissue, block

_LINES = lines_of("spine")
_SIZE = (0.06, 0.06, 0.03)
"""Sides of the block [m]; its bottom is held."""
_MATERIAL = Material(10e3, toughness=20.0, viscous_damping=50.0)
_EDGE, _THICKNESSES = 0.02, (0.4e-3, 1e-3)
"""Length of the blade [m], and how thick blades are [m]."""
_DEPTH, _SPEED = 2e-3, 0.05
"""Depth to which the back is pressed [m], and speed [m/s]."""
_ABOVE = 0.5e-3
"""Height of the back above the skin at the begin [m]."""
_CELLS = ((12, 12, 6), (20, 20, 10))
"""Cells along the sides of the block."""
_BESIDE = (1.1e-3, 0.7e-3)
"""Middle of the back from that of the block [m], so that it lies along no plane of the mesh."""
_GROWTH, _CELLS_ALONG = 1.4, 48
"""Growth of the cells of the reference from the strip on, and its cells along the strip."""


class Dent(NamedTuple):
    """A back that is pressed into a block and held."""

    depth: FloatArray
    """Depth of the back [m]."""
    force: FloatArray
    """Force on the blade, upwards [N]."""
    held: float
    """Force at the end [N]."""
    cut_area: float
    """Area that was cut [m2]."""


def dent(thickness: float, cells: tuple[int, int, int], frames_held: int = 100) -> Dent:
    """Press the back of a blade of that thickness [m] into a block, and hold it.

    Args:
        thickness: Thickness of the blade [m].
        cells: Cells along the sides of the block.
        frames_held: Frames that it is held for at the end.
    """
    shape = BladeShape(thickness=thickness)
    tissue = block_tissue(_MATERIAL, mesh=block(cells, _SIZE), held="bottom", blade=shape)
    x, y = 0.5 * _SIZE[0] + _BESIDE[0], 0.5 * (_SIZE[1] - _EDGE) + _BESIDE[1]
    n = round((_DEPTH + _ABOVE) / _SPEED / DT)
    depths = np.append(np.linspace(-_ABOVE, _DEPTH, n + 1), np.full(frames_held, _DEPTH))
    heights = _SIZE[2] - depths + shape.height
    along, forward = (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
    stroke = run_stroke(
        tissue, [edge_at((x, y, z), along=along, forward=forward, length=_EDGE) for z in heights]
    )
    held = float(stroke.last.wrench_t1.force[2])
    return Dent(depths[1:], stroke.force[:, 2], held, stroke.last.cut_area)


def strip_force(thickness: float) -> float:
    """Return the force of a rigid strip of that width [m], stuck to the skin, as deep as the back.

    Its nodes are moved down as supports, in a mesh that is fine near the strip; no blade takes
    part.
    """
    xs, zs = _places_around(0.5 * thickness), _SIZE[2] - _places_from(0.5 * thickness, _SIZE[2])
    ys = np.linspace(0.0, _SIZE[1], _CELLS_ALONG + 1)
    axes = (xs, ys, zs[::-1])
    unit = block(tuple(len(axis) - 1 for axis in axes), (1.0, 1.0, 1.0))
    positions = np.stack(
        [
            axis[np.rint(unit.positions[:, c] * (len(axis) - 1)).astype(int)]
            for c, axis in enumerate(axes)
        ],
        axis=1,
    )
    near = 1e-3 * thickness
    from_middle = np.abs(positions[:, :2] - 0.5 * np.array(_SIZE[:2]))
    is_strip = (
        (from_middle[:, 0] < 0.5 * thickness + near)
        & (from_middle[:, 1] < 0.5 * _EDGE + near)
        & (positions[:, 2] > _SIZE[2] - near)
    )
    tissue = Tissue(
        TetrahedralMesh(positions, unit.tetrahedra),
        _MATERIAL,
        fixed=is_strip | (positions[:, 2] < near),
        gravity=(0.0, 0.0, 0.0),
    )
    tissue.move_supports(is_strip, (0.0, 0.0, -_SPEED))
    for _ in range(round(_DEPTH / _SPEED / DT)):
        tissue.step(None, DT)
    tissue.settle()
    return float(-tissue.support_forces()[is_strip, 2].sum())


def _places_from(cell: float, length: float) -> FloatArray:
    """Return places from 0 to `length` [m], the first `cell` apart, then ever farther."""
    n = 1
    while cell * (_GROWTH**n - 1.0) / (_GROWTH - 1.0) < length:
        n += 1
    places = cell * (_GROWTH ** np.arange(n + 1) - 1.0) / (_GROWTH - 1.0)
    places[2:] = cell + (places[2:] - cell) * (length - cell) / (places[-1] - cell)
    return np.asarray(places)


def _places_around(cell: float) -> FloatArray:
    """Return places across the block, `cell` apart in its middle [m]."""
    middle = 0.5 * _SIZE[0]
    places = _places_from(cell, middle)
    return np.concatenate([middle - places[:0:-1], middle + places])


def check_dent(name: str, found: Dent, reference: float) -> list[Check]:
    """Return the checks of a back that was pressed in."""
    return [
        _LINES["force"].check(name, found.held / reference),
        _LINES["area"].check(name, found.cut_area * 1e6),
    ]


def measure_spine(quick: bool) -> Findings:
    """Press the backs of two blades into two meshes each."""
    checks, curves = [], []
    for thickness in _THICKNESSES[:1] if quick else _THICKNESSES:
        reference = strip_force(thickness)
        for cells in _CELLS[:1] if quick else _CELLS:
            found = dent(thickness, cells)
            name = f"{thickness * 1e3:g} mm thick, {' × '.join(map(str, cells))} cells"
            checks += check_dent(name, found, reference)
            curves.append(Curve(name, found.depth * 1e3, found.force))
        ends = np.array([0.0, _DEPTH])
        line = Curve("", ends * 1e3, reference * ends / _DEPTH, is_theory=True)
        curves.append(line)
    plot = Plot("Backs pressed into a block of 10 kPa", "depth [mm]", "force [N]", curves)
    return Findings(checks, [plot])
