"""Displacement, strain and stress of a body, against theory and slow references."""

import numpy as np
import pytest

from tests.support import bodies, naive_solid
from tests.support.naive_solid import around_nodes
from tissue import BladeSegment, BladeSweep, Material, SolverSettings, Tissue, block, fixed_nodes
from tissue.elasticity.stiffness_matrix import edge_springs
from tissue.mesh.surface import boundary_nodes

SINGLE, DOUBLE = 1e-4, 1e-10
"""Relative errors of forces in single and in double precision, at strains of a tenth."""

LAWS = {
    "neo_hookean": Material(law="neo_hookean"),
    "exponential": Material(law="exponential", stiffening=12.0),
    "yeoh": Material(law="yeoh", yeoh_second=2.0, yeoh_third=5.0),
    "springs": Material(law="springs", poisson_ratio=0.25),
    "springs with volumes": Material(law="springs", poisson_ratio=0.4),
}

SOLIDS = ("neo_hookean", "exponential", "yeoh")


def deformed(mesh, material, positions, **solver):
    """Return a body whose nodes are held where they are told."""
    every = np.ones(len(positions), dtype=bool)
    return Tissue(mesh, material, fixed=every, positions=positions, solver=SolverSettings(**solver))


def stretched(mesh, along, across):
    return mesh.positions * [along, across, across]


def moved(mesh):
    random = np.random.default_rng(3)
    turn, _ = np.linalg.qr(random.normal(size=(3, 3)))
    bent = mesh.positions + 0.1 * np.sin(40.0 * mesh.positions[:, [1, 2, 0]]) / 40.0
    return bent @ (turn * np.linalg.det(turn)).T


def von_mises(tensors):
    """Return the equivalent stress from the deviator."""
    deviators = tensors - np.trace(tensors, axis1=1, axis2=2)[:, None, None] / 3.0 * np.eye(3)
    return np.sqrt(1.5 * (deviators**2).sum(axis=(1, 2)))


def averaged(mesh, tensors, volumes):
    """Return the mean over the tetrahedra around each node, by volume."""
    parts = [around_nodes(mesh, volumes * tensors[:, i, j]) for i in range(3) for j in range(3)]
    return np.stack(parts, axis=1).reshape(-1, 3, 3) / around_nodes(mesh, volumes)[:, None, None]


def test_displacement_is_the_distance_from_rest():
    mesh = block((2, 2, 2), (0.02, 0.02, 0.02))
    tissue = deformed(mesh, Material(), mesh.positions + np.array([3e-3, 0.0, -4e-3]))
    assert tissue.surface_values("displacement") == pytest.approx(5e-3)


@pytest.mark.parametrize("law", LAWS)
def test_a_uniform_stretch_has_the_strain_of_theory_in_every_node(law):
    mesh = block((2, 2, 2), (0.02, 0.02, 0.02))
    tissue = deformed(mesh, LAWS[law], stretched(mesh, 1.3, 0.9))
    assert tissue.surface_values("strain") == pytest.approx((1.3**2 - 1.0) / 2.0, rel=1e-12)


@pytest.mark.parametrize("law", SOLIDS)
@pytest.mark.parametrize("precision", ["single", "double"])
def test_a_uniform_stretch_has_the_stress_of_theory_in_every_node(law, precision):
    mesh, material, along, across = block((2, 2, 2), (0.02, 0.02, 0.02)), LAWS[law], 1.3, 0.95
    tissue = deformed(mesh, material, stretched(mesh, along, across), precision=precision)
    squared, j = along**2 + 2.0 * across**2, along * across**2
    q = squared - 1.0 - 2.0 * j
    shear = {
        "neo_hookean": 4.0 / 3.0 * (1.0 - 1.0 / (squared + 1.0)),
        "exponential": np.exp(12.0 * q),
        "yeoh": 1.0 + 2.0 * 2.0 * q + 3.0 * 5.0 * q**2,
    }[law]
    expected = material.mu * shear * (along**2 - across**2) / j
    tolerance = SINGLE if precision == "single" else DOUBLE
    assert tissue.surface_values("stress") == pytest.approx(expected, rel=tolerance)


