from dataclasses import replace

import numpy as np
import pytest

from tests.support import bodies
from tests.support.materials import SPRINGS
from tissue import Material
from tissue.core.vec3 import Vec3
from tissue.elasticity.elasticity import Elasticity
from tissue.elasticity.internal_forces import Surroundings
from tissue.elasticity.stiffness_matrix import masses, stiffness_matrix
from tissue.integrators.methods import METHODS
from tissue.integrators.stability import stable_step
from tissue.mesh.body import build_body
from tissue.mesh.material_table import MaterialArrays
from tissue.mesh.star import no_visits

MESH = bodies.jittered(2, seed=5)


def runge_kutta_matrix(k, c, h):
    """Return a Runge-Kutta step of x'' + c x' + k x = 0 as a matrix on the state (x, v)."""
    one, zero = np.eye(len(k)), np.zeros_like(k)
    x, v = np.hstack([one, zero]), np.hstack([zero, one])  # as functions of the state (x, v)
    a1 = -k @ x - c @ v
    middle = x + h / 2.0 * v + h * h / 8.0 * a1
    a2 = -k @ middle - c @ (v + h / 2.0 * a1)
    a3 = -k @ middle - c @ (v + h / 2.0 * a2)
    a4 = -k @ (x + h * v + h * h / 2.0 * a3) - c @ (v + h * a3)
    return np.vstack(
        [x + h * v + h * h / 6.0 * (a1 + a2 + a3), v + h / 6.0 * (a1 + 2.0 * (a2 + a3) + a4)]
    )


def damping_matrix(c, h):
    """Return the damping of a whole step as a matrix on the state (x, v)."""
    one, zero = np.eye(len(c)), np.zeros_like(c)
    return np.block([[one, zero], [zero, one - h * c]])


def nystroem_matrix(k, c, h):
    """Return a step of the Nystroem method of three stages with damping once a step."""
    one, zero = np.eye(len(k)), np.zeros_like(k)
    x, v = np.hstack([one, zero]), np.hstack([zero, one])  # as functions of the state (x, v)
    a1 = -k @ x
    a2 = -k @ (x + h / 3.0 * v + h * h / 18.0 * a1)
    a3 = -k @ (x + h * 5.0 / 6.0 * v + h * h * (5.0 / 144.0 * a1 + 5.0 / 16.0 * a2))
    moved = x + h * v + h * h * (a1 / 10.0 + a2 / 3.0 + a3 / 15.0)
    step = np.vstack([moved, v + h * (a1 / 10.0 + a2 / 2.0 + a3 * 2.0 / 5.0)])
    return step @ damping_matrix(c, h)


def verlet_matrix(k, c, h):
    """Return a step of position Verlet with damping once a step."""
    one, zero = np.eye(len(k)), np.zeros_like(k)
    drift = np.block([[one, 0.5 * h * one], [zero, one]])
    kick = np.block([[one, zero], [-h * k, one]])
    return drift @ kick @ drift @ damping_matrix(c, h)


STEP_MATRICES = {
    "runge_kutta": runge_kutta_matrix,
    "nystroem": nystroem_matrix,
    "verlet": verlet_matrix,
}


@pytest.mark.parametrize("name", METHODS)
@pytest.mark.parametrize("retardation_time", [0.0, 1e-4, 1e-3, 1e-2, 1.0])
@pytest.mark.parametrize(
    "material",
    [
        Material(law="neo_hookean", poisson_ratio=0.0),
        Material(law="neo_hookean", poisson_ratio=0.45),
        Material(law="neo_hookean", poisson_ratio=0.49),
        replace(SPRINGS, poisson_ratio=0.45),
    ],
    ids=lambda material: f"{material.law.name} {material.poisson_ratio}",
)
def test_no_mode_grows_in_a_stable_step_with_any_damping(material, retardation_time, name):
    """Steps of M x'' + C x' + K x = 0 as matrices; C is that of tetrahedra, or of springs alone.

    No method comes with a proof where K and C have other modes, so two steps are tried: the
    longest by the limits, and the one that is taken.
    """
    method, step_matrix = METHODS[name], STEP_MATRICES[name]
    material = replace(material, retardation_time=retardation_time)
    viscous = material
    if material.law.has_springs:
        viscous = replace(SPRINGS, young_modulus=material.spring_modulus)
    root = 1.0 / np.sqrt(np.repeat(masses(MESH, material.density), 3))
    k, c = (root[:, None] * stiffness_matrix(MESH, m).toarray() * root for m in (material, viscous))
    c *= retardation_time
    body = build_body(MESH, None, None, MaterialArrays.of([material], [0]))
    elasticity = Elasticity(material, body, no_visits(len(body.rest), len(body.tetrahedra)))
    around = Surroundings(gravity=Vec3(0.0, 0.0, 0.0), drag=0.0, retardation_time=retardation_time)
    h = stable_step(method.number, elasticity.arrays, elasticity.frequency_squared, around)
    for step in (h, h / method.safety):
        # The six rigid motions have double eigenvalues of 1, which rounding separates.
        assert np.abs(np.linalg.eigvals(step_matrix(k, c, step))).max() < 1.0 + 1e-4
