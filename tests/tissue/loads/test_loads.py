"""Loads on material points: momentum, statics, work, and cuts."""

import numpy as np
import pytest

from tests.support import bodies
from tests.support.materials import SPRINGS
from tissue import Hierarchical, Material, SolverSettings, Tissue, block, fixed_nodes

SIZE = (0.04, 0.02, 0.02)
MESH = block((6, 3, 3), SIZE)
NO_GRAVITY = (0.0, 0.0, 0.0)
FORCE = np.array([0.02, -0.01, 0.03])
DT = 1e-3
GEL = Material(young_modulus=20e3, poisson_ratio=0.0, law="neo_hookean", viscous_damping=0.0)

PLACES = {
    "side": "right",
    "mask": fixed_nodes(MESH, "top"),
    "node": 5,
    "nodes": [1, 7, 30],
    "point": (0.0123, 0.011, 0.0042),
    "points": [(0.0123, 0.011, 0.0042), (0.031, 0.002, 0.02)],
}


def free_body(law="neo_hookean", **solver):
    material = Material(law=law, viscous_damping=0.0)
    return Tissue(MESH, material, gravity=NO_GRAVITY, solver=SolverSettings(**solver))


def momentum(tissue):
    body = tissue.snapshot()
    p = body.masses[:, None] * body.velocities
    return p.sum(axis=0), np.cross(body.positions, p).sum(axis=0)


@pytest.mark.parametrize("relaxation", ["global", "verlet"])
@pytest.mark.parametrize("place", PLACES)
def test_a_push_gives_its_impulse_and_its_moment(place, relaxation):
    tissue = free_body(relaxation=relaxation)
    load = tissue.push(PLACES[place], FORCE)
    arm = (load.points.shares[:, None] * tissue.positions_of(load.points)).sum(axis=0)
    for _ in range(3):
        tissue.step(None, DT)
    linear, angular = momentum(tissue)
    np.testing.assert_allclose(linear, 3 * DT * FORCE, rtol=1e-12)
    # The points have moved by less than 0.02 mm, a thousandth of their distances.
    np.testing.assert_allclose(angular, 3 * DT * np.cross(arm, FORCE), atol=2e-3 * 3 * DT * 0.001)


@pytest.mark.parametrize("relaxation", ["global", "verlet", Hierarchical(far="moved")])
def test_a_body_whose_nodes_are_pushed_with_their_weight_moves_as_in_gravity(relaxation):
    solver, fixed = SolverSettings(relaxation=relaxation), fixed_nodes(MESH, "left")
    falling = Tissue(MESH, SPRINGS, fixed=fixed, solver=solver)
    pushed = Tissue(MESH, SPRINGS, fixed=fixed, gravity=NO_GRAVITY, solver=solver)
    weights = pushed.snapshot().masses[:, None] * (0.0, 0.0, -9.81)
    pushed.push(np.arange(pushed.n_nodes), weights)
    for _ in range(20):
        falling.step(None, DT)
        pushed.step(None, DT)
    fallen, moved = (t.snapshot().positions - MESH.positions for t in (falling, pushed))
    assert fallen[:, 2].min() < -1e-3
    np.testing.assert_allclose(moved, fallen, atol=1e-12)


def test_forces_on_single_points_add_up_and_turn_the_body():
    tissue = free_body()
    couple = np.array([[0.0, 0.0, 0.01], [0.0, 0.0, -0.01]])
    load = tissue.push([(0.0, 0.01, 0.01), (0.04, 0.01, 0.01)], couple)
    np.testing.assert_array_equal(load.force, [0.0, 0.0, 0.0])
    tissue.step(None, DT)
    linear, angular = momentum(tissue)
    np.testing.assert_allclose(linear, 0.0, atol=1e-18)
    np.testing.assert_allclose(angular, [0.0, 0.04 * 0.01 * DT, 0.0], atol=1e-3 * 4e-7)


def test_a_pulled_bar_is_longer_by_force_times_length_over_stiffness_and_area():
    tissue = Tissue(MESH, GEL, fixed=fixed_nodes(MESH, "left"), gravity=NO_GRAVITY)
    force = 0.01 * GEL.young_modulus * SIZE[1] * SIZE[2]
    points = tissue.push("right", (force, 0.0, 0.0)).points
    tissue.settle()
    longer = (tissue.positions_of(points) - points.rest)[:, 0]
    assert float(points.shares @ longer) == pytest.approx(0.01 * SIZE[0], rel=0.02)
    np.testing.assert_allclose(longer, longer.mean(), rtol=0.01)  # the traction is even
    held = tissue.support_forces()
    assert not held[~tissue.snapshot().fixed].any()
    np.testing.assert_allclose(held.sum(axis=0), [-force, 0.0, 0.0], atol=2e-3 * force)


