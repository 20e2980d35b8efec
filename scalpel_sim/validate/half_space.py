"""A half-space that a rigid sphere is pressed into without friction, against Hertz."""

import math
from typing import NamedTuple

import numpy as np
from scipy.spatial import Delaunay

from tissue import FloatArray, Geom, Material, TetrahedralMesh, Tissue

RADIUS = 0.01
"""Radius of the sphere [m]."""
YOUNG = 20e3
"""Young's modulus [Pa]; the force is proportional to it."""
_SIZE = 0.12
"""How far the half-space reaches sideways and down, at least [m]: 27 times the radius of the
contact at a depth of 2 mm. Where it is twice as large the force is 0.6 to 1.2 % less."""
_FINE = 0.0048
"""How far cells are small around the contact [m]: more than its radius at 2 mm, 4.5 mm."""
_GROWTH = 1.4
"""Growth of the cells from there on."""
_FRAMES, _DT = 10, 2e-3
"""Time steps in which the sphere goes to the next depth, and their length [s]."""


class Indentation(NamedTuple):
    """A sphere that was pressed in, at several depths."""

    n_tetrahedra: int
    """Size of the mesh."""
    depth: FloatArray
    """How deep it was [m]."""
    force: FloatArray
    """Force on it [N]."""


def hertz_force(depth: float, poisson_ratio: float) -> float:
    """Return the force of a rigid sphere at a depth [m] by Hertz, 4/3 E* sqrt(R) d^1.5 [N]."""
    modulus = YOUNG / (1.0 - poisson_ratio * poisson_ratio)
    return 4.0 / 3.0 * modulus * depth * math.sqrt(RADIUS * depth)


def press_sphere(poisson_ratio: float, cell: float, depths: list[float]) -> Indentation:
    """Press the sphere into a half-space, and let it come to rest at each depth.

    Args:
        poisson_ratio: Poisson's ratio.
        cell: Size of cells near the contact [m].
        depths: Depths [m], rising.
    """
    mesh = half_space(cell)
    tissue = Tissue(
        mesh,
        Material(YOUNG, poisson_ratio=poisson_ratio, law="neo_hookean"),
        fixed=mesh.positions[:, 2] == mesh.positions[:, 2].min(),
        gravity=(0.0, 0.0, 0.0),
    )
    ball = tissue.collide_with([Geom("ball", "sphere", (RADIUS,))], [[0.0, 0.0, RADIUS]])
    before, forces = 0.0, []
    for depth in depths:
        for part in np.linspace(before, depth, _FRAMES + 1)[1:]:
            ball.move([[0.0, 0.0, RADIUS - part]])
            tissue.step(None, _DT)
        tissue.settle()
        tissue.step(None, _DT)
        forces.append(float(ball.wrench(0).force[2]))
        before = depth
    return Indentation(len(mesh.tetrahedra), np.array(depths), np.array(forces))


def half_space(cell: float) -> TetrahedralMesh:
    """Return a cylinder below z = 0 whose cells are small around the origin and grow away from it.

    Rings of six more nodes each as far as cells are small, and of as many as the last beyond; the
    triangles between them go down in layers of prisms, of three tetrahedra each.

    Args:
        cell: Size of cells near the origin [m].
    """
    places = _places(cell)
    most = 6 * round(_FINE / cell)
    rings = [np.zeros((1, 2))]
    for k, radius in enumerate(places[1:], 1):
        n = min(6 * k, most)
        angle = 2.0 * np.pi * (np.arange(n) + 0.5 * (k % 2)) / n
        rings.append(radius * np.column_stack([np.cos(angle), np.sin(angle)]))
    disc = np.concatenate(rings)
    n_disc = len(disc)
    # The diagonals of neighbouring prisms agree where each runs from the node of lowest number.
    a, b, c = np.sort(Delaunay(disc).simplices, axis=1).T
    prisms = np.stack([a, b, c, c + n_disc, a, b, b + n_disc, c + n_disc,
                       a, a + n_disc, b + n_disc, c + n_disc], axis=1)  # fmt: skip
    n_layers = len(places) - 1
    tetrahedra = np.concatenate([prisms + n_disc * i for i in range(n_layers)]).reshape(-1, 4)
    positions = np.concatenate(
        [np.column_stack([disc, np.full(n_disc, -depth)]) for depth in places]
    )
    sides = positions[tetrahedra[:, 1:]] - positions[tetrahedra[:, :1]]
    is_left_handed = np.linalg.det(sides) < 0.0
    tetrahedra[is_left_handed] = tetrahedra[is_left_handed][:, [1, 0, 2, 3]]
    return TetrahedralMesh(positions, tetrahedra)


def _places(cell: float) -> FloatArray:
    """Return distances from the origin [m], `cell` apart where cells are small, then growing."""
    places, size = [0.0], cell
    while places[-1] < _SIZE:
        if len(places) > round(_FINE / cell):
            size *= _GROWTH
        places.append(places[-1] + size)
    return np.array(places)
