"""Every relaxation gives the same equilibrium, cutting force and conservation of momentum."""

from dataclasses import replace

import numpy as np
import pytest

from tests.support import bodies, strokes
from tests.support.materials import SPRINGS
from tests.system.energy.test_conservation import NO_GRAVITY, SLAB
from tissue import Hierarchical, Material, SolverSettings, Tissue, block
from tissue.integrators.bielser_1998 import stepper
from tissue.integrators.bielser_1998.stepper import ring_steps

HIERARCHICAL = Hierarchical(updates=16, rings=3)

LAWS = {
    "springs": replace(SPRINGS, viscous_damping=60.0),
    "springs and volumes": Material(viscous_damping=60.0, law="springs", poisson_ratio=0.4),
    "tetrahedra": Material(viscous_damping=60.0, law="neo_hookean", poisson_ratio=0.4),
}
"""Materials with strong drag, so that a body comes to rest within a second."""


def sagged_body(mesh, material, relaxation, seconds=1.0):
    """Return a body held at two sides that has sagged for `seconds`."""
    tissue = Tissue(
        mesh, material, fixed=bodies.sides(mesh), solver=SolverSettings(relaxation=relaxation)
    )
    for _ in range(round(seconds / strokes.DT)):
        tissue.step(None, strokes.DT)
    return tissue


@pytest.mark.parametrize(
    ("relaxation", "law"),
    [*(("verlet", law) for law in LAWS), (HIERARCHICAL, "springs")],
    ids=str,
)
def test_the_equilibrium_is_that_of_global_relaxation(relaxation, law):
    mesh = bodies.jittered(3, 0)
    expected, found = (sagged_body(mesh, LAWS[law], choice) for choice in ("global", relaxation))
    apart = np.abs(found.snapshot().positions - expected.snapshot().positions).max()
    sag = np.abs(expected.snapshot().positions - mesh.positions).max()
    assert sag > 1e-4
    assert apart < 1e-6 * 0.04


CHOICES = {"hierarchical": HIERARCHICAL, "verlet": "verlet"}


@pytest.mark.parametrize("relaxation", CHOICES.values(), ids=CHOICES)
def test_the_cutting_force_is_toughness_times_length(relaxation):
    mesh = block((6, 12, 3), SLAB)
    tissue = Tissue(
        mesh,
        SPRINGS,
        fixed=bodies.sides(mesh),
        gravity=NO_GRAVITY,
        solver=SolverSettings(relaxation=relaxation),
    )
    stroke = strokes.upright(0.0213, -0.004, 0.06, -0.005, 0.025, 0.1)
    results = strokes.make(tissue, stroke)
    middle = [r for r, at in zip(results, stroke[1:], strict=True) if 0.035 < at.tip[1] < 0.055]
    force = -np.mean([r.wrench.force[1] for r in middle])
    length = np.mean([r.anchored_length for r in middle])
    assert length == pytest.approx(SLAB[2], rel=0.05)
    assert force == pytest.approx(20.0 * length, rel=0.02)
    apart = [r.wrench.force + r.force_on_tissue for r in results]
    assert np.abs(apart).max() < 1e-12


@pytest.mark.parametrize("law", LAWS)
def test_the_force_of_a_cut_by_verlet_is_that_by_runge_kutta_within_a_hundredth(law):
    """The mean over the middle of a straight cut, and the sum over all of it."""
    mesh = block((6, 12, 3), SLAB)
    stroke = strokes.upright(0.0213, -0.004, 0.06, -0.005, 0.025, 0.1)
    forces = []
    for relaxation in ("global", "verlet"):
        tissue = Tissue(
            mesh,
            LAWS[law],
            fixed=bodies.sides(mesh),
            gravity=NO_GRAVITY,
            solver=SolverSettings(relaxation=relaxation),
        )
        forces.append(np.array([r.wrench.force[1] for r in strokes.make(tissue, stroke)]))
    expected, found = forces
    at = np.array([pose.tip[1] for pose in stroke[1:]])
    middle = (at > 0.035) & (at < 0.055)
    assert found[middle].mean() == pytest.approx(expected[middle].mean(), rel=0.01)
    assert found.sum() == pytest.approx(expected.sum(), rel=0.01)


def test_a_cut_between_fixed_nodes_creates_no_false_contacts():
    """Nodes that a cut makes between fixed ones never move; contact must know their positions.

    A past error took them to have moved from the origin, through everything in between.
    """
    mesh = block((4, 4, 4), (0.04, 0.04, 0.04))
    mesh = mesh._replace(positions=mesh.positions + 0.1)
    held = mesh.positions[:, 2] < 0.115
    material = Material(viscous_damping=20.0, toughness=2.0)
    solver = SolverSettings(relaxation="verlet")
    tissue = Tissue(mesh, material, fixed=held, gravity=NO_GRAVITY, solver=solver)
    strokes.make(tissue, strokes.straight(mesh, 0.3))  # from here on lips may touch
    results = strokes.make(tissue, strokes.straight(mesh, 0.7))
    new_fixed = tissue.snapshot().fixed[len(mesh.positions) :]
    assert new_fixed.any()
    speed = np.linalg.norm(tissue.snapshot().velocities, axis=1).max()
    assert speed < 0.05
    assert max(r.body_contacts.penetration for r in results) < 1e-3


def test_in_the_paper_s_block_every_ring_takes_the_steps_of_equation_7(monkeypatch):
    """A cut by the paper's scheme and relaxation: I 2^-s steps, none more for stability."""
    taken = set()

    def noted(options, needed):
        n, every = ring_steps(options, needed)
        taken.add((options.updates, *(n // every).tolist()))
        return n, every

    monkeypatch.setattr(stepper, "ring_steps", noted)
    mesh = block((4, 6, 4), (0.04, 0.06, 0.04))
    solver = SolverSettings(scheme="paper", relaxation="paper")
    tissue = Tissue(mesh, SPRINGS, fixed=bodies.sides(mesh), solver=solver)
    strokes.make(tissue, strokes.upright(0.0152, -0.005, 0.08, 0.012, 0.045))
    assert tissue.scheme_statistics().n_cut > 100
    assert taken == {(64, 64, 32, 16, 8, 4, 2, 1)}  # the last ones are frozen


def test_with_the_paper_s_relaxation_nodes_far_from_the_blade_stay_where_they_are():
    mesh = block((2, 12, 2), (0.02, 0.12, 0.02))
    solver = SolverSettings(relaxation="paper")
    tissue = Tissue(mesh, SPRINGS, fixed=bodies.sides(mesh), solver=solver)
    before = tissue.snapshot().positions
    strokes.make(tissue, strokes.upright(0.0077, -0.005, 0.005, 0.01, 0.03))
    moved = np.abs(tissue.snapshot().positions[: len(before)] - before).max(axis=1) > 0.0
    assert moved[mesh.positions[:, 1] < 0.015].any()
    assert not moved[mesh.positions[:, 1] > 0.1].any()
