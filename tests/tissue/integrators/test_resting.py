"""A calm body that nothing touches is not moved, until something acts on it."""

import numpy as np
import pytest

from tests.support import bodies, strokes
from tissue import BladeSegment, BladeSweep, Material, SolverSettings, Tissue, block

CUBE = block((3, 3, 3), (0.03,) * 3)
RELAXATIONS = ("global", "verlet")


def calm_body(relaxation, **options):
    """Return a cube held at two sides that has come to rest."""
    solver = SolverSettings(relaxation=relaxation, audit=True)
    tissue = Tissue(CUBE, Material(), fixed=bodies.sides(CUBE), solver=solver, **options)
    tissue.settle()
    tissue._stages.global_stepper.wake()
    for _ in range(400):
        result = tissue.step(None, strokes.DT)
    assert result.n_substeps == 0
    return tissue


@pytest.mark.parametrize("relaxation", RELAXATIONS)
def test_a_body_at_rest_stays_as_it_is_and_its_account_closes(relaxation):
    tissue = calm_body(relaxation)
    before = tissue.snapshot()
    result = tissue.step(None, strokes.DT)
    np.testing.assert_array_equal(tissue.snapshot().positions, before.positions)
    assert (before.velocities == 0.0).all()
    assert abs(result.energies.residual) < 1e-12


@pytest.mark.parametrize("relaxation", RELAXATIONS)
def test_a_blade_that_touches_a_body_at_rest_meets_the_force_that_it_meets_in_motion(relaxation):
    calm, moved = calm_body(relaxation), calm_body(relaxation)
    low, high = calm.bounds
    forces = []
    for tissue, is_waked in ((calm, False), (moved, True)):
        y = low[1] - 0.002
        found = []
        for _ in range(60):
            if is_waked:
                tissue._stages.global_stepper.wake()
            edges = [
                BladeSegment((0.015, at, low[2] - 0.01), (0.015, at, high[2] + 0.01), (0, 1, 0))
                for at in (y, y + 1e-4)
            ]
            found.append(tissue.step(BladeSweep(*edges), strokes.DT).wrench.force[1])
            y += 1e-4
        forces.append(found)
    assert min(forces[0]) < -1e-3
    np.testing.assert_allclose(forces[0], forces[1], atol=1e-4 * abs(min(forces[0])))


def test_a_load_moves_a_body_at_rest_and_so_does_the_end_of_the_load():
    tissue = calm_body("verlet")
    load = tissue.push([[0.015, 0.015, 0.03]], (0.0, 0.0, -0.01))
    assert tissue.step(None, strokes.DT).n_substeps > 0
    pressed = tissue.snapshot().positions
    tissue.release(load)
    assert tissue.step(None, strokes.DT).n_substeps > 0
    assert np.abs(tissue.snapshot().positions - pressed).max() > 0.0


def test_an_incision_moves_a_body_at_rest():
    tissue = calm_body("verlet")
    tissue.incise([[[-0.1, y, 0.016], [0.1, y, 0.016]] for y in (-0.01, 0.02)], (0.0, 1.0, 0.0))
    assert tissue.step(None, strokes.DT).n_substeps > 0


@pytest.mark.parametrize("relaxation", RELAXATIONS)
def test_what_lies_on_the_floor_at_rest_still_presses_with_its_weight(relaxation):
    solver = SolverSettings(relaxation=relaxation)
    tissue = Tissue(CUBE, Material(viscous_damping=40.0), floor=-1e-6, solver=solver)
    for _ in range(2500):  # after 1,500 it still creeps at 0.1 mm/s
        result = tissue.step(None, strokes.DT)
    assert result.n_substeps == 0
    weight = 9.81 * tissue.snapshot().masses.sum()
    np.testing.assert_allclose(
        result.body_contacts.force_of_floor, [0, 0, weight], atol=0.02 * weight
    )


def test_a_body_that_creeps_over_the_floor_is_not_at_rest():
    tissue = Tissue(
        CUBE, Material(viscous_damping=40.0), floor=-1e-6, solver=SolverSettings(element="plain")
    )
    for _ in range(1500):
        result = tissue.step(None, strokes.DT)
    speeds = np.linalg.norm(tissue.snapshot().velocities, axis=1)
    assert 0.0 < speeds.max() < 0.06 * tissue.node_size
    assert result.n_substeps > 0


def test_a_sliver_that_swings_by_micrometres_does_not_keep_a_body_from_rest():
    tissue = calm_body("verlet")
    tissue._stages.global_stepper.wake()
    free = np.flatnonzero(~tissue._body.fixed[: tissue.n_nodes])[0]
    for k in range(400):
        tissue._body.velocities[free] = [0.07 * tissue.node_size * (-1) ** k, 0.0, 0.0]
        result = tissue.step(None, strokes.DT)
    assert result.n_substeps == 0


def test_a_loose_piece_that_drifts_slower_than_any_limit_drifts_on():
    tissue = Tissue(CUBE, Material(), gravity=(0.0, 0.0, 0.0))
    tissue._body.velocities[: tissue.n_nodes] = [1e-6, 0.0, 0.0]
    for _ in range(500):
        tissue.step(None, strokes.DT)
    velocities = tissue.snapshot().velocities
    np.testing.assert_allclose(
        velocities, np.broadcast_to([1e-6, 0, 0], velocities.shape), atol=1e-12
    )


def test_what_is_left_of_a_motion_that_comes_to_rest_is_in_the_account():
    solver = SolverSettings(relaxation="verlet", audit=True)
    tissue = Tissue(CUBE, Material(viscous_damping=40.0), floor=-1e-6, solver=solver)
    result = tissue.step(None, strokes.DT)
    while result.n_substeps > 0:
        moving, result = result, tissue.step(None, strokes.DT)
    assert result.energies.kinetic == moving.energies.kinetic == 0.0
    assert result.energies.residual == pytest.approx(moving.energies.residual, abs=1e-15)
