"""Loads on material points and supports: momentum, statics, work, and cuts."""

import itertools

import numpy as np
import pytest

from tests.support.materials import SPRINGS
from tissue import (
    BladeSegment,
    BladeSweep,
    Hierarchical,
    Material,
    SolverSettings,
    TetrahedralMesh,
    Tissue,
    block,
    fixed_nodes,
)

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


def held(sides="left,right", *, gravity=NO_GRAVITY, material=None, **solver):
    material = material or Material(young_modulus=20e3, law="neo_hookean", viscous_damping=5.0)
    settings = SolverSettings(audit=True, **solver)
    fixed = fixed_nodes(MESH, sides)
    return Tissue(MESH, material, fixed=fixed, gravity=gravity, solver=settings)


def test_support_forces_and_weight_change_the_momentum_of_a_swinging_body():
    tissue = held("left", gravity=(0.0, 0.0, -9.81))
    weight = np.array([0.0, 0.0, -9.81]) * tissue.snapshot().masses.sum()
    dt, momenta, forces = 1e-4, [], []
    for _ in range(60):
        tissue.step(None, dt)
        body = tissue.snapshot()
        momenta.append((body.masses[:, None] * body.velocities).sum(axis=0))
        drag = 5.0 * momenta[-1]
        forces.append(tissue.support_forces().sum(axis=0) + weight - drag)
    rate = np.gradient(momenta, dt, axis=0)[1:-1]
    np.testing.assert_allclose(rate, np.array(forces)[1:-1], atol=2e-3 * np.abs(rate).max())


def test_supports_move_as_far_as_their_velocity_says():
    tissue = held()
    right = fixed_nodes(MESH, "right")
    tissue.move_supports("right", (0.05, 0.0, 0.02))
    for _ in range(10):
        tissue.step(None, DT)
    tissue.move_supports(np.flatnonzero(right), (0.0, 0.0, 0.0))
    for _ in range(5):
        tissue.step(None, DT)
    moved = tissue.snapshot().positions - MESH.positions
    np.testing.assert_allclose(moved[right], np.tile([5e-4, 0.0, 2e-4], (right.sum(), 1)))
    np.testing.assert_array_equal(moved[fixed_nodes(MESH, "left")], 0.0)


@pytest.mark.parametrize(
    "solver",
    [{"relaxation": "global"}, {"relaxation": "verlet"}],
    ids=lambda solver: solver["relaxation"],
)
@pytest.mark.parametrize("law", ["neo_hookean", "springs"])
def test_the_work_of_supports_is_found_again_in_the_account(law, solver):
    ratio = 0.25 if law == "springs" else 0.45
    material = Material(
        young_modulus=20e3,
        poisson_ratio=ratio,
        law=law,
        viscous_damping=5.0,
        retardation_time=1e-3,
    )
    tissue = held(material=material, gravity=(0.0, 0.0, -9.81), **solver)
    for i in range(60):
        speed = 0.1 * np.sin(np.pi * i / 30)
        tissue.move_supports("right", (speed, 0.0, 0.5 * speed))
        energies = tissue.step(None, DT).energies
        if i == 29:
            pulled = energies
    assert pulled.work_of_supports > 1e-4 and pulled.damping > 0.01 * pulled.work_of_supports
    for found in (pulled, energies):
        assert abs(found.residual) < 5e-3 * pulled.work_of_supports


def test_supports_stop_when_the_body_settles():
    tissue = held()
    tissue.move_supports("right", (0.05, 0.0, 0.0))
    tissue.step(None, DT)
    tissue.settle()
    before = tissue.snapshot().positions
    assert tissue.step(None, DT).energies.work_of_supports == 0.0
    right = fixed_nodes(MESH, "right")
    np.testing.assert_array_equal(tissue.snapshot().positions[right], before[right])


def test_nodes_that_a_blade_puts_into_a_moving_support_move_with_it():
    tissue = held("front,back")
    tissue.move_supports("front,back", (0.0, 0.0, 0.01))
    n = tissue.n_nodes
    forward = np.array([0.0, 1.0, 0.0])
    tips = [np.array([0.0153, -0.003 + 0.0002 * i, -0.005]) for i in range(140)]
    up = np.array([0.0, 0.0, 0.04])
    poses = [BladeSegment(tip, tip + up, forward) for tip in tips]
    for t0, t1 in itertools.pairwise(poses):
        tissue.step(BladeSweep(t0, t1), DT)
    body = tissue.snapshot()
    new = np.flatnonzero(body.fixed[n:]) + n
    assert new.size > 4
    np.testing.assert_allclose(body.velocities[new], np.tile([0.0, 0.0, 0.01], (new.size, 1)))
    old = np.flatnonzero(body.fixed[:n])
    np.testing.assert_allclose(
        body.positions[old, 2] - body.rest_positions[old, 2], 139 * DT * 0.01, atol=1e-9
    )


@pytest.mark.parametrize(
    ("where", "velocity", "expected"),
    [
        ("right", (0.0, 0.0, 1.0), "no node of the region 'right' is fixed"),
        ("lfet", (0.0, 0.0, 1.0), "Did you mean 'left'"),
        (40, (0.0, 0.0, 1.0), "node 40 is not fixed"),
        (-1, (0.0, 0.0, 1.0), "no node -1"),
        (np.zeros(3, dtype=bool), (0.0, 0.0, 1.0), "mask of a region has shape"),
        ("left", (0.0, 1.0), "three finite numbers in m/s"),
        ("left", (0.0, np.nan, 1.0), "three finite numbers in m/s"),
    ],
)
def test_a_motion_that_makes_no_sense_is_refused(where, velocity, expected):
    tissue = held("left")
    with pytest.raises(ValueError, match=expected):
        tissue.move_supports(where, velocity)


def test_the_hierarchical_relaxation_refuses_to_move_supports():
    solver = SolverSettings(relaxation=Hierarchical())
    tissue = Tissue(MESH, SPRINGS, fixed=fixed_nodes(MESH, "left"), solver=solver)
    with pytest.raises(ValueError, match="'global' or 'verlet'"):
        tissue.move_supports("left", (0.0, 0.0, 0.01))


def test_supports_bear_what_keeps_a_flat_tetrahedron_from_turning_over():
    """The supports give the free node all of the momentum that it gains."""
    corners = 0.01 * np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.3, 0.3, 0.8]])
    tissue = Tissue(
        TetrahedralMesh(corners, np.array([[0, 1, 2, 3]])),
        Material(law="springs", poisson_ratio=0.25, viscous_damping=0.0, retardation_time=0.0),
        fixed=np.array([True, True, True, False]),
        positions=corners * [1.0, 1.0, 0.2],
        gravity=(0.0, 0.0, 0.0),
    )
    tissue.step(None, 1e-6)
    begin, held = tissue.snapshot().velocities[3], tissue.support_forces().sum(axis=0)
    tissue.step(None, 1e-6)
    gained = (tissue.snapshot().velocities[3] - begin) / 1e-6
    mass = tissue._body.masses[3]
    np.testing.assert_allclose(held, mass * gained, rtol=1e-3)
