from dataclasses import replace

import numpy as np
import pytest

from tests.support import bodies, naive
from tests.support.materials import SPRINGS
from tissue import Material, block
from tissue.elasticity.stiffness_matrix import edge_springs, masses, stiffness_matrix

MESH = bodies.jittered(3, seed=1)
LAWS = {
    "springs": SPRINGS,
    "springs and volume": replace(SPRINGS, poisson_ratio=0.45),
    "neo-Hookean": Material(law="neo_hookean", poisson_ratio=0.45),
}


def motion_of(gradient):
    """Return the displacements of the nodes with a constant gradient, as a flat array [m]."""
    return (MESH.positions @ np.asarray(gradient, dtype=float).T).ravel()


def test_springs_and_masses_are_those_of_the_slow_reference():
    springs = edge_springs(MESH, 10e3)
    slow = naive.stiffnesses(*MESH, 10e3)
    fast = {(int(a), int(b)): k for (a, b), k in zip(*springs, strict=True)}
    assert fast.keys() == slow.keys()
    assert [fast[edge] for edge in slow] == pytest.approx(list(slow.values()), rel=1e-12)
    np.testing.assert_allclose(masses(MESH, 1050.0), naive.masses(*MESH, 1050.0), rtol=1e-12)


@pytest.mark.parametrize("material", LAWS.values(), ids=LAWS)
@pytest.mark.parametrize("averaged", [True, False])
def test_a_rigid_motion_causes_no_force(material, averaged):
    matrix = stiffness_matrix(MESH, material, averaged=averaged)
    scale = matrix.diagonal().max() * 0.04
    for turn in ([[0, -1, 0], [1, 0, 0], [0, 0, 0]], [[0, 0, 1], [0, 0, 0], [-1, 0, 0]]):
        np.testing.assert_allclose(matrix @ motion_of(turn), 0.0, atol=1e-12 * scale)
    np.testing.assert_allclose(
        matrix @ np.tile([1.0, 2.0, 3.0], len(MESH.positions)) / scale, 0.0, atol=1e-9
    )


@pytest.mark.parametrize("material", LAWS.values(), ids=LAWS)
def test_every_deformation_costs_energy(material):
    dense = stiffness_matrix(block((2, 2, 2), (0.02, 0.02, 0.02)), material).toarray()
    np.testing.assert_allclose(dense, dense.T, atol=1e-12 * dense.max())
    values = np.linalg.eigvalsh(dense)
    assert (np.abs(values[:6]) < 1e-9 * values[-1]).all()  # six rigid motions
    assert values[6] > 1e-4 * values[-1]


@pytest.mark.parametrize("averaged", [True, False])
def test_tetrahedra_follow_hookes_law_under_uniform_strain(averaged):
    """Energy of an affine strain: V (mu eps:eps + lam (tr eps)^2 / 2)."""
    material = Material(law="neo_hookean", poisson_ratio=0.45)
    gradient = np.array([[0.3, 0.1, 0.0], [0.2, -0.4, 0.1], [0.0, 0.5, 0.2]])
    strain = (gradient + gradient.T) / 2.0
    by_hand = material.mu * np.sum(strain**2) + material.lam * np.trace(strain) ** 2 / 2.0
    motion = motion_of(gradient)
    energy = motion @ (stiffness_matrix(MESH, material, averaged=averaged) @ motion) / 2.0
    assert energy / 0.04**3 == pytest.approx(by_hand, rel=1e-12)