@pytest.mark.parametrize("relaxation", ["global", "verlet"])
def test_the_work_of_a_load_is_found_again_in_the_account(relaxation):
    material = Material(young_modulus=20e3, law="neo_hookean", viscous_damping=5.0)
    solver = SolverSettings(relaxation=relaxation, audit=True)
    fixed = fixed_nodes(MESH, "left")
    tissue = Tissue(MESH, material, fixed=fixed, gravity=NO_GRAVITY, solver=solver)
    load = tissue.push("right", (0.3, 0.0, -0.1))
    for _ in range(40):
        energies = tissue.step(None, DT).energies
    load.force = (0.0, 0.1, 0.0)
    for _ in range(20):
        energies = tissue.step(None, DT).energies
    assert energies.work_of_loads > 1e-4 and energies.damping > 0.0
    stored = energies.elastic + energies.kinetic + energies.damping
    assert stored == pytest.approx(energies.work_of_loads, rel=5e-3)
    assert abs(energies.residual) < 5e-3 * energies.work_of_loads


def test_a_load_ends_when_it_is_released():
    tissue = free_body()
    load = tissue.push("top", FORCE)
    tissue.step(None, DT)
    tissue.release(load)
    tissue.step(None, DT)
    np.testing.assert_allclose(momentum(tissue)[0], DT * FORCE, rtol=1e-12)
    with pytest.raises(ValueError, match="released"):
        tissue.release(load)


def test_each_side_of_a_cut_keeps_its_part_of_a_load():
    tissue = free_body()
    x = 0.0153  # between planes of the mesh
    load = tissue.push("top", FORCE)
    rest = load.points.rest
    edges = [[(x, y, -0.01), (x, y, 0.03)] for y in (-0.005, 0.025)]
    assert tissue.incise(edges, (0.0, 1.0, 0.0)) == pytest.approx(4e-4, rel=0.05)
    assert tissue.n_pieces() == 2
    tissue.step(None, DT)
    body, of_nodes = tissue.snapshot(), tissue._model.stages.loads
    for k, piece in enumerate(tissue.pieces()):
        nodes = np.unique(body.tetrahedra[tissue.piece_of_tetrahedra() == k])
        is_own = (rest[:, 0] > x) == (piece.centre[0] > x)
        forces, arms = load.forces[is_own], rest[is_own]
        np.testing.assert_allclose(of_nodes[nodes].sum(axis=0), forces.sum(axis=0), rtol=1e-12)
        moment = np.cross(body.rest_positions[nodes], of_nodes[nodes]).sum(axis=0)
        np.testing.assert_allclose(moment, np.cross(arms, forces).sum(axis=0), atol=1e-15)


def test_material_points_go_with_the_material_through_cuts():
    tissue = free_body()
    rest = np.random.default_rng(0).uniform(0.001, 0.019, (40, 3)) * (2.0, 1.0, 1.0)
    points = tissue.material_points(rest)
    np.testing.assert_allclose(tissue.positions_of(points), rest, atol=1e-12)
    edges = [[(0.0153, y, -0.01), (0.0192, y, 0.03)] for y in (-0.005, 0.025)]
    tissue.incise(edges, (0.0, 1.0, 0.0))
    np.testing.assert_allclose(tissue.positions_of(points), rest, atol=1e-12)


@pytest.mark.parametrize(
    ("where", "force", "expected"),
    [
        ("rihgt", FORCE, "Did you mean 'right'"),
        (999, FORCE, "no node 999"),
        ([], FORCE, "all finite"),
        ((0.0, 0.0, 0.03), FORCE, "outside the body at rest"),
        ((0.0, np.nan, 0.0), FORCE, "all finite"),
        (np.zeros(3, dtype=bool), FORCE, "mask of a region has shape"),
        ("0.01,0.005,0.005:0.03,0.015,0.015", FORCE, "no face of the skin"),
        ("right", (0.0, 1.0), "three finite numbers in N"),
        ("right", (0.0, 1.0, np.inf), "three finite numbers in N"),
    ],
)
def test_a_push_that_makes_no_sense_is_refused(where, force, expected):
    with pytest.raises(ValueError, match=expected):
        free_body().push(where, force)


def test_a_body_without_loads_moves_as_it_did():
    one, two = free_body(), free_body()
    load = two.push("top", FORCE)
    two.release(load)
    for tissue in (one, two):
        tissue._body.velocities[: tissue.n_nodes] = bodies.jittered_grid(1, 0).positions[0] + 0.1
        tissue.step(None, DT)
    np.testing.assert_array_equal(one.snapshot().positions, two.snapshot().positions)
