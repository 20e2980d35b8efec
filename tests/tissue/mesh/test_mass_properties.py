"""Mass properties of pieces against those of the solid inside their surface, by trimesh.

The engine puts a quarter of the mass m of a tetrahedron at each of its nodes x_i. The first moment
is that of the solid: m times the centroid c. The second moment is larger than that of the solid by
m / 5 times the sum of (x_i - c)(x_i - c)^T. So at rest volume, mass and centre agree exactly, and
the tensors of inertia differ by a known sum.
"""

import numpy as np
import pytest

from tests.support import strokes
from tissue import Material, Snapshot, Tissue, block, liver_lobe
from tissue.mesh.pieces import piece_of_tetrahedra, pieces_of

DENSITY = 1060.0
"""Density of all bodies [kg/m3]."""

BLOCK = block((4, 2, 2), (0.04, 0.02, 0.02))


def cut_block() -> Tissue:
    """Return a block held at one end and cut across at 3/4 of its length."""
    material = Material(toughness=0.5, friction=0.0, density=DENSITY)
    tissue = Tissue(BLOCK, material, fixed=BLOCK.positions[:, 0] <= 0.02)
    strokes.make(tissue, strokes.straight(BLOCK, 0.75))
    return tissue


BODIES = {
    "block": lambda: Tissue(BLOCK, Material(density=DENSITY)),
    "liver lobe": lambda: Tissue(liver_lobe(), Material(density=DENSITY)),
    "two pieces of a block": cut_block,
}


@pytest.fixture(scope="module", params=BODIES.values(), ids=BODIES)
def tissue(request) -> Tissue:
    return request.param()


def solids(tissue: Tissue, *, at_rest: bool) -> list:
    """Return the solid of each piece as a trimesh object, the largest first."""
    surface = tissue.surface()
    if at_rest:
        surface = surface._replace(positions=surface.rest_positions)
    shells = surface.to_trimesh().split(only_watertight=True)
    for shell in shells:
        shell.density = DENSITY
    return sorted(shells, key=lambda shell: -shell.volume)


def inertia_of_lumping(body: Snapshot, tetrahedra: np.ndarray) -> np.ndarray:
    """Return the inertia that lumped masses add to that of the solid [kg m2]."""
    corners = body.rest_positions[tetrahedra]
    edges = corners[:, 1:] - corners[:, :1]
    masses = DENSITY * np.linalg.det(edges) / 6.0
    arms = corners - corners.mean(axis=1, keepdims=True)
    moment = np.einsum("t,tix,tiy->xy", masses / 5.0, arms, arms)
    return np.trace(moment) * np.eye(3) - moment


def test_at_rest_volume_mass_and_centre_of_a_piece_are_those_of_the_solid(tissue):
    body = tissue.snapshot()
    pieces = pieces_of(body._replace(positions=body.rest_positions))
    found = solids(tissue, at_rest=True)
    assert len(pieces) == len(found) == tissue.n_pieces()
    for piece, solid in zip(pieces, found, strict=True):
        assert piece.rest_volume == pytest.approx(solid.volume, rel=1e-9)
        assert piece.mass == pytest.approx(solid.mass, rel=1e-9)
        size = float(np.linalg.norm(solid.extents))
        np.testing.assert_allclose(piece.centre, solid.center_mass, atol=1e-9 * size)


def test_at_rest_the_inertia_of_a_piece_is_that_of_the_solid_plus_that_of_lumping(tissue):
    body = tissue.snapshot()
    pieces = pieces_of(body._replace(positions=body.rest_positions))
    of_tetrahedron = piece_of_tetrahedra(body)
    for i, (piece, solid) in enumerate(zip(pieces, solids(tissue, at_rest=True), strict=True)):
        lumping = inertia_of_lumping(body, body.tetrahedra[of_tetrahedron == i])
        expected = solid.moment_inertia + lumping
        assert np.linalg.eigvalsh(lumping).min() > 0.0
        np.testing.assert_allclose(piece.inertia, expected, atol=1e-9 * np.trace(expected))


def test_a_deformed_piece_has_the_volume_of_the_solid_and_its_centre_within_a_bound(tissue):
    """The mass stays with the material, while the solid's density is uniform over its volume."""
    body = tissue.snapshot()
    of_tetrahedron = piece_of_tetrahedra(body)
    found = zip(tissue.pieces(), solids(tissue, at_rest=False), strict=True)
    for i, (piece, solid) in enumerate(found):
        assert piece.volume == pytest.approx(solid.volume, rel=1e-9)
        corners = np.stack([body.rest_positions, body.positions])[
            :, body.tetrahedra[of_tetrahedron == i]
        ]
        volumes = np.linalg.det(corners[:, :, 1:] - corners[:, :, :1])
        rest, now = volumes / volumes.sum(axis=1, keepdims=True)
        arms = corners[1].mean(axis=1) - solid.center_mass
        bound = np.abs(rest - now) @ np.linalg.norm(arms, axis=1)
        size = float(np.linalg.norm(solid.extents))
        assert np.linalg.norm(piece.centre - solid.center_mass) <= bound + 1e-9 * size
        assert bound < 0.01 * size, "the strain is too large for this test"
