"""Bodies whose labels relax each by a series of its own, or not at all."""

import math

import numpy as np
import pytest
from scipy.linalg import expm

from tests.support import bodies, incisions, strokes
from tests.tissue.solids import SolidBody
from tissue import Material, SolverSettings, TetrahedralMesh, Tissue, block

SIZE, STRAIN = 0.04, 1e-4
NO_GRAVITY = (0.0, 0.0, 0.0)
SERIES = {0: ((0.3, 0.1), (0.2, 2.0)), 1: ((0.6, 0.4),), 2: ()}
SOFT = Material(poisson_ratio=0.45, viscous_damping=50.0)
MODULI = {0: 10e3, 1: 30e3, 2: 20e3}
MATERIALS = {
    label: SOFT.changed(young_modulus=MODULI[label], prony=series)
    for label, series in SERIES.items()
}
ELEMENTS = pytest.mark.parametrize("element", ["plain", "averaged"])


def layers(axis: int, n: int) -> TetrahedralMesh:
    """Return a block of layers of one thickness across an axis, of label 0 and so on."""
    mesh = block((6, 6, 6), (SIZE, SIZE, SIZE))
    middles = mesh.positions[mesh.tetrahedra].mean(axis=1)
    return mesh._replace(labels=np.floor(n * middles[:, axis] / SIZE).astype(np.int64))


def kept(label: int, seconds: float) -> float:
    """Return G(t) of a label."""
    return 1.0 - sum(g * -math.expm1(-seconds / tau) for g, tau in SERIES[label])


def held(mesh: TetrahedralMesh, positions: np.ndarray, element: str) -> Tissue:
    """Return a body whose nodes are all held."""
    solver = SolverSettings(element=element)
    fixed = np.ones(len(positions), dtype=bool)
    return Tissue(
        mesh, MATERIALS, positions=positions, fixed=fixed, gravity=NO_GRAVITY, solver=solver
    )


def solid_of(tissue: Tissue) -> SolidBody:
    return SolidBody(tissue._body, tissue._model.elasticity.arrays.solid)


@ELEMENTS
def test_layers_in_parallel_relax_each_by_its_own_series(element):
    mesh = layers(1, 3)
    strain = STRAIN * np.array([1.0, -SOFT.poisson_ratio, -SOFT.poisson_ratio])
    tissue = held(mesh, mesh.positions * (1.0 + strain), element)
    at_end, area = mesh.positions[:, 0] > SIZE - 1e-9, SIZE * SIZE / 3.0
    for n_steps, dt, seconds in ((50, 1e-3, 0.05), (5, 0.3, 1.55)):
        for _ in range(n_steps):
            tissue.step(None, dt)
        pull = -solid_of(tissue).forces(tissue.snapshot().positions)[at_end, 0].sum()
        stress = sum(MODULI[label] * kept(label, seconds) for label in SERIES)
        assert pull == pytest.approx(STRAIN * stress * area, rel=1e-3)


def test_layers_in_series_relax_as_the_formula_has_it():
    """Stress is one, s = E_i e_i - r_i, and so is the sum of the strains: two linear equations."""
    mesh = layers(0, 2)
    materials = {label: MATERIALS[label].changed(poisson_ratio=0.0) for label in (0, 1)}
    materials[0] = materials[0].changed(prony=((0.5, 0.1),))
    moduli, shares, times = np.array([10e3, 30e3]), np.array([0.5, 0.6]), np.array([0.1, 0.4])
    fixed, moved, x = bodies.sides(mesh), mesh.positions.copy(), mesh.positions[:, 0]
    is_end, half = x > SIZE - 1e-9, 0.5 * SIZE
    per = 1.0 / (1.0 / moduli).sum()
    strains = 2.0 * STRAIN * per / moduli
    moved[:, 0] += strains[0] * np.minimum(x, half) + strains[1] * np.maximum(x - half, 0.0)
    tissue = Tissue(mesh, materials, fixed=fixed, positions=moved, gravity=NO_GRAVITY)
    # dr_i/dt = (g_i (s + r_i) - r_i) / tau_i, with the stress s that both layers have
    of_r = -per / moduli
    rates = (shares[:, None] * (of_r + np.eye(2)) - np.eye(2)) / times[:, None]
    constant = shares * per * 2.0 * STRAIN / times
    r_at_last = np.linalg.solve(rates, -constant)
    for n_steps, seconds in ((100, 0.1), (300, 0.4)):
        for _ in range(n_steps):
            tissue.step(None, strokes.DT)
        r = r_at_last - expm(rates * seconds) @ r_at_last
        stress = per * 2.0 * STRAIN + of_r @ r
        pull = tissue.support_forces()[is_end, 0].sum()
        assert pull == pytest.approx(stress * SIZE * SIZE, rel=0.01)
    tissue.settle()
    long = 2.0 * STRAIN / (1.0 / (moduli * (1.0 - shares))).sum()
    pull = tissue.support_forces()[is_end, 0].sum()
    assert pull == pytest.approx(long * SIZE * SIZE, rel=0.01)


