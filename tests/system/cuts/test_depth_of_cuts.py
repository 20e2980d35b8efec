"""A cut is as deep as its edge in the mean, wherever planes of the mesh lie."""

import math

import numpy as np
import pytest

from tests.support import bodies
from tissue import FloatArray, TetrahedralMesh, Tissue, block, lattice_block
from tissue.mesh.body import CUT

SIZE = np.array([0.045, 0.06, 0.018])
"""Of the body [m]."""
OFF = 0.03
"""Most by which the area may be off: the crack front makes good what nodes led it aside by, over a
node size, and the last of it stays."""

SHAPES = {"block": block, "lattice": lattice_block}


def body_of(kind: str, cell: float) -> TetrahedralMesh:
    """Return the body in cells of about that size [m]; `kind`: block, lattice or jittered."""
    n = np.maximum(np.rint(SIZE / cell), 1).astype(int)
    if kind != "jittered":
        return SHAPES[kind](n, SIZE)
    mesh = block(n, SIZE)
    moved = np.random.default_rng(7).uniform(-0.22, 0.22, mesh.positions.shape) * SIZE / n
    is_inside = (mesh.positions > 1e-9) & (mesh.positions < SIZE - 1e-9)
    positions = mesh.positions + moved * is_inside
    return TetrahedralMesh(
        positions, bodies.positively_oriented(positions, np.array(mesh.tetrahedra))
    )


def opened_across(mesh: TetrahedralMesh, angle: float, depth: float) -> float:
    """Cut through the middle at an angle to the grid [degrees].

    Returns:
        The area that opened, in the plane of the cut, over that of the plane down to `depth` [m].
    """
    tissue = Tissue(mesh, gravity=(0.0, 0.0, 0.0))
    ahead = np.array([math.sin(math.radians(angle)), math.cos(math.radians(angle)), 0.0])
    tip = np.array([*(0.5 * SIZE[:2]), SIZE[2] - depth])
    reach = 0.5 * min(
        side / max(share, 1e-9) for side, share in zip(SIZE[:2], ahead[:2], strict=True)
    )
    ends = tip + np.array([[-1.0], [1.0]]) * (reach + 0.02) * ahead
    up = np.array([0.0, 0.0, depth + 0.006])
    tissue.incise(np.stack([ends, ends + up], axis=1), ahead)
    return area_along(tissue, np.cross(ahead, up / up[2])) / (2.0 * reach * depth)


def area_along(tissue: Tissue, normal: FloatArray) -> float:
    """Return the area of the faces that were cut, seen along a unit vector [m2]."""
    body = tissue._body
    tetrahedra = body.tetrahedra[: body.n_tetrahedra]
    holders, opposite = np.nonzero(body.links[: body.n_tetrahedra] == CUT)
    corners = (opposite[:, None] + np.arange(1, 4)) % 4
    a, b, c = np.moveaxis(body.rest[tetrahedra[holders[:, None], corners]], 1, 0)
    return float(np.abs(np.cross(b - a, c - a) @ normal).sum() / 4.0)


@pytest.mark.parametrize("kind", ["block", "lattice", "jittered"])
@pytest.mark.parametrize("cell", [3.2e-3, 4.5e-3])
@pytest.mark.parametrize("angle", [0.0, 37.0, 60.0])
def test_the_mesh_opens_the_area_that_the_edge_sweeps(kind, cell, angle):
    mesh = body_of(kind, cell)
    for depth in (5e-3, 6.5e-3, 8e-3):
        assert opened_across(mesh, angle, depth) == pytest.approx(1.0, abs=OFF)
