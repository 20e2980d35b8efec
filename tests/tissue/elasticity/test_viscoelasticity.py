"""Quasi-linear viscoelasticity of tetrahedra, against Fung's law and a slow twin."""

import numpy as np
import pytest

from tests.support import bodies, naive_solid
from tests.tissue.kernels_of import cut_of, springs_of
from tests.tissue.solids import LAWS, built, law_of, moved, relax, solid_of
from tissue.cutting.stellar_subdivision import split_edge
from tissue.elasticity.finite_elements import grown_solid
from tissue.elasticity.relaxed_stress import inherit_relaxed, relaxed_place
from tissue.mesh.changes import clear_changes

pytestmark = pytest.mark.kernel

PRONY = ((0.3, 0.1), (0.2, 5.0), (0.1, 0.02))
SOLIDS = {
    name: LAWS[name]
    for name in (
        *("averaged", "plain", "exponential", "yeoh"),
        *("averaged shear", "averaged exponential", "averaged yeoh"),
    )
}
MESH = bodies.jittered_grid(2, 3)
STRAIN = np.array([[1.2, 0.3, 0.0], [0.05, 0.9, 0.1], [0.0, -0.1, 1.05]])
HELD = MESH.positions @ STRAIN.T


def pressure(mesh, positions, law):
    """Return the elastic pressure of each tetrahedron [Pa]."""
    j = np.linalg.det(naive_solid.gradients(mesh, positions))
    of_nodes = law.lam_of_nodes * (naive_solid.averaged_j(mesh, positions) - 1.0)
    return law.lam_of_tetrahedra * (j - 1.0) + of_nodes[mesh.tetrahedra].mean(axis=1)


class Relaxation:
    """The slow twin: what has relaxed in each tetrahedron of a mesh, and at each node.

    Args:
        mesh: The body at rest.
        law: Its elastic law.
        prony: g and tau [s] of each term.
    """

    def __init__(self, mesh, law, prony):
        self.mesh, self.law, self.prony = mesh, law, prony
        n = len(mesh.tetrahedra)
        self.stress = np.zeros((len(prony), n, 3, 3))
        self.of_nodes = np.zeros((len(prony), len(mesh.positions), 3, 3))
        self.pressure = np.zeros((len(prony), n))

    def relax(self, positions, seconds):
        """Let stress relax at those positions [m] for that time [s]."""
        of = self.mesh, positions
        by_nodes = naive_solid.shear_stress_of_nodes(*of, self.law)
        own = naive_solid.shear_stress_of_tetrahedra(*of, self.law)
        stress = np.linalg.inv(naive_solid.gradients(*of)) @ own
        of_nodes = np.linalg.inv(naive_solid.averaged_gradients(*of)) @ by_nodes
        elastic_pressure = pressure(*of, self.law)
        for i, (share, time) in enumerate(self.prony):
            left = np.exp(-seconds / time)
            self.stress[i] = left * self.stress[i] + (1.0 - left) * share * stress
            self.of_nodes[i] = left * self.of_nodes[i] + (1.0 - left) * share * of_nodes
            self.pressure[i] = left * self.pressure[i] + (1.0 - left) * share * elastic_pressure

    def forces(self, positions):
        """Return the forces on the nodes [N]."""
        mesh = self.mesh
        f = naive_solid.gradients(mesh, positions)
        j = np.linalg.det(f)[:, None, None]
        cofactors = j * np.linalg.inv(f).transpose(0, 2, 1)
        whole = naive_solid.stresses(mesh, positions, self.law) - f @ self.stress.sum(axis=0)
        mean = naive_solid.averaged_gradients(mesh, positions) @ self.of_nodes.sum(axis=0)
        whole = whole - mean[mesh.tetrahedra].mean(axis=1)
        whole = whole - self.pressure.sum(axis=0)[:, None, None] * cofactors
        normals = np.linalg.inv(naive_solid.edges(*mesh[:2]))  # rows: gradients of N1, N2, N3
        of_corners = -naive_solid.volumes(mesh)[:, None, None] * (
            whole @ normals.transpose(0, 2, 1)
        )
        out = np.zeros_like(positions)
        for k in range(3):
            np.add.at(out, mesh.tetrahedra[:, k + 1], of_corners[:, :, k])
            np.add.at(out, mesh.tetrahedra[:, 0], -of_corners[:, :, k])
        return out


def assert_near(found, expected, share):
    """Compare forces, to a share of the largest."""
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=share * np.abs(expected).max())


def test_what_is_held_for_ever_keeps_one_less_the_sum_of_the_shares():
    solid = solid_of(MESH, law_of(0.45), prony=PRONY)
    at_first = solid.forces(HELD)
    relax(solid, HELD, np.inf)
    assert_near(solid.forces(HELD), 0.4 * at_first, 1e-12)


@pytest.mark.parametrize("law", SOLIDS)
def test_forces_on_a_body_that_moves_are_those_of_the_slow_twin(law):
    solid, twin = solid_of(MESH, SOLIDS[law], prony=PRONY), Relaxation(MESH, SOLIDS[law], PRONY)
    for seed, seconds in enumerate((0.01, 0.2, 0.05, 2.0)):
        x = moved(MESH, 0.03, seed)
        relax(solid, x, seconds)
        twin.relax(x, seconds)
        after = moved(MESH, 0.03, seed + 10)
        assert_near(solid.forces(after), twin.forces(after), 1e-11)
        solid.placed(x)


