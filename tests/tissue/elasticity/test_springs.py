"""Springs and masses against plain sums over edges, and against mechanics."""

import numpy as np
import pytest

from tests.support import bodies, naive
from tests.tissue.kernels_of import (
    DENSITY,
    YOUNG_MODULUS,
    dense_modes,
    network_of,
    row,
    springs_of,
)
from tissue import block
from tissue.elasticity.springs import (
    SPRING_POOL_MARGIN,
    build_rows,
    no_springs,
    spring_energy,
)
from tissue.mesh.body import build_body
from tissue.mesh.star import LARGEST_STAR, no_visits
from tissue.mesh.validation import signed_volumes

pytestmark = pytest.mark.kernel

MESHES = {"grid": block((2, 1, 1), (0.2, 0.1, 0.1)), "jittered": bodies.jittered(2, 3)}


@pytest.fixture(params=MESHES)
def mesh(request):
    return MESHES[request.param]


def moved(mesh, seed=0, share=0.05):
    """Return random positions and velocities around rest."""
    random = np.random.default_rng(seed)
    reach = share * np.ptp(mesh.positions)
    noise = random.normal(size=(2, *mesh.positions.shape)) * reach
    return mesh.positions + noise[0], noise[1]


def test_a_row_has_every_edge_of_its_node_with_stiffness_and_rest_pull(mesh):
    springs = springs_of(build_body(mesh, None, None))
    expected = naive.stiffnesses(mesh.positions, mesh.tetrahedra, YOUNG_MODULUS)
    for node in range(len(mesh.positions)):
        edges = {sum(e) - node: (e, k) for e, k in expected.items() if node in e}
        assert row(springs, node).keys() == edges.keys()
        for other, (k, pull) in row(springs, node).items():
            (a, b), stiffness = edges[other]
            assert k == pytest.approx(stiffness, rel=1e-12)
            length = np.linalg.norm(mesh.positions[b] - mesh.positions[a])
            assert pull == pytest.approx(stiffness * length, rel=1e-12)


def test_both_ends_of_a_spring_have_the_same_bits(mesh):
    springs = springs_of(build_body(mesh, None, None))
    rows = [row(springs, node) for node in range(len(mesh.positions))]
    for node, springs_of_node in enumerate(rows):
        for other, spring in springs_of_node.items():
            assert rows[other][node] == spring


def test_the_mass_of_a_node_is_a_quarter_of_the_tetrahedra_around_it(mesh):
    body = build_body(mesh, None, None)
    springs_of(body)
    expected = naive.masses(mesh.positions, mesh.tetrahedra, DENSITY)
    np.testing.assert_allclose(body.masses, expected, rtol=1e-12)
    assert body.masses.sum() == pytest.approx(DENSITY * signed_volumes(*mesh[:2]).sum(), rel=1e-14)


@pytest.mark.parametrize("retardation_time", [0.0, 2e-3])
def test_forces_are_the_sum_over_the_springs(mesh, retardation_time):
    network = network_of(mesh, retardation_time=retardation_time)
    network.body.positions[:], network.body.velocities[:] = moved(mesh)
    springs = naive.stiffnesses(mesh.positions, mesh.tetrahedra, YOUNG_MODULUS)
    expected = naive.forces(
        springs,
        mesh.positions,
        network.body.positions,
        network.body.velocities,
        retardation_time,
    )
    forces = network.forces()
    np.testing.assert_allclose(forces, expected, atol=1e-10 * np.abs(expected).max())


def test_energy_is_the_sum_over_the_springs_and_zero_at_rest(mesh):
    network = network_of(mesh)
    assert spring_energy(network.springs, network.body) == pytest.approx(0.0, abs=1e-15)
    network.body.positions[:], _ = moved(mesh)
    springs = naive.stiffnesses(mesh.positions, mesh.tetrahedra, YOUNG_MODULUS)
    expected = naive.elastic_energy(springs, mesh.positions, network.body.positions)
    assert spring_energy(network.springs, network.body) == pytest.approx(expected, rel=1e-12)


def test_drag_slows_every_node_in_proportion_to_its_mass(mesh):
    network = network_of(mesh, viscous_damping=5.0)
    network.body.velocities[:] = [0.1, 0.0, -0.2]
    expected = -5.0 * network.body.masses[:, None] * network.body.velocities
    np.testing.assert_allclose(network.forces(), expected, atol=1e-9)


def test_a_fixed_node_has_no_acceleration(mesh):
    fixed = bodies.sides(mesh)
    network = network_of(mesh, fixed)
    network.body.positions[:], _ = moved(mesh)
    assert (network.forces()[fixed] == 0.0).all()
    assert (network.forces()[~fixed] != 0.0).any()


def test_the_frequency_bound_is_above_every_mode(mesh):
    """Gershgorin's bound is at most 1.8 times the highest eigenfrequency of M^-1/2 K M^-1/2."""
    network = network_of(mesh)
    true = np.linalg.eigvalsh(dense_modes(network.body, network.springs))[-1]
    bound = network.springs.frequency_squared[: len(mesh.positions)].max()
    assert true <= bound <= 1.8**2 * true


def test_too_little_capacity_for_a_row_is_reported_and_nothing_is_lost():
    mesh = MESHES["grid"]
    body = build_body(mesh, None, None)
    n = len(mesh.positions)
    body.materials.spring_modulus[:] = YOUNG_MODULUS
    arguments = (np.zeros(LARGEST_STAR, dtype=np.int64),)
    visits = no_visits(n, len(mesh.tetrahedra))
    too_small = no_springs(n, SPRING_POOL_MARGIN + 20)
    done = build_rows(body, visits, too_small, np.arange(n), n, *arguments)
    assert 0 < done < n
    larger = too_small.grown({"nodes": n, "pool": 4 * SPRING_POOL_MARGIN})
    rest = np.arange(done, n)
    assert build_rows(body, visits, larger, rest, n - done, *arguments) == n - done
    expected = springs_of(build_body(mesh, None, None))
    assert [row(larger, i) for i in range(n)] == [row(expected, i) for i in range(n)]
