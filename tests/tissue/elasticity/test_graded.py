"""Tetrahedra with moduli of their own, against formulas, energies and eigenvalues."""

import numpy as np
import pytest

from tests.support import bodies
from tests.tissue.solids import SolidBody, highest_frequency
from tissue import Material, SolverSettings, TetrahedralMesh, Tissue, block

pytestmark = pytest.mark.kernel

SIZE = 0.04
RATIO = 8.0
"""Young's modulus of the one part over that of the other."""

SOFT = {
    "neo_hookean": Material(poisson_ratio=0.45),
    "exponential": Material(law="exponential", stiffening=12.0),
    "yeoh": Material(law="yeoh", yeoh_second=2.0, yeoh_third=5.0),
    "springs": Material(law="springs", poisson_ratio=0.4),
}


def layered(axis: int, n: int = 4) -> TetrahedralMesh:
    """Return a block whose upper half along an axis has label 1."""
    mesh = block((n, n, n), (SIZE, SIZE, SIZE))
    middles = mesh.positions[mesh.tetrahedra].mean(axis=1)
    return mesh._replace(labels=(middles[:, axis] > 0.5 * SIZE).astype(np.int64))


def two_parts(mesh: TetrahedralMesh, soft: Material, element: str = "averaged") -> Tissue:
    """Return a body whose label 1 is stiffer."""
    stiff = soft.changed(young_modulus=RATIO * soft.young_modulus)
    if soft.stiffens:
        stiff = stiff.changed(
            **{key: 0.5 * getattr(soft.law, of.field) for key, of in soft.law.keys.items()}
        )
    solver = SolverSettings(element=element, mass_scaling=None)
    return Tissue(mesh, {0: soft, 1: stiff}, solver=solver, gravity=(0.0, 0.0, 0.0))


def solid_of(tissue: Tissue) -> SolidBody:
    return SolidBody(tissue._body, tissue._model.elasticity.arrays.solid)


ELEMENTS = pytest.mark.parametrize("element", ["plain", "averaged"])


@ELEMENTS
@pytest.mark.parametrize("law", ["neo_hookean", "exponential", "yeoh", "springs"])
def test_forces_are_the_slope_of_the_energy(law, element):
    mesh = bodies.jittered(2, 3, SIZE)
    labels = np.arange(len(mesh.tetrahedra)) % 3 == 0
    solid = solid_of(two_parts(mesh._replace(labels=labels.astype(np.int64)), SOFT[law], element))
    random = np.random.default_rng(0)
    x = mesh.positions + 0.05 * SIZE * random.normal(size=mesh.positions.shape)
    for _ in range(3):
        way = random.normal(size=x.shape)
        h = 1e-7 * SIZE
        slope = (solid.energy(x + h * way) - solid.energy(x - h * way)) / (2.0 * h)
        assert (solid.forces(x) * way).sum() == pytest.approx(-slope, rel=1e-6)


@ELEMENTS
def test_layers_in_series_bear_the_same_stress(element):
    """In confined compression no point moves sideways, whatever Poisson's ratio is."""
    mesh, soft = layered(0), SOFT["neo_hookean"]
    solid = solid_of(two_parts(mesh, soft, element))
    m = np.array([soft.lam + 2.0 * soft.mu, RATIO * (soft.lam + 2.0 * soft.mu)])
    stress = 1e-4 * m[0]
    x, half = mesh.positions[:, 0], 0.5 * SIZE
    moved = mesh.positions.copy()
    moved[:, 0] += stress * (np.minimum(x, half) / m[0] + np.maximum(x - half, 0.0) / m[1])
    forces, area = solid.forces(moved)[:, 0], SIZE * SIZE
    assert forces[x > SIZE - 1e-9].sum() == pytest.approx(-stress * area, rel=1e-3)
    inside = (x > 1e-9) & (x < SIZE - 1e-9)
    assert abs(forces[inside]).max() < 1e-3 * stress * area / 25.0


@ELEMENTS
def test_layers_in_parallel_bear_each_its_own_stress(element):
    mesh, soft = layered(1), SOFT["neo_hookean"]
    solid = solid_of(two_parts(mesh, soft, element))
    strain = 1e-4 * np.array([1.0, -soft.poisson_ratio, -soft.poisson_ratio])
    forces, x = solid.forces(mesh.positions * (1.0 + strain)), mesh.positions[:, 0]
    expected = 1e-4 * 0.5 * (1.0 + RATIO) * soft.young_modulus * SIZE * SIZE
    assert forces[x > SIZE - 1e-9, 0].sum() == pytest.approx(-expected, rel=1e-3)
    inside = (x > 1e-9) & (x < SIZE - 1e-9)
    assert abs(forces[inside]).max() < 1e-3 * expected / 25.0