@pytest.mark.kernel
def test_strain_is_that_of_a_slow_reference():
    mesh = bodies.jittered(3, 5)
    tissue = deformed(mesh, Material(), moved(mesh))
    f = naive_solid.gradients(mesh, moved(mesh))
    strains = 0.5 * (f.transpose(0, 2, 1) @ f - np.eye(3))
    nodal = averaged(mesh, strains, naive_solid.volumes(mesh))
    expected = np.linalg.eigvalsh(nodal)[:, -1][boundary_nodes(tissue._body)]
    assert expected.max() > 0.05
    assert tissue.surface_values("strain") == pytest.approx(expected, rel=1e-9)


@pytest.mark.kernel
@pytest.mark.parametrize("law", SOLIDS)
def test_stress_is_the_cauchy_stress_of_a_slow_reference(law):
    mesh = bodies.jittered(3, 5)
    tissue = deformed(mesh, LAWS[law], moved(mesh), precision="double")
    f = naive_solid.gradients(mesh, moved(mesh))
    first = naive_solid.stresses(mesh, moved(mesh), tissue._model.elasticity.arrays.solid.law)
    j = np.linalg.det(f)
    cauchy = first @ f.transpose(0, 2, 1) / j[:, None, None]
    nodal = averaged(mesh, cauchy, j * naive_solid.volumes(mesh))
    nodal = 0.5 * (nodal + nodal.transpose(0, 2, 1))  # of averaged shear the sum is symmetric alone
    expected = von_mises(nodal)[boundary_nodes(tissue._body)]
    assert tissue.surface_values("stress") == pytest.approx(expected, rel=1e-9)


@pytest.mark.kernel
def test_stress_of_springs_is_the_virial_of_a_slow_reference():
    mesh, material = bodies.jittered(3, 5), LAWS["springs"]
    positions = moved(mesh)
    springs = edge_springs(mesh, material.spring_modulus)
    virial = np.zeros((len(positions), 3, 3))
    for (a, b), k in zip(springs.ends, springs.stiffness, strict=True):
        d = positions[b] - positions[a]
        length, rest = np.linalg.norm(d), np.linalg.norm(mesh.positions[b] - mesh.positions[a])
        virial[[a, b]] += 0.5 * k * (length - rest) / length * np.outer(d, d)
    v = around_nodes(mesh, naive_solid.volumes(mesh._replace(positions=positions)))
    tissue = deformed(mesh, material, positions)
    expected = von_mises(virial / v[:, None, None])[boundary_nodes(tissue._body)]
    assert tissue.surface_values("stress") == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize(
    ("relaxation", "law", "precision"),
    [
        ("global", "neo_hookean", "double"),
        ("global", "exponential", "single"),
        ("verlet", "neo_hookean", "single"),
        ("verlet", "springs with volumes", "double"),
        ("hierarchical", "springs", "double"),
    ],
)
def test_looking_changes_no_bit_of_a_cut(relaxation, law, precision):
    def cut(looks):
        mesh = block((3, 3, 3), (0.03, 0.03, 0.03))
        tissue = Tissue(
            mesh,
            LAWS[law],
            fixed=fixed_nodes(mesh, "left,right"),
            solver=SolverSettings(relaxation=relaxation, precision=precision),
        )
        for i in range(40):
            tissue.step(BladeSweep(edge(i), edge(i + 1)), 1e-3)
            if looks:
                values = tissue.surface_values("stress"), tissue.surface_values("strain")
                assert len(tissue.deformation().strain) == tissue.n_tetrahedra
                assert all(len(each) == len(tissue.surface().positions) for each in values)
        return tissue.snapshot()

    seen, unseen = cut(looks=True), cut(looks=False)
    assert len(seen.tetrahedra) > 6 * 27
    assert all(np.array_equal(a, b) for a, b in zip(seen, unseen, strict=True))


def edge(i):
    x, y = 0.0153, -2e-3 + 4e-4 * i
    return BladeSegment(
        tip=np.array([x, y, 0.005]), heel=np.array([x, y, 0.05]), forward=np.array([0.0, 1.0, 0.0])
    )


def test_an_unknown_quantity_is_refused_with_the_known_ones():
    with pytest.raises(
        ValueError, match=r"no quantity 'heat'\. Known: displacement, strain, stress"
    ):
        Tissue(block((1, 1, 1), (0.01, 0.01, 0.01))).surface_values("heat")
