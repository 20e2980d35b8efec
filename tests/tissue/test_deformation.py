"""Stress and strain of tetrahedra, against theory and against the forces that move the body."""

import numpy as np
import pytest

from tests.support import bodies, naive_solid
from tests.tissue.test_body_view import LAWS, SOLIDS, deformed, moved, stretched
from tissue import SolverSettings, Tissue, block

BLOCK = block((2, 2, 2), (0.02, 0.02, 0.02))
ALONG, ACROSS = 1.3, 0.95

ROUNDING = 1e-9
"""Of double precision, relative: differences of positions of 1e-2 m are exact to 1e-14 of them."""


def around_forces(tissue):
    """Return the force on each node that the stress of the tetrahedra around it gives [N]."""
    body, stress = tissue.snapshot(), tissue.deformation().stress
    corners = body.positions[body.tetrahedra]
    shapes = np.linalg.inv(corners[:, 1:] - corners[:, :1])  # columns: gradients of corners 1 to 3
    volumes = np.linalg.det(corners[:, 1:] - corners[:, :1]) / 6.0
    gradients = np.concatenate([-shapes.sum(axis=2)[:, None], shapes.swapaxes(1, 2)], axis=1)
    forces = -volumes[:, None, None] * np.einsum("tij,tkj->tki", stress, gradients)
    total = np.zeros_like(body.positions)
    np.add.at(total, body.tetrahedra, forces)
    return total


@pytest.mark.parametrize("law", SOLIDS)
@pytest.mark.parametrize("element", ["averaged", "plain"])
def test_a_uniform_stretch_has_the_stress_and_strain_of_theory(law, element):
    material, positions = LAWS[law], stretched(BLOCK, ALONG, ACROSS)
    found = deformed(BLOCK, material, positions, precision="double", element=element).deformation()
    squared, j = ALONG**2 + 2.0 * ACROSS**2, ALONG * ACROSS**2
    q = squared - 1.0 - 2.0 * j
    shear = {
        "neo_hookean": 4.0 / 3.0 * (1.0 - 1.0 / (squared + 1.0)),
        "exponential": np.exp(12.0 * q),
        "yeoh": 1.0 + 2.0 * 2.0 * q + 3.0 * 5.0 * q**2,
    }[law]
    difference = material.mu * shear * (ALONG**2 - ACROSS**2) / j
    stresses = found.stress
    assert stresses[:, 0, 0] - stresses[:, 1, 1] == pytest.approx(difference, rel=ROUNDING)
    assert stresses[:, 1, 1] == pytest.approx(stresses[:, 2, 2], rel=ROUNDING)
    assert found.von_mises() == pytest.approx(difference, rel=ROUNDING)
    off = stresses - stresses * np.eye(3)
    np.testing.assert_allclose(off, 0.0, atol=ROUNDING * difference)
    strains = np.diag([(ALONG**2 - 1.0) / 2.0] + 2 * [(ACROSS**2 - 1.0) / 2.0])
    np.testing.assert_allclose(found.strain, strains + np.zeros_like(found.strain), atol=1e-14)


@pytest.mark.kernel
@pytest.mark.parametrize("element", ["averaged", "plain"])
@pytest.mark.parametrize("law", SOLIDS)
def test_the_stress_gives_back_the_forces_that_move_the_body(law, element):
    mesh = bodies.jittered(3, 5)
    solver = SolverSettings(precision="double", element=element)
    every = np.ones(len(mesh.positions), dtype=bool)
    still = Tissue(
        mesh, LAWS[law], fixed=every, positions=moved(mesh), gravity=(0.0, 0.0, 0.0), solver=solver
    )
    held = -still.support_forces()
    np.testing.assert_allclose(around_forces(still), held, atol=ROUNDING * np.abs(held).max())


@pytest.mark.kernel
def test_strains_are_those_of_a_slow_reference():
    mesh = bodies.jittered(3, 5)
    f = naive_solid.gradients(mesh, moved(mesh))
    expected = 0.5 * (f.transpose(0, 2, 1) @ f - np.eye(3))
    found = deformed(mesh, LAWS["neo_hookean"], moved(mesh)).deformation().strain
    np.testing.assert_allclose(found, expected, atol=1e-12)


@pytest.mark.kernel
@pytest.mark.parametrize("law", ["springs", "springs with volumes"])
def test_springs_have_the_virial_of_their_pulls(law):
    mesh, material = bodies.jittered(3, 5), LAWS[law]
    every = np.ones(len(mesh.positions), dtype=bool)
    at, solver = moved(mesh), SolverSettings(precision="double")
    still = Tissue(mesh, material, fixed=every, positions=at, gravity=(0, 0, 0), solver=solver)
    volumes = naive_solid.volumes(mesh._replace(positions=at))
    virial = np.einsum("t,tij->ij", volumes, still.deformation().stress)
    # Of forces from within, the sum over nodes of -f x^T is the volume times the mean stress.
    expected = np.einsum("ni,nj->ij", still.support_forces(), at)
    np.testing.assert_allclose(virial, expected, atol=ROUNDING * np.abs(expected).max())