def test_layers_that_are_pulled_come_to_rest_where_the_formula_has_them():
    mesh = layered(0)
    soft = Material(poisson_ratio=0.0)
    fixed = bodies.sides(mesh)
    moved = mesh.positions.copy()
    moved[mesh.positions[:, 0] > SIZE - 1e-9, 0] += 1e-3 * SIZE
    stiff = soft.changed(young_modulus=RATIO * soft.young_modulus)
    tissue = Tissue(
        mesh, {0: soft, 1: stiff}, fixed=fixed, positions=moved, gravity=(0.0, 0.0, 0.0)
    )
    tissue.settle()
    pull = tissue.support_forces()[mesh.positions[:, 0] > SIZE - 1e-9, 0].sum()
    in_series = 2.0 / (1.0 / soft.young_modulus + 1.0 / stiff.young_modulus)
    assert pull == pytest.approx(1e-3 * in_series * SIZE * SIZE, rel=0.01)


@ELEMENTS
@pytest.mark.parametrize("law", ["neo_hookean", "exponential"])
def test_the_bound_is_above_the_highest_frequency(law, element):
    mesh = bodies.jittered(3, 1, SIZE)
    labels = np.random.default_rng(1).integers(0, 2, len(mesh.tetrahedra))
    solid = solid_of(two_parts(mesh._replace(labels=labels), SOFT[law], element))
    assert 1.0 <= solid.frequency() / highest_frequency(solid) <= 1.6


@ELEMENTS
@pytest.mark.parametrize("law", SOFT)
def test_labels_of_one_material_are_that_material_to_the_bit(law, element):
    mesh = layered(2)
    x = mesh.positions * np.array([1.1, 0.95, 0.97])
    solver = SolverSettings(element=element)
    alone = Tissue(mesh._replace(labels=None), SOFT[law], positions=x, solver=solver)
    labelled = Tissue(mesh, {0: SOFT[law], 1: SOFT[law]}, positions=x, solver=solver)
    for tissue in (alone, labelled):
        for _ in range(5):
            tissue.step(None, 1e-3)
    np.testing.assert_array_equal(alone.snapshot().positions, labelled.snapshot().positions)


def test_a_material_that_varies_within_a_label_is_averaged_like_one():
    """With equal moduli: what varies is the viscosity, which does not act at rest."""
    mesh, soft = layered(0)._replace(labels=None), SOFT["neo_hookean"]
    x = mesh.positions * np.array([1.1, 0.95, 0.97])
    tissue = Tissue(mesh, soft)
    alone = solid_of(tissue).forces(x)
    tissue.set_material(np.arange(len(mesh.tetrahedra)) % 2 == 0, retardation_time=0.5)
    assert len(solid_of(tissue).solid.moduli) > 0
    np.testing.assert_allclose(solid_of(tissue).forces(x), alone, rtol=0.0, atol=1e-14)


def test_around_each_node_the_label_that_bears_most_is_averaged_after_cuts():
    mesh = bodies.jittered(3, 1, SIZE)
    labels = np.random.default_rng(1).integers(0, 3, len(mesh.tetrahedra))
    moduli = 10e3 * np.array([1.0, 2.0, 3.0])
    materials = {label: Material(young_modulus=modulus) for label, modulus in enumerate(moduli)}
    tissue = Tissue(mesh._replace(labels=labels), materials)
    tissue.incise([[(0.012, y, -0.01), (0.028, y, 0.05)] for y in (-0.01, 0.05)], (0.0, 1.0, 0.0))
    body, of_each, n = tissue.snapshot(), tissue.labels(), tissue.n_nodes
    corners = body.rest_positions[body.tetrahedra]
    quarter = np.linalg.det(corners[:, 1:] - corners[:, :1]) / 24.0
    volume = np.zeros((n, 3))
    np.add.at(volume, (body.tetrahedra, of_each[:, None]), quarter[:, None])
    leading = (volume * moduli).argmax(axis=1)
    solid = solid_of(tissue).solid
    np.testing.assert_array_equal(solid.node_label[:n], leading)
    np.testing.assert_allclose(solid.node_volume[:n], volume[np.arange(n), leading], rtol=1e-12)
    blocks = solid.sites.reshape(-1, 4, 8).transpose(0, 2, 1).reshape(-1, 4)[: len(of_each)]
    is_own = leading[body.tetrahedra] == of_each[:, None]
    np.testing.assert_array_equal(blocks < n, is_own)
    np.testing.assert_array_equal(blocks[is_own], body.tetrahedra[is_own])
