"""Several bodies in one tissue: what lies on another, slides on it, and is cut with it."""

import numpy as np
import pytest

from tests.support import strokes
from tests.support.bodies import sides
from tests.support.overlaps import overlap_depth
from tissue import (
    FloatArray,
    Material,
    SolverSettings,
    Tissue,
    Verlet,
    block,
    fixed_nodes,
    joined,
    placed,
)

SOFT = Material(young_modulus=30e3, toughness=20.0)
TOUGH = Material(young_modulus=60e3, toughness=60.0, density=1200.0)
LOW = block((8, 8, 2), (0.04, 0.04, 0.01))
HIGH = block((7, 6, 3), (0.035, 0.03, 0.012))
STACK = {"low": LOW, "high": placed(HIGH, (0.0031, 0.0047, 0.01))}
GRAVITY, NO_GRAVITY = 9.81, (0.0, 0.0, 0.0)


def stacked(**options) -> Tissue:
    """Return a block that lies on another, of which the underside is held."""
    mesh = joined(STACK)
    fixed = fixed_nodes(mesh, "bottom", "low")
    return Tissue(mesh, {"low": SOFT, "high": TOUGH}, **{"fixed": fixed} | options)


def nodes_of(tissue: Tissue, body: str) -> FloatArray:
    """Return the numbers of the nodes of a body now."""
    mesh = tissue.snapshot()
    (label,) = (number for number, name in tissue.label_names.items() if name == body)
    return np.unique(mesh.tetrahedra[tissue.labels() == label])


def momentum_of(tissue: Tissue, body: str) -> FloatArray:
    """Return the momentum of a body [N s]."""
    now, nodes = tissue.snapshot(), nodes_of(tissue, body)
    return (now.masses[nodes, None] * now.velocities[nodes]).sum(axis=0)


def test_what_is_held_carries_what_lies_on_it():
    """Both weights, and it stays as it has settled: the contact is not found anew."""
    tissue = stacked(gravity=(0.0, 0.0, -GRAVITY))
    tissue.settle()
    volumes = {name: np.ptp(mesh.positions, axis=0).prod() for name, mesh in STACK.items()}
    weight = GRAVITY * (volumes["low"] * SOFT.density + volumes["high"] * TOUGH.density)
    assert tissue.support_forces().sum(axis=0)[2] == pytest.approx(weight, rel=1e-4)
    assert overlap_depth(tissue.snapshot()) < 10e-6
    before = tissue.snapshot().positions
    for _ in range(50):
        touching = tissue.step(None, strokes.DT).body_contacts
    borne = GRAVITY * volumes["high"] * TOUGH.density
    assert touching.force == pytest.approx(borne, rel=0.01)
    assert np.abs(tissue.snapshot().positions - before).max() < 1e-6


@pytest.mark.parametrize(("degrees", "slides"), [(10.0, False), (30.0, True)])
def test_a_body_slides_on_another_as_friction_of_0_3_says(degrees, slides):
    angle, instants = np.radians(degrees), 0.02 + 0.06 * np.arange(2)
    tissue = stacked(gravity=GRAVITY * np.array([np.sin(angle), 0.0, -np.cos(angle)]))
    mass = tissue.snapshot().masses[nodes_of(tissue, "high")].sum()
    speeds = []
    for frame in range(1, 81):
        tissue.step(None, strokes.DT)
        if round(frame * strokes.DT, 3) in instants:
            speeds.append(momentum_of(tissue, "high")[0] / mass)
    free = GRAVITY * (np.sin(angle) - 0.3 * np.cos(angle))
    found = (speeds[1] - speeds[0]) / np.ptp(instants)
    assert found == pytest.approx(free if slides else 0.0, abs=0.05 * GRAVITY)
    assert overlap_depth(tissue.snapshot()) < 0.1e-3


def test_the_upper_of_two_bodies_is_lifted_off():
    tissue = stacked(gravity=(0.0, 0.0, -GRAVITY))
    tissue.settle()
    top = fixed_nodes(joined(STACK), "top", "high")
    held = tissue.attach(top, stiffness=500.0, damping=0.5)
    held.move(tissue.snapshot().positions[top].mean(axis=0) + np.array([0.0, 0.0, 0.005]))
    tissue.settle()
    mass = tissue.snapshot().masses[nodes_of(tissue, "high")].sum()
    np.testing.assert_allclose(held.wrench.force, 0.0)  # of the last step: there was none
    assert tissue.step(None, strokes.DT).body_contacts.force == 0.0
    np.testing.assert_allclose(held.wrench.force, [0.0, 0.0, -GRAVITY * mass], atol=1e-3)


def test_a_stroke_through_two_bodies_costs_the_sum_of_toughness_times_depth():
    mesh = joined({"low": LOW, "high": placed(LOW, (0.0, 0.0, 0.01))})
    held = [fixed_nodes(mesh, "left,right", name) for name in ("low", "high")]
    tissue = Tissue(
        mesh,
        {"low": SOFT, "high": TOUGH},
        fixed=held[0] | held[1],
        gravity=NO_GRAVITY,
        solver=SolverSettings(audit=True),
    )
    poses = strokes.upright(0.0187, -0.004, 0.054, -0.004, 0.026, 0.1)
    results = strokes.make(tissue, poses)
    y = np.array([pose.tip[1] for pose in poses[1:]])
    force = -np.array([result.wrench.force[1] for result in results])
    steady = force[(y > 0.015) & (y < 0.033)].mean()
    assert steady == pytest.approx((20.0 + 60.0) * 0.01, rel=0.05)
    assert tissue.n_pieces() == 4
    last = results[-1].energies
    assert last.cutting == pytest.approx((20.0 + 60.0) * 0.01 * 0.04, rel=0.02)
    assert abs(last.residual) < 0.02 * last.work_of_blade


def test_welded_bodies_are_cut_as_one_body_of_the_same_mesh():
    """Nodes and tetrahedra have other numbers: sums differ by rounding, and grow as they go on."""
    two = joined({"low": LOW, "high": placed(LOW, (0.0, 0.0, 0.01))}, weld=["high"])
    solver = SolverSettings(precision="double")
    poses = strokes.upright(0.0187, -0.004, 0.054, -0.004, 0.026, 0.1)
    forces, areas = [], []
    for mesh in (block((8, 8, 4), (0.04, 0.04, 0.02)), two):
        tissue = Tissue(mesh, SOFT, fixed=sides(mesh), solver=solver)
        results = strokes.make(tissue, poses)
        forces.append([result.wrench.force for result in results])
        areas.append(sum(result.cut_area for result in results))
        assert tissue.n_pieces() == 2
    np.testing.assert_allclose(forces[0][:60], forces[1][:60], atol=1e-9)
    assert areas[0] == pytest.approx(areas[1], rel=1e-4)


def test_bodies_are_the_same_bits_on_threads_and_after_a_state_was_loaded():
    poses = strokes.upright(0.0187, -0.004, 0.02, -0.004, 0.026, 0.1)
    found = []
    for threads in (1, 2):
        tissue = stacked(solver=SolverSettings(threads=threads, relaxation=Verlet()))
        tissue.settle()
        state = tissue.save_state()
        for _ in range(2):
            tissue.load_state(state)
            strokes.make(tissue, poses)
            found.append(tissue.snapshot().positions)
    for each in found[1:]:
        np.testing.assert_array_equal(found[0], each)
