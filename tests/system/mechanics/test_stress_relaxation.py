"""The stress of held tissue relaxes: whole bodies, against Fung's law."""

import math
from dataclasses import replace

import numpy as np
import pytest

from tests.support import bodies, strokes
from tests.tissue.solids import evaluate
from tissue import (
    MATERIALS,
    Material,
    SolverSettings,
    TetrahedralMesh,
    Tissue,
    block,
    fixed_nodes,
    liver_lobe,
)
from tissue.blade.edge import NOWHERE
from tissue.laws.energy_density import SHARE_OF_NODES

NO_GRAVITY = (0.0, 0.0, 0.0)
PRONY = ((0.3, 0.1), (0.2, 2.0))
SOFT = Material(law="neo_hookean", poisson_ratio=0.45, prony=PRONY)
LAWS = {
    "neo_hookean": SOFT,
    "exponential": Material(law="exponential", poisson_ratio=0.45, stiffening=8.0, prony=PRONY),
    "yeoh": Material(law="yeoh", poisson_ratio=0.45, yeoh_second=1.0, yeoh_third=1.0, prony=PRONY),
}
STRAIN = np.array([[1.1, 0.2, 0.0], [0.05, 0.9, 0.1], [0.0, -0.1, 1.05]])


def kept(seconds):
    """Return G(t)."""
    return 1.0 - sum(g * -math.expm1(-seconds / tau) for g, tau in PRONY)


def forces(tissue):
    """Return the forces of the tetrahedra on the nodes [N]."""
    body, out = tissue._body, np.zeros((tissue.n_nodes, 3))
    evaluate(tissue._model.elasticity.arrays.solid, body, body.positions, out)
    return out


def held(material=SOFT, mesh=None, **solver):
    """Return a block whose nodes are all held in the same strain."""
    mesh = mesh or bodies.jittered(3, 1)
    return Tissue(
        mesh,
        material,
        positions=mesh.positions @ STRAIN.T,
        fixed=np.ones(len(mesh.positions), dtype=bool),
        gravity=NO_GRAVITY,
        solver=SolverSettings(**solver),
    )


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(
    ("law", "relaxation"), [*((law, "global") for law in LAWS), ("neo_hookean", "verlet")]
)
def test_the_force_of_a_held_body_falls_by_the_prony_series(law, relaxation):
    tissue = held(LAWS[law], relaxation=relaxation)
    at_first = forces(tissue)
    largest = np.abs(at_first).max()
    for n_steps, dt in ((50, 1e-3), (20, 5e-3), (5, 0.3)):
        for _ in range(n_steps):
            tissue.step(None, dt)
        seconds = {50: 0.05, 20: 0.15, 5: 1.65}[n_steps]
        assert np.abs(forces(tissue) - kept(seconds) * at_first).max() < 1e-9 * largest


# A punch of 10 x 10 mm, pressed 4 mm into the top of a cube of 40 mm that is held below.

PUNCHED = block((8, 8, 8), (0.04, 0.04, 0.04))


def punch_and_bottom():
    """Return masks of the nodes under the punch and of those of the bottom."""
    x, y, z = PUNCHED.positions.T
    is_under = (abs(x - 0.02) < 0.0051) & (abs(y - 0.02) < 0.0051) & (z > 0.04 - 1e-9)
    return is_under, z < 1e-9


def dented(material, positions):
    """Return the cube with the punch and the bottom held."""
    return Tissue(
        PUNCHED,
        material,
        positions=positions,
        fixed=np.logical_or(*punch_and_bottom()),
        gravity=NO_GRAVITY,
    )


def test_the_force_on_a_punch_that_is_held_falls_by_the_prony_series():
    """The tissue beside the punch is free; all stress relaxes alike, so that it stays."""
    punch, bottom = punch_and_bottom()
    assert (punch.sum(), bottom.sum()) == (9, 81)
    pressed = PUNCHED.positions - np.outer(punch, (0.0, 0.0, 0.004))
    elastic = dented(Material(law="neo_hookean", poisson_ratio=0.45), pressed)
    elastic.settle()
    tissue = dented(SOFT, elastic.snapshot().positions)
    at_first = forces(tissue)[punch, 2].sum()
    assert at_first > 0.1
    for step in range(1, 601):
        tissue.step(None, 1e-3)
        if step in (1, 10, 50, 100, 300, 600):
            found = forces(tissue)[punch, 2].sum() / at_first
            assert found == pytest.approx(kept(1e-3 * step), rel=0.002)


