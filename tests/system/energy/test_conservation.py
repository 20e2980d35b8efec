"""Conservation of mass, momentum and energy in cuts and motion; action equals reaction."""

from dataclasses import replace

import numpy as np
import pytest

from tests.support import bodies, incisions, strokes
from tests.support.materials import SPRINGS
from tests.tissue.kernels_of import row, springs_of
from tissue import Material, SolverSettings, Tissue, block
from tissue.elasticity.energy import elastic_energy

NO_GRAVITY = (0.0, 0.0, 0.0)
SLAB = (0.04, 0.08, 0.02)


def momentum(tissue):
    """Return the linear momentum and the angular momentum about the origin [kg m/s, kg m2/s]."""
    body = tissue.snapshot()
    p = body.masses[:, None] * body.velocities
    return p.sum(axis=0), np.cross(body.positions, p).sum(axis=0)


def drifting(mesh, undamped=True):
    """Return a free body that flies and tumbles, without drag."""
    material = Material(viscous_damping=0.0, retardation_time=0.0 if undamped else 2e-4)
    tissue = Tissue(mesh, material, gravity=NO_GRAVITY)
    n = tissue.n_nodes
    spin = np.cross([3.0, -2.0, 5.0], mesh.positions - mesh.positions.mean(axis=0))
    wobble = 0.05 * np.random.default_rng(0).normal(size=(n, 3))
    tissue._body.velocities[:n] = np.array([0.3, 0.1, -0.2]) + spin + wobble
    return tissue


@pytest.mark.parametrize("scheme", ["stellar", "paper"])
@pytest.mark.parametrize("law", ["springs", "neo_hookean"])
def test_a_cut_keeps_both_momenta_of_a_body_that_spins(law, scheme):
    """No time passes: what changes is the mesh. Mass scaling is off, as it adds momentum."""
    mesh = bodies.jittered(4, 1)
    solver = SolverSettings(mass_scaling=None, scheme=scheme)
    material = Material(law=law, poisson_ratio=0.45)
    tissue = Tissue(mesh, material, gravity=NO_GRAVITY, solver=solver)
    n = tissue.n_nodes
    spin = np.cross([30.0, -20.0, 50.0], mesh.positions - mesh.positions.mean(axis=0))
    tissue._body.velocities[:n] = np.array([0.3, 0.1, -0.2]) + spin
    linear, angular = momentum(tissue)
    for seed, kind in enumerate(incisions.KINDS):
        tissue.incise(*incisions.incision(mesh, kind, seed))
    assert tissue.n_nodes > n
    linear_t1, angular_t1 = momentum(tissue)
    np.testing.assert_allclose(linear_t1, linear, atol=1e-12 * np.linalg.norm(linear))
    np.testing.assert_allclose(angular_t1, angular, atol=1e-9 * np.linalg.norm(angular))


@pytest.mark.parametrize("undamped", [True, False])
def test_a_free_body_keeps_its_momentum_over_a_thousand_steps(undamped):
    tissue = drifting(bodies.jittered(3, 0), undamped)
    linear, angular = momentum(tissue)
    for _ in range(1000):
        tissue.step(None, strokes.DT)
    linear_t1, angular_t1 = momentum(tissue)
    np.testing.assert_allclose(linear_t1, linear, atol=1e-12 * np.linalg.norm(linear))
    np.testing.assert_allclose(angular_t1, angular, atol=1e-3 * np.linalg.norm(angular))


def test_a_free_undamped_body_keeps_its_energy():
    tissue = drifting(bodies.jittered(3, 0))

    def energy():
        body = tissue.snapshot()
        kinetic = 0.5 * float(body.masses @ (body.velocities**2).sum(axis=1))
        return kinetic + elastic_energy(tissue._model.elasticity.arrays, tissue._body)

    before = energy()
    for _ in range(500):
        tissue.step(None, strokes.DT)
    assert 0.98 * before <= energy() <= 1.0001 * before


def test_a_blade_out_of_contact_has_exactly_zero_wrench():
    mesh = block()
    tissue = Tissue(mesh, fixed=bodies.sides(mesh))
    beside = strokes.upright(0.2, -0.01, 0.1, -0.01, 0.05)
    for result in strokes.make(tissue, beside):
        assert not np.any(result.wrench.force)
        assert not np.any(result.wrench.torque)
        assert not np.any(result.force_on_tissue)
        assert result.anchored_length == 0.0
        assert result.active_point_tetrahedron == -1


def test_a_press_that_does_not_cut_springs_back():
    """Half a millimetre is less than toughness over anchor stiffness: the tissue is only dented."""
    mesh = block()
    tissue = Tissue(mesh, fixed=bodies.sides(mesh), gravity=NO_GRAVITY)
    slowly = {"low": -0.01, "high": 0.05, "speed": 0.02}
    press = strokes.make(tissue, strokes.upright(0.02, -0.0002, 0.0003, **slowly))
    assert press[-1].wrench.force[1] < -0.04
    assert press[-1].cut_area == press[-1].work_of_cutting == 0.0
    release = strokes.make(tissue, strokes.upright(0.02, 0.0003, -0.0005, **slowly)[:1])
    away = strokes.upright(0.02, -0.0101, -0.0102, **slowly)
    release = strokes.make(tissue, away)
    assert not np.any(release[-1].wrench.force)
    tissue.settle()
    np.testing.assert_allclose(tissue.snapshot().positions, mesh.positions, atol=1e-5)


def test_springs_are_refused_at_a_toughness_that_folds_them():
    """Toughness over Young's modulus is 6 mm here, 1.27 times the mean node size."""
    mesh = block((6, 12, 3), SLAB)
    tissue = Tissue(mesh, replace(SPRINGS, toughness=60.0), fixed=bodies.sides(mesh))
    with pytest.raises(ValueError, match=r"springs fold ahead of the blade above 0\.6"):
        strokes.make(tissue, strokes.upright(0.0213, -0.004, 0.06, -0.005, 0.025))


def test_rows_and_masses_after_cuts_are_those_built_from_scratch():
    """To the last bit: a row depends only on the tetrahedra around its node."""
    mesh = bodies.jittered(4, 0)
    tissue = Tissue(mesh, SPRINGS, fixed=bodies.sides(mesh))
    strokes.make(tissue, strokes.slanted(mesh))
    strokes.make(tissue, strokes.straight(mesh, 0.3))
    body, n = tissue._body, tissue.n_nodes
    kept = [row(tissue._model.elasticity.arrays.springs, i) for i in range(n)]
    masses = body.masses[:n].copy()
    from_scratch = springs_of(body, tissue.material.young_modulus)
    assert kept == [row(from_scratch, i) for i in range(n)]
    np.testing.assert_array_equal(masses, body.masses[:n])
