"""Whoever cuts pays: a drawn edge, for what it sweeps, in tissues by name.

Their toughness over Young's modulus is 2 to 17 node sizes, and the edge ends between samples at the
tip and at the skin. `python -m benchmarks cutting-law` measures many more cuts.
"""

import numpy as np
import pytest

from tests.support import strokes
from tissue import MATERIALS, SolverSettings, Tissue, block, fixed_nodes, lattice_block

SIZE = np.array([0.045, 0.09, 0.016])
"""Of the block [m]."""
X, SPEED = 0.0187, 0.15
"""Where the edge cuts, between planes of the mesh [m]; how fast [m/s]."""
DEPTH = 0.0087
"""How deep the tip is, where the block is not cut through [m]."""
STEADY = slice(0.055, 0.078)
"""Where the cut is steady along the block [m]."""
NOT_PAID = 0.01
"""Most of the work that samples which take hold of tissue or lose it may give or take: they do so
in the steady part of a cut as it goes on through the same tissue."""

SHAPES = {"block": block, "lattice": lattice_block}


def drawn(preset, kind, cell, is_through):
    """Draw an edge along the block; return frames of the steady part, and the depth [m]."""
    mesh = SHAPES[kind](np.maximum(np.rint(SIZE / cell), 1).astype(int), SIZE)
    tissue = Tissue(
        mesh,
        MATERIALS[preset].material,
        fixed=fixed_nodes(mesh, "left,right" if is_through else "bottom"),
        gravity=(0.0, 0.0, 0.0),
        solver=SolverSettings(audit=True),
    )
    low = -0.005 if is_through else SIZE[2] - DEPTH
    stroke = strokes.upright(X, -0.005, STEADY.stop, low, SIZE[2] + 0.007, SPEED)
    steady = [pose.tip[1] > STEADY.start for pose in stroke[1:]]
    results = strokes.make(tissue, stroke)
    return results[steady.index(True) :], SIZE[2] if is_through else DEPTH


@pytest.mark.parametrize(
    ("preset", "kind", "is_through"),
    [
        ("liver", "lattice", False),
        ("muscle", "lattice", True),
        ("fat", "block", False),
        ("silicone", "block", False),
        ("gelatin", "block", False),
    ],
)
def test_the_work_of_a_steady_cut_is_the_area_paid_for(preset, kind, is_through):
    frames, depth = drawn(preset, kind, 8e-3, is_through)
    first, last = frames[0].energies, frames[-1].energies
    work = last.work_of_blade - first.work_of_blade
    assert abs(last.released - first.released) < NOT_PAID * work
    material = MATERIALS[preset].material
    rise = (SPEED / material.toughness_speed) ** material.toughness_exponent
    toughness = material.toughness * (1.0 + rise * (material.toughness_exponent > 0.0))
    force = -np.mean([frame.wrench.force[1] for frame in frames])
    assert force == pytest.approx(toughness * depth, rel=0.06)  # muscle 1.054