@ELEMENTS
def test_relaxed_forces_are_the_slope_of_the_energy(element):
    mesh = bodies.jittered(2, 3, SIZE)
    mesh = mesh._replace(labels=np.arange(len(mesh.tetrahedra)) % 3)
    random = np.random.default_rng(0)
    x = mesh.positions + 0.05 * SIZE * random.normal(size=mesh.positions.shape)
    tissue = held(mesh, x, element)
    for _ in range(100):
        tissue.step(None, strokes.DT)
    solid, h = solid_of(tissue), 1e-7 * SIZE
    for _ in range(3):
        way = random.normal(size=x.shape)
        slope = (solid.energy(x + h * way) - solid.energy(x - h * way)) / (2.0 * h)
        assert (solid.forces(x) * way).sum() == pytest.approx(-slope, rel=1e-6)


@pytest.mark.parametrize("precision", ["double", "single"])
def test_the_account_of_a_cut_through_labels_that_relax_closes(precision):
    mesh = layers(1, 3)
    solver = SolverSettings(audit=True, precision=precision)
    tissue = Tissue(mesh, MATERIALS, fixed=bodies.sides(mesh), gravity=NO_GRAVITY, solver=solver)
    poses = strokes.upright(0.0187, -0.004, 0.044, -0.004, 0.046, 0.1)
    energies = strokes.make(tissue, poses)[-1].energies
    assert len(tissue.pieces()) == 2
    assert abs(energies.residual) < 0.02 * energies.work_of_blade
    assert energies.damping > 0.0


def test_children_relax_by_the_series_of_their_parent():
    """A body cut where it is held goes on to relax as one that was not cut."""
    mesh = bodies.jittered(3, 5, SIZE)
    mesh = mesh._replace(labels=np.arange(len(mesh.tetrahedra)) % 3)
    tissue = held(mesh, mesh.positions, "plain")
    tissue.incise(*incisions.incision(mesh, next(iter(incisions.KINDS)), 0))
    solid, body = tissue._model.elasticity.arrays.solid, tissue._body
    assert body.n_tetrahedra > len(mesh.tetrahedra)
    width, n_terms, n_rows = 8, solid.n_terms, body.materials.n
    places = solid.series.reshape(-1, n_terms, width)[:, :, :]
    of_each = places.transpose(0, 2, 1).reshape(-1, n_terms)[: body.n_tetrahedra]
    expected = body.material[: body.n_tetrahedra, None] + n_rows * np.arange(n_terms)
    np.testing.assert_array_equal(of_each, expected)


def test_a_state_carries_labels_that_relax():
    mesh = layers(1, 3)
    moved = mesh.positions * (1.0, 1.0, 1.05)
    where = {"positions": moved, "fixed": bodies.sides(mesh), "gravity": NO_GRAVITY}
    one, other = (Tissue(mesh, MATERIALS, **where) for _ in range(2))
    for _ in range(20):
        one.step(None, strokes.DT)
    state = one.save_state()
    other.load_state(type(state).from_bytes(state.to_bytes()))
    for tissue in (one, other):
        for _ in range(20):
            tissue.step(None, strokes.DT)
    np.testing.assert_array_equal(one.snapshot().positions, other.snapshot().positions)