@pytest.mark.parametrize("law", SOLIDS)
def test_the_force_is_the_slope_of_the_stored_energy(law):
    solid = solid_of(MESH, SOLIDS[law], prony=PRONY)
    relax(solid, moved(MESH, 0.03, 1), 0.3)
    x, h = moved(MESH, 0.03, 2), 1e-7
    forces = solid.forces(x)
    for direction in np.random.default_rng(0).normal(size=(5, *x.shape)):
        slope = (solid.energy(x + h * direction) - solid.energy(x - h * direction)) / (2.0 * h)
        assert -slope == pytest.approx((forces * direction).sum(), rel=1e-6)


@pytest.mark.parametrize("law", SOLIDS)
def test_a_body_held_at_small_strain_stores_its_share_and_dissipates_without_gain(law):
    """A Maxwell element that has relaxed wholly stores nothing."""
    small = MESH.positions + 1e-4 * (HELD - MESH.positions)
    solid = solid_of(MESH, SOLIDS[law], prony=PRONY)
    stored = [solid.energy(small)]
    for seconds in (0.01, 0.05, 0.2, 1.0, 5.0, 50.0, np.inf):
        relax(solid, small, seconds)
        stored.append(solid.energy(small))
    assert (np.diff(stored) < 0.0).all()
    assert stored[-1] == pytest.approx(0.4 * stored[0], rel=1e-3)


@pytest.mark.parametrize("law", SOLIDS)
def test_maxwell_elements_of_a_body_that_springs_back_store_what_they_have_relaxed(law):
    """Held until all has relaxed, then put back to rest at once: g times the energy at first."""
    small = MESH.positions + 1e-4 * (HELD - MESH.positions)
    solid = solid_of(MESH, SOLIDS[law], prony=PRONY)
    at_first = solid.energy(small)
    relax(solid, small, np.inf)
    assert solid.energy(MESH.positions) == pytest.approx(0.6 * at_first, rel=1e-3)


def test_a_tetrahedron_that_is_turned_inside_out_relaxes_to_finite_stress():
    mesh = bodies.unit_tetrahedron()
    solid = solid_of(mesh, law_of(0.45, averaged=False), prony=PRONY)
    flat = mesh.positions * [1.0, 1.0, 0.0]
    inverted = mesh.positions * [1.0, 1.0, -0.5]
    for x in (flat, inverted):
        relax(solid, x, np.inf)
        forces = solid.forces(x)
        assert np.isfinite(forces).all()
        assert forces[3, 2] > 0.0  # it still recovers


def split(cut, n, seed=5):
    """Split random edges of a body; yield what each split changed."""
    random = np.random.default_rng(seed)
    for _ in range(n):
        a, b = random.choice(cut.body.tetrahedra[random.integers(cut.body.n_tetrahedra)], 2, False)
        clear_changes(cut.change)
        if split_edge(cut, int(a), int(b), float(random.uniform(0.3, 0.7))) >= 0:
            yield int(a), int(b)


def test_parts_inherit_what_has_relaxed_and_a_split_changes_no_force():
    """The force on a new node is shared by the ends of its edge as its position is."""
    cut = cut_of(MESH)
    springs_of(cut.body)
    law = law_of(0.45, averaged=False)
    n = len(MESH.positions)
    before = built(cut.body, law, prony=PRONY)
    relax(before, moved(MESH, 0.04, 1), 0.2)
    x = moved(MESH, 0.04, 2)
    expected, solid = before.forces(x), before.solid
    shares = [np.eye(n)[i] for i in range(n)]
    for a, b in split(cut, 12):
        inherit_relaxed(solid, cut.change.children, cut.change.n_children)
        node = cut.body.n_nodes - 1
        way = cut.body.rest[b] - cut.body.rest[a]
        w = (cut.body.rest[node] - cut.body.rest[a]) @ way / (way @ way)
        shares.append((1.0 - w) * shares[a] + w * shares[b])
    assert len(shares) > n + 5
    springs_of(cut.body)  # masses
    after = built(cut.body, law, prony=PRONY)
    after.solid.relaxed[:] = solid.relaxed
    all_x = np.array(shares) @ x
    assert_near(np.array(shares).T @ after.forces(all_x), expected, 1e-9)


def test_children_of_children_have_the_stress_of_the_first_parent():
    solid = solid_of(bodies.two_tetrahedra(), law_of(0.45), prony=PRONY).solid
    solid = grown_solid(solid, 10, 20, 10_000)
    solid.relaxed[relaxed_place(solid, 1, 3)] = 7.0
    solid.relaxed_terms[:] = 2.0
    inherit_relaxed(solid, np.array([[2, 1], [17, 2], [3, 17]]), 3)
    found = [solid.relaxed[relaxed_place(solid, t, 3)] for t in (0, 1, 2, 3, 17)]
    assert found == [0.0, 7.0, 7.0, 7.0, 7.0]


def test_more_room_keeps_what_has_relaxed():
    solid = solid_of(MESH, law_of(0.45), prony=PRONY)
    relax(solid, HELD, 0.2)
    larger = grown_solid(solid.solid, 200, 1000, 10_000)
    n = len(solid.solid.relaxed_terms)
    np.testing.assert_array_equal(larger.relaxed_terms[:n], solid.solid.relaxed_terms)
    n = len(solid.solid.relaxed)
    np.testing.assert_array_equal(larger.relaxed[:n], solid.solid.relaxed)
    assert np.abs(larger.relaxed).max() > 0.0
    np.testing.assert_array_equal(larger.relaxation_times, [0.1, 5.0, 0.02])
