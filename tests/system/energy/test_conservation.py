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


class Audit:
    """A free body without drag, cut by a blade; impulses and momentum changes of each frame."""

    def __init__(self, mesh, stroke):
        material = replace(SPRINGS, viscous_damping=0.0)
        self.tissue = Tissue(mesh, material, gravity=NO_GRAVITY)
        self.impulse, self.angular_impulse, self.gained, self.gained_angular = [], [], [], []
        self.results = []
        before = momentum(self.tissue)
        for sweep in strokes.sweeps(stroke):
            result = self.tissue.step(sweep, strokes.DT)
            after = momentum(self.tissue)
            force, torque, point = result.wrench
            self.impulse.append(strokes.DT * force)
            self.angular_impulse.append(strokes.DT * (torque + np.cross(point, force)))
            self.gained.append(after[0] - before[0])
            self.gained_angular.append(after[1] - before[1])
            self.results.append(result)
            before = after


@pytest.fixture(scope="module")
def audit():
    """Cut a free cube with a fast blade."""
    mesh = bodies.jittered(4, 0)
    # The blade is so fast that the body has no time to move away.
    stroke = [
        strokes.pose((0.0187, y, -0.03), (0.0227, y + 0.004, 0.07), (0.1, 1.0, 0.0))
        for y in strokes.along_y(-0.02, 0.2, speed=3.0)
    ]
    audit = Audit(mesh, stroke)
    assert audit.results[-1].cut_area > 4e-4
    return audit


def test_the_angular_momentum_changes_by_the_torque_of_the_blade(audit):
    """Runge-Kutta conserves angular momentum to the order of the method only."""
    gained, applied = np.array(audit.gained_angular), np.array(audit.angular_impulse)
    assert np.abs(applied).max() > 1e-7
    np.testing.assert_allclose(gained, -applied, atol=0.02 * np.abs(applied).max())


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
    assert press[-1].wrench.force[1] < -0.05
    assert press[-1].cut_area == press[-1].work_of_cutting == 0.0
    release = strokes.make(tissue, strokes.upright(0.02, 0.0003, -0.0005, **slowly)[:1])
    away = strokes.upright(0.02, -0.0101, -0.0102, **slowly)
    release = strokes.make(tissue, away)
    assert not np.any(release[-1].wrench.force)
    tissue.settle()
    np.testing.assert_allclose(tissue.snapshot().positions, mesh.positions, atol=1e-5)


ONLY_SPRINGS = {"law": "springs", "poisson_ratio": 0.25}
SOLID = {"law": "neo_hookean", "poisson_ratio": 0.45}


def steady_cut(cells, toughness, speed, dt=strokes.DT, depth=0.02, relaxation="global", **law):
    """Cut a block held at both sides; return the frames in the middle of the cut."""
    mesh = block(cells, SLAB)
    tissue = Tissue(
        mesh,
        Material(toughness=toughness, **law),
        fixed=bodies.sides(mesh),
        gravity=NO_GRAVITY,
        solver=SolverSettings(relaxation=relaxation),
    )
    low = -0.005 if depth == SLAB[2] else SLAB[2] - depth
    stroke = strokes.upright(0.0213, -0.004, 0.06, low, 0.025, speed * dt / strokes.DT)
    results = strokes.make(tissue, stroke, dt)
    middle = [r for r, pose in zip(results, stroke[1:], strict=True) if 0.035 < pose.tip[1] < 0.055]
    return tissue, middle, results


COARSE, FINE = (4, 8, 2), (6, 12, 3)

STEADY_CUTS = [
    # cells, toughness [J/m2], speed [m/s], time step [s]
    (COARSE, 5.0, 0.05, strokes.DT),
    (FINE, 5.0, 0.1, strokes.DT),
    (FINE, 20.0, 0.1, 0.5 * strokes.DT),
    (FINE, 20.0, 0.1, 2.0 * strokes.DT),
    (COARSE, 60.0, 0.1, strokes.DT),
    # Toughness over Young's modulus is 6 mm here, 1.27 times the mean node size.
    (FINE, 60.0, 0.05, strokes.DT),
]


@pytest.mark.parametrize("relaxation", ["global", "verlet"])
@pytest.mark.parametrize(("cells", "toughness", "speed", "dt"), STEADY_CUTS)
def test_steady_cutting_force_is_toughness_times_anchored_length(
    cells, toughness, speed, dt, relaxation
):
    _, middle, _ = steady_cut(cells, toughness, speed, dt, relaxation=relaxation, **SOLID)
    assert_steady(middle, toughness)


@pytest.mark.parametrize(("cells", "toughness"), [(COARSE, 5.0), (FINE, 5.0), (COARSE, 40.0)])
def test_springs_are_cut_with_the_same_force(cells, toughness):
    _, middle, _ = steady_cut(cells, toughness, 0.1, relaxation="verlet", **ONLY_SPRINGS)
    assert_steady(middle, toughness)


def assert_steady(middle, toughness):
    force = -np.mean([r.wrench.force[1] for r in middle])
    anchored = np.mean([r.anchored_length for r in middle])
    assert anchored == pytest.approx(SLAB[2], rel=0.05)
    assert force == pytest.approx(toughness * SLAB[2], rel=0.05)


def test_springs_are_refused_at_a_toughness_that_folds_them():
    """Toughness over Young's modulus is 6 mm here, 1.27 times the mean node size."""
    with pytest.raises(ValueError, match=r"springs fold ahead of the blade above 0\.6"):
        steady_cut(FINE, 60.0, 0.05, **ONLY_SPRINGS)


def test_an_incision_half_as_deep_costs_half_the_force():
    _, middle, _ = steady_cut((6, 12, 4), 20.0, 0.1, depth=0.01)
    force = -np.mean([r.wrench.force[1] for r in middle])
    assert force == pytest.approx(20.0 * 0.01, rel=0.1)


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