def test_a_body_that_settles_has_relaxed_wholly():
    """It sags as an elastic one does of the stiffness that is left: half. Then it stays."""
    mesh = block((4, 4, 4), (0.04, 0.04, 0.04))
    fixed = mesh.positions[:, 2] > 0.04 - 1e-9
    tissue = Tissue(mesh, SOFT, fixed=fixed)
    left = Material(law="neo_hookean", poisson_ratio=0.45, young_modulus=5e3)
    softer = Tissue(mesh, left, fixed=fixed)
    tissue.settle()
    softer.settle()
    sag = np.abs(softer.snapshot().positions - mesh.positions).max()
    apart = np.abs(tissue.snapshot().positions - softer.snapshot().positions).max()
    assert apart < 1e-3 * sag
    settled = tissue.snapshot().positions
    for _ in range(100):
        tissue.step(None, 1e-3)
    assert np.abs(tissue.snapshot().positions - settled).max() < 1e-3 * sag


def test_a_body_that_hangs_creeps_until_it_sags_by_its_last_stiffness():
    """Creep has the time constant tau / (1 - g)."""
    mesh = block((3, 3, 3), (0.03, 0.03, 0.03))
    fast = Material(law="neo_hookean", poisson_ratio=0.45, prony=((0.5, 0.05),))
    damped = replace(fast, viscous_damping=50.0)
    creeping, settled = (Tissue(mesh, m, fixed=fixed_nodes(mesh, "top")) for m in (damped, fast))
    settled.settle()
    for _ in range(1000):
        creeping.step(None, 1e-3)
    x = settled.snapshot().positions
    sag = np.abs(x - mesh.positions).max()
    assert np.abs(creeping.snapshot().positions - x).max() < 2e-3 * sag


@pytest.mark.parametrize("scheme", ["stellar", "paper"])
def test_a_cut_leaves_the_stress_that_has_relaxed(scheme):
    """All tetrahedra of a body that is held in one strain have the same; so do all their parts."""
    mesh = block((4, 4, 4), (0.04, 0.04, 0.04))
    tissue = held(mesh=mesh, scheme=scheme)
    for _ in range(50):
        tissue.step(None, 1e-3)
    n = tissue.n_tetrahedra
    edges = [[(0.012, y, -0.01), (0.028, y, 0.05)] for y in (-0.01, 0.05)]
    tissue.incise(edges, (0.0, 1.0, 0.0))
    assert tissue.n_tetrahedra > n + 100
    assert tissue.n_pieces() == 2
    expect_alike(tissue)
    tissue.step(None, 1e-3)  # and all go on alike
    expect_alike(tissue)


def expect_alike(tissue):
    """Expect the same relaxed stress in all tetrahedra, and of their share at all nodes."""
    solid, share = tissue._model.elasticity.arrays.solid, SHARE_OF_NODES
    found = rows_of(solid.relaxed, tissue.n_tetrahedra)
    largest = np.abs(found[0]).max()
    assert largest > 100.0
    assert np.abs(found - found[0]).max() < 1e-9 * largest
    of_nodes = rows_of(solid.node_relaxed, tissue.n_nodes)[:, :6]
    expected = share / (1.0 - share) * found[0, :6]
    assert np.abs(of_nodes - expected).max() < 1e-9 * largest


