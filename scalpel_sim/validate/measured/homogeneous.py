"""The stress of a block that is deformed evenly: compression, tension along two axes, and shear.

All nodes of its skin are held and moved; what is inside finds its own place. The stress does not
depend on the mesh, as long as its elements pass the patch test.
"""

from collections.abc import Sequence

import numpy as np
from scipy.optimize import brentq

from scalpel_sim.validate.stretch import energy_of
from tissue import FloatArray, Material, Tissue, block, fixed_nodes

_SIDE, _CELLS = 0.02, (4, 4, 4)
"""Sides of the block [m], and cells along them."""
_N_STEPS, _DT = 40, 1e-3
"""Steps from one deformation to the next, and their length [s]."""
_SKIN = "left,right,front,back,bottom,top"
_SMALL_SHEAR = 0.01
"""Shear that is added to a compression, for the slope of its stress."""
_H = 1e-6
"""Half of the difference of stretches over which a slope of the energy is taken."""


def stretches_with_free_sides(
    material: Material, along: float, across: float | None = None
) -> FloatArray:
    """Return the three stretches of a block whose other sides bear no load, shape (3,).

    Args:
        material: What it is made of.
        along: Stretch along x.
        across: Stretch along y; None: the sides along y are free as well.
    """
    energy = energy_of(material)

    def slope(free: float) -> float:
        others = [(free + s, free + s if across is None else across) for s in (_H, -_H)]
        more, less = (energy(along, y, z) for z, y in others)
        return more - less

    free = float(brentq(slope, 0.5, 2.0))
    return np.array([along, free if across is None else across, free])


def stresses(
    material: Material, gradients: Sequence[FloatArray], cells: tuple[int, int, int] = _CELLS
) -> list[FloatArray]:
    """Deform a block from one gradient to the next; return Cauchy's stress at rest in each [Pa].

    The stress is the mean over the volume, which follows from the forces of the supports alone.

    Args:
        material: What it is made of.
        gradients: Deformation gradients, each of shape (3, 3).
        cells: Cells along its sides.
    """
    mesh = block(cells, (_SIDE, _SIDE, _SIDE))
    nodes = np.flatnonzero(fixed_nodes(mesh, _SKIN))
    held = fixed_nodes(mesh, _SKIN)
    tissue = Tissue(mesh, material, fixed=held, gravity=(0.0, 0.0, 0.0))
    rest, before, found = mesh.positions[nodes], np.eye(3), []
    for gradient in gradients:
        velocity = rest @ (gradient - before).T / (_N_STEPS * _DT)
        tissue.move_supports(nodes, velocity)
        for _ in range(_N_STEPS):
            tissue.step(None, _DT)
        tissue.settle()
        places, forces = rest @ gradient.T, tissue.support_forces()[nodes]
        volume = float(np.linalg.det(gradient)) * _SIDE**3
        found.append(forces.T @ places / volume)
        before = gradient
    return found


def stress_along(material: Material, paths: Sequence[FloatArray]) -> FloatArray:
    """Return Cauchy's stress along x and y at each of some stretches [Pa], shape (n, 2).

    Args:
        material: What it is made of.
        paths: The three stretches of each point, each of shape (3,).
    """
    found = stresses(material, [np.diag(stretch) for stretch in paths])
    return np.array([(stress[0, 0], stress[1, 1]) for stress in found])


def shear_moduli(material: Material, compressions: Sequence[float]) -> FloatArray:
    """Return the shear modulus of a block that is pressed along x, at each stretch [Pa].

    A small shear is added to each compression, in a plane that contains its axis.

    Args:
        material: What it is made of.
        compressions: Stretches along x; the other sides are free.
    """
    found = []
    for along in compressions:
        pressed = np.diag(stretches_with_free_sides(material, along))
        shear = np.eye(3)
        shear[1, 0] = _SMALL_SHEAR
        stress = stresses(material, [pressed, shear @ pressed])[-1]
        found.append(stress[1, 0] / _SMALL_SHEAR)
    return np.array(found)
