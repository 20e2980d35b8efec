"""The bound on the frequencies of a deformed body, against eigenvalues."""

import numpy as np
import pytest

from tests import bodies
from tests.tissue.solids import highest_frequency, law_of, solid_of
from tissue import Material, SolverSettings, Tissue, block
from tissue.core.jit import is_compiling
from tissue.elasticity.finite_elements import n_blocks
from tissue.elasticity.internal_forces import Elastic
from tissue.elasticity.springs import no_springs
from tissue.elasticity.strained_frequency import strain_frequencies, strained_frequency

pytestmark = pytest.mark.kernel

MESH = bodies.jittered(3, 1)
STRETCHES = {
    "rest": np.eye(3),
    "sheet": np.diag([1.5, 1.5, 1.0 / 2.25]),
    "swollen sheet": np.diag([1.5, 1.5, 1.0]),
    "rod": np.diag([2.0, 0.7, 0.7]),
    "crushed": np.diag([0.5, 1.4, 1.4]),
    "squeezed": 0.8 * np.eye(3),
    "sheared": np.eye(3) + np.outer([1.0, 0.0, 0.0], [0.0, 1.0, 0.0]),
}


def elastic_of(solid):
    """Return the elastic arrays of a solid without springs."""
    n = len(solid.body.rest)
    return Elastic(
        springs=no_springs(n, 0),
        solid=solid.solid,
        has_springs=0,
        has_tetrahedra=1,
        frequency_squared=solid.solid.frequency_squared.copy(),
    )


def bound(solid, positions):
    blocks = n_blocks(solid.body.n_tetrahedra)
    elastic = elastic_of(solid)
    return float(np.sqrt(strained_frequency(elastic, positions, solid.solid.every, 0, blocks)))


@pytest.mark.parametrize("averaged", [False, True])
@pytest.mark.parametrize("poisson_ratio", [0.3, 0.49])
@pytest.mark.parametrize("stretch", STRETCHES.values(), ids=STRETCHES)
def test_the_bound_holds_however_the_body_is_stretched(stretch, poisson_ratio, averaged):
    """The nodes are also displaced at random, so that no two tetrahedra are alike."""
    solid = solid_of(MESH, law_of(poisson_ratio, averaged))
    for shake in (0.0, 0.01, 0.03):
        noise = np.random.default_rng(3).normal(size=MESH.positions.shape)
        x = MESH.positions @ stretch.T + shake * np.ptp(MESH.positions) * noise
        assert bound(solid, x) > 1.1 * highest_frequency(solid, x)


def test_without_strain_the_bound_is_that_at_rest():
    solid = solid_of(MESH, law_of(0.45))
    assert bound(solid, MESH.positions) == pytest.approx(solid.frequency(), rel=1e-9)


def test_the_bound_of_a_sheet_stretched_to_twice_its_edges_is_four_times_as_high():
    """The faces of a sheet stretched to twice its size in both directions have 4 times the area."""
    mesh = block((2, 2, 1), (0.02, 0.02, 0.01))
    solid = solid_of(mesh, law_of(0.45))
    x = mesh.positions * [2.0, 2.0, 1.0]
    assert bound(solid, x) == pytest.approx(4.0 * solid.frequency(), rel=1e-9)


@pytest.mark.parametrize("stretch", STRETCHES.values(), ids=STRETCHES)
def test_the_bound_at_each_node_holds_however_the_body_is_stretched(stretch):
    solid = solid_of(MESH, law_of(0.45))
    n = len(MESH.positions)
    noise = np.random.default_rng(3).normal(size=MESH.positions.shape)
    x = MESH.positions @ stretch.T + 0.01 * np.ptp(MESH.positions) * noise
    at_rest, elastic = solid.solid.frequency_squared.copy(), elastic_of(solid)
    blocks, every = n_blocks(len(MESH.tetrahedra)), solid.solid.every
    strain_frequencies(elastic, x, every, blocks, every, n)
    assert np.sqrt(elastic.frequency_squared.max()) > 1.1 * highest_frequency(solid, x)
    np.testing.assert_array_equal(solid.solid.frequency_squared, at_rest)
    strain_frequencies(elastic, MESH.positions, every, blocks, every, n)
    np.testing.assert_allclose(elastic.frequency_squared, at_rest, rtol=1e-9)


@pytest.mark.skipif(not is_compiling(), reason="hundreds of steps: compiled only")
@pytest.mark.parametrize(
    ("relaxation", "poisson_ratio"),
    [("global", 0.3), ("global", 0.45), ("global", 0.49), ("local", 0.3), ("local", 0.45)],
)
def test_stretched_tissue_stays_stable_with_automatic_substeps(relaxation, poisson_ratio):
    """A plate stretched by half on a frame: a step that is stable at rest would be unstable."""
    mesh = block((6, 6, 3), (0.06, 0.06, 0.03))
    x = mesh.positions
    frame = bodies.sides(mesh, 0) | bodies.sides(mesh, 1)
    tissue = Tissue(
        mesh,
        Material(law="neo_hookean", poisson_ratio=poisson_ratio, young_modulus=5e3),
        fixed=frame,
        positions=x * [1.5, 1.5, 1.0],
        solver=SolverSettings(relaxation=relaxation),
    )
    substeps = [tissue.step(None, 1e-3).n_substeps for _ in range(50)]
    assert max(substeps) > 1
    low, high = tissue.bounds
    assert (np.abs(low - high) < 0.15).all()