def rows_of(blocks, n):
    """Return the seven numbers of each of the first `n` from blocks of eight."""
    return blocks[: len(blocks) // 56 * 56].reshape(-1, 7, 8).transpose(0, 2, 1).reshape(-1, 7)[:n]


@pytest.mark.parametrize("law", ["neo_hookean", "exponential"])
@pytest.mark.parametrize("precision", ["double", "single"])
def test_the_account_of_a_stroke_closes(precision, law):
    mesh = block((6, 8, 4), (0.04, 0.06, 0.02))
    tissue = Tissue(
        mesh,
        LAWS[law],
        fixed=bodies.sides(mesh),
        gravity=NO_GRAVITY,
        solver=SolverSettings(audit=True, precision=precision),
    )
    results = strokes.make(tissue, strokes.straight(mesh))
    last = results[-1].energies
    assert results[-1].cut_area > 1e-3
    assert abs(last.residual) < 5e-3 * last.work_of_blade


def test_the_account_of_a_cut_through_the_organ_closes():
    mesh = liver_lobe()
    tissue = Tissue(
        mesh,
        replace(MATERIALS["liver"].material, toughness=10.0, prony=PRONY),
        fixed=bodies.sides(mesh, share=0.1),
        solver=SolverSettings(audit=True, precision="single", mass_scaling=6000.0),
    )
    tissue.settle()
    result = strokes.make(tissue, strokes.slanted(mesh))[-1]
    assert result.cut_area > 1.2e-3
    assert abs(result.energies.residual) < 5e-4 * result.energies.work_of_blade


def test_the_account_of_a_body_that_swings_closes():
    """A block stretched by a tenth and let go, without another damper."""
    mesh = block((2, 2, 2), (0.04, 0.04, 0.04))
    tissue = Tissue(
        mesh,
        replace(SOFT, prony=((0.3, 0.02), (0.2, 2.0)), viscous_damping=0.0, retardation_time=0.0),
        positions=mesh.positions * [1.0, 1.0, 1.1],
        fixed=fixed_nodes(mesh, "bottom"),
        gravity=NO_GRAVITY,
        solver=SolverSettings(audit=True),
    )
    at_first, before = tissue._stages.audit.account.at_first[0], 0.0
    for _ in range(3000):
        now = tissue.step(None, 1e-4).energies
        assert now.damping > before
        before = now.damping
        assert abs(now.residual) < 1e-5 * at_first
    assert now.damping > 0.9 * at_first


def test_the_account_tells_what_maxwell_elements_dissipate():
    """A body held in a small strain without another damper: what it stores goes there."""
    mesh = bodies.jittered(3, 1)
    tissue = Tissue(
        mesh,
        SOFT,
        positions=mesh.positions @ (np.eye(3) + 0.01 * (STRAIN - np.eye(3))).T,
        fixed=np.ones(len(mesh.positions), dtype=bool),
        gravity=NO_GRAVITY,
        solver=SolverSettings(audit=True),
    )
    stored, before = tissue._stages.audit.account.at_first[0], 0.0
    for _ in range(100):
        now = tissue.step(None, 0.1).energies
        assert now.damping > before
        before = now.damping
        assert abs(now.residual) < 1e-12 * stored
    # Half is left; of 0.2 the slower term has relaxed all but exp(-5), the spring holds its square
    slow = 0.2 * math.exp(-2.0 * 10.0 / 2.0)
    assert -now.elastic == pytest.approx((0.5 - slow) * stored, rel=2e-3)


def test_a_body_pressed_flat_and_let_go_comes_to_rest():
    """R of the flat body is far from its stress when it springs back; the step stays stable."""
    mesh: TetrahedralMesh = block((4, 4, 4), (0.04, 0.04, 0.04))
    material = Material(
        law="exponential", stiffening=5.0, poisson_ratio=0.3, prony=((0.6, 0.1), (0.3, 0.02))
    )
    tissue = Tissue(
        mesh,
        material,
        positions=mesh.positions * [1.3, 1.3, 0.5],
        fixed=mesh.positions[:, 2] < 1e-9,
        gravity=NO_GRAVITY,
        solver=SolverSettings(audit=True),
    )
    tissue._model.relax_stress(math.inf)
    tissue._stages.audit.begin(tissue._model.context, NOWHERE)
    at_first = tissue._stages.audit.account.at_first[0]
    for _ in range(500):
        energies = tissue.step(None, 1e-3).energies
    assert abs(energies.residual) < 0.01 * at_first
    assert energies.kinetic < 1e-3 * at_first
