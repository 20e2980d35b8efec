"""Lips touch from the instant at which they part, while the blade is still between them."""

import itertools

import numpy as np
import pytest

from scalpel_sim.scene.scene import GEL
from tests.support import bodies, strokes
from tests.support.overlaps import ELEMENT, NO_GRAVITY, overlap_depths
from tests.system.energy.test_conservation import momentum
from tissue import BladeSweep, FloatArray, Material, SolverSettings, TetrahedralMesh, Tissue, block


@pytest.mark.parametrize("settles", [False, True])
def test_a_floor_far_below_changes_no_bit_of_a_cut(settles):
    def run(floor: float | None) -> tuple[FloatArray, FloatArray]:
        mesh = block((3, 3, 3), (0.03,) * 3)
        tissue = Tissue(mesh, GEL, fixed=bodies.sides(mesh), floor=floor)
        if settles:
            tissue.settle()
        results = strokes.make(tissue, strokes.straight(mesh))
        assert max(result.body_contacts.n_contacts for result in results) > 5
        return np.array([result.wrench.force for result in results]), tissue.snapshot().positions

    for one, other in zip(run(-10.0), run(None), strict=True):
        np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize(("element", "most"), [("plain", 0.005), ("averaged", 0.02)])
def test_lips_of_a_squeezed_block_overlap_no_more_with_the_blade_between_them_than_later(
    element, most
):
    """Contact as forces leaves 10 to 40 um in the median; without contact it is up to 1.4 mm.

    Averaged shear yields more where lips are crumpled: 0.17 mm in the first of the frames.
    """
    at, mesh = 0.37, block((4, 4, 4), (0.04,) * 3)
    squeezed, solver = mesh.positions * (0.9, 1.0, 1.0), SolverSettings(element=element)
    tissue = Tissue(mesh, GEL, fixed=bodies.sides(mesh), positions=squeezed, solver=solver)
    tissue.settle()
    moved = TetrahedralMesh(tissue.snapshot().positions, mesh.tetrahedra)
    meanwhile, later = [], []
    for i, sweep in enumerate([*strokes.sweeps(strokes.straight(moved, at)), *[None] * 50]):
        result = tissue.step(sweep, strokes.DT)
        if i % 10 > 0 or result.cut_area < 4e-4:
            continue
        body = tissue.snapshot()
        middles = tissue._body.rest[body.tetrahedra].mean(axis=1)
        depths = overlap_depths(body, (middles[:, 0] > at * 0.04).astype(np.int64))
        held = result.anchored_length > 0.0
        # A sliver beside the cut may be taken for the other half: not the deepest, but the median.
        (meanwhile if held else later).append(np.median(depths))
        assert not held or result.body_contacts.n_contacts > 10
    assert len(meanwhile) > 8 and len(later) > 5
    assert max(meanwhile) < max(most * ELEMENT, 1.2 * max(later))


def free_block(law, relaxation):
    """Return a block that nothing holds, without drag: only the blade changes its momenta."""
    ratio = 0.25 if law == "springs" else 0.45
    material = Material(
        10e3,
        density=4e3,
        law=law,
        poisson_ratio=ratio,
        toughness=10.0,
        blade_friction=0.3,
        viscous_damping=0.0,
    )
    solver = SolverSettings(relaxation=relaxation)
    return Tissue(bodies.jittered(3, 0), material, gravity=NO_GRAVITY, solver=solver)


@pytest.mark.parametrize("law", ["neo_hookean", "springs"])
@pytest.mark.parametrize(
    ("relaxation", "swing", "waves", "speed", "largest"),
    [
        pytest.param("global", 0.003, 75.0, 0.3, 1e-9, id="to the order of the integrator"),
        pytest.param("verlet", 0.004, 300.0, 0.5, 1e-12, id="to rounding"),
    ],
)
def test_lips_beside_the_blade_neither_push_nor_turn_a_free_block(
    law, relaxation, swing, waves, speed, largest
):
    """Force and torque on a blade that cuts a wavy line are what the momenta of the nodes lose.

    `swing` [m] and `waves` [rad/m] of the line, `speed` [m/s], and `largest` moment [N m].
    """
    dt, tissue = 1e-4, free_block(law, relaxation)
    y = np.arange(-0.003, 0.02, speed * dt)
    x = 0.0203 + swing * np.sin(waves * y)
    line = [strokes.pose((a, b, -0.01), (a, b, 0.05), strokes.Y) for a, b in zip(x, y, strict=True)]
    n_touching, before = 0, momentum(tissue)
    for sweep in itertools.starmap(BladeSweep, itertools.pairwise(line)):
        result = tissue.step(sweep, dt)
        after = momentum(tissue)
        force, torque, point = result.wrench
        moment = torque + np.cross(point, force)
        assert np.abs((after[0] - before[0]) / dt + force).max() < 1e-11
        assert np.abs((after[1] - before[1]) / dt + moment).max() < largest
        n_touching += result.anchored_length > 0.0 and result.body_contacts.n_contacts > 0
        before = after
    assert n_touching > 40


CELL = 0.004
"""Edge of the cells [m]; a node size is 2.8 mm."""


def bracket(gap: float) -> TetrahedralMesh:
    """Return two arms of 80 mm, 8 mm thick and a gap [m] apart, that a web joins at low x."""
    height = 0.016 + gap
    mesh = block((20, 3, round(height / CELL)), (0.08, 0.012, height))
    x, _, z = mesh.positions[mesh.tetrahedra].mean(axis=1).T
    corners = mesh.tetrahedra[(x < 0.016) | (np.abs(z - 0.5 * height) > 0.5 * gap)]
    used, kept = np.unique(corners, return_inverse=True)
    return TetrahedralMesh(mesh.positions[used], kept.reshape(-1, 4))


def fallen(gap: float, solver: SolverSettings) -> tuple[Tissue, float]:
    """Drop the upper arm on the lower one; return the body and how low it came [m]."""
    mesh = bracket(gap)
    held, arm = mesh.positions[:, 2] < 1e-6, mesh.positions[:, 2] > 0.0079 + gap
    tissue = Tissue(mesh, GEL, fixed=held, solver=solver)
    lowest = np.inf
    for _ in range(200):
        tissue.step(None, strokes.DT)
        x, y, z = tissue.snapshot().positions[arm].T
        is_over = (x > 0.02) & (x < 0.078) & (y > 0.0) & (y < 0.012)
        lowest = min(lowest, z[is_over].min())
    return tissue, lowest


@pytest.mark.parametrize("relaxation", ["global", "verlet"])
@pytest.mark.parametrize("gap", [0.004, 0.012, 0.032])
def test_an_arm_that_falls_on_another_of_the_same_piece_stays_on_it(gap, relaxation):
    """The upper arm would sag by 0.4 m, and hits the lower one at up to a metre a second.

    The gaps are 1.4, 4 and 11 node sizes. The lower arm is 8 mm thick, and gives way.
    """
    _, lowest = fallen(gap, SolverSettings(relaxation=relaxation))
    assert 0.0055 < lowest < 0.009


def test_edges_of_one_piece_are_not_tested_against_each_other():
    """A limit: docs/contact.md names it. Nodes hold the arm here."""
    tissue, _ = fallen(0.012, SolverSettings())
    contact = tissue._model.contact
    assert contact.forces.n_contacts > 5
    assert contact.search.edge_pairs.n_pairs == 0
