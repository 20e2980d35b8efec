"""A bar of few elements that is twisted, against Saint-Venant's torsion."""

import numpy as np

from scalpel_sim.validate.bar import bar_material, bar_tissue
from scalpel_sim.validate.findings import Check, lines_of
from tissue import FloatArray, TetrahedralMesh, block, lattice_block

_SIDE, _LENGTH = 0.02, 0.1
"""Side of the square section, and length [m]."""
_N_ACROSS = 3
"""Cells across: as few as organs in real time have."""
_POISSON_RATIO = 0.45
_ANGLES = (0.3, 1.5)
"""Angles by which one end is turned [rad]."""
TORSION_CONSTANT = 0.140577
"""Torsion constant of a square section over a^4, by Saint-Venant's series."""
_MESHES = {"lattice": lattice_block, "block": block}
_STEP = 0.3
"""Angle turned at once, from one equilibrium to the next [rad]."""
_AXIS = np.array([0.5 * _SIDE, 0.5 * _SIDE, 0.0])
"""A point of the axis of the bar [m]."""
_LINES = lines_of("beam")


def torsion_checks(quick: bool) -> list[Check]:
    """Twist bars on both kinds of meshes; quick: by the small angle alone."""
    checks = []
    for name, make in _MESHES.items():
        mesh = make((_N_ACROSS, _N_ACROSS, 5 * _N_ACROSS), (_SIDE, _SIDE, _LENGTH))
        for angle in _ANGLES[:1] if quick else _ANGLES:
            of = f"{name}, {_N_ACROSS} cells across, {angle:g} rad"
            checks.append(_LINES["torque"].check(of, torque_over_theory(mesh, angle)))
    return checks


def torque_over_theory(mesh: TetrahedralMesh, angle: float) -> float:
    """Return the torque that holds a twisted bar over Saint-Venant's.

    Both ends are glued to plates that keep their distance.

    Args:
        mesh: A bar along z.
        angle: By which its far end is turned [rad].
    """
    rest = mesh.positions
    z = rest[:, 2]
    near, far = z < 1e-9, z > _LENGTH - 1e-9
    material, positions, n = bar_material(_POISSON_RATIO), rest, round(angle / _STEP)
    for i in range(n):
        # The inside follows, so that it begins near the next equilibrium.
        positions = _turned(positions, angle / n * z / _LENGTH)
        positions[near], positions[far] = rest[near], _turned(rest[far], angle * (i + 1) / n)
        tissue = bar_tissue(mesh, material, fixed=near | far, positions=positions, weighs=False)
        tissue.settle()
        positions = tissue.snapshot().positions
    arm, force = positions[far] - _AXIS, tissue.support_forces()[far]
    torque = np.cross(arm, force)[:, 2].sum()
    return float(torque * _LENGTH / (TORSION_CONSTANT * material.mu * _SIDE**4 * angle))


def _turned(points: FloatArray, angle: FloatArray | float) -> FloatArray:
    """Return points turned about the axis of the bar [m], each by its angle [rad]."""
    arm = points - _AXIS
    cos, sin = np.cos(angle), np.sin(angle)
    x, y = cos * arm[:, 0] - sin * arm[:, 1], sin * arm[:, 0] + cos * arm[:, 1]
    turned: FloatArray = np.stack([x, y, arm[:, 2]], axis=1) + _AXIS
    return turned
