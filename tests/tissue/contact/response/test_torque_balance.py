"""Where the forces of contacts act: whatever the four nodes do, they neither push nor turn them."""

import numpy as np
import pytest

from tests.tissue.contact.lists import stiffened
from tissue.contact.response.contacts import new_penalty_forces
from tissue.contact.response.forces import add_contact_forces, end_contact_substep

pytestmark = pytest.mark.kernel

CORNERS = np.array([[0.0, 0.0, 0.0], [0.01, 0.0, 0.0], [0.0, 0.01, 0.0]])
FACE = (1.0, -0.4, -0.3, -0.3)
EDGES = (0.6, 0.4, -0.3, -0.7)
MASSES = np.array([1e-4, 2e-5, 3e-4, 1e-6])


class Pair:
    """A contact of four nodes that presses with about 1 mN along `normal`."""

    def __init__(self, positions, weights, normal, velocities=0.0, masses=MASSES):
        # Four doubles are read of each row of three.
        self.x, self.v = np.zeros((5, 3))[:4], np.zeros((5, 3))[:4]
        self.x[:], self.v[:], self.masses = positions, velocities, masses
        self.external = np.zeros((4, 3))
        forces = self.forces = new_penalty_forces(1, 0.3, 0.0)
        forces.n_contacts = 1
        forces.node[0], forces.weight[0] = range(4), weights
        forces.normal[0] = np.array(normal) / np.linalg.norm(normal)
        forces.stiffness[0], forces.largest_depth[0], forces.offset[0] = 1.0, 1e-3, 1.0
        forces.balance.mass[0] = masses
        forces.anchor[0] = self.across

    @property
    def across(self):
        """What separates the sides across the normal [m]."""
        apart, normal = self.forces.weight[0] @ self.x, self.forces.normal[0]
        return apart - (apart @ normal) * normal

    def evaluate(self, seconds=1e-4):
        """Return the forces on the nodes [N]."""
        self.external[:] = 0.0
        add_contact_forces(self.forces, self.x, self.v, seconds, self.external)
        return self.external.copy()


def assert_balanced(positions, forces):
    """Expect no resultant and no moment, to rounding."""
    size = np.abs(forces).sum()
    assert size > 0.0
    assert np.abs(forces.sum(axis=0)).max() < 1e-14 * size
    moment = np.cross(positions, forces).sum(axis=0)
    assert np.abs(moment).max() < 1e-12 * size * np.abs(positions).max()


def deep_pair(weights, seed):
    """Return nodes anywhere within a centimetre, pressed along any direction."""
    random = np.random.default_rng(seed)
    masses = 10.0 ** random.uniform(-8.0, -3.0, 4)
    return Pair(random.uniform(0.0, 0.01, (4, 3)), weights, random.normal(size=3), masses=masses)


@pytest.mark.parametrize("weights", [FACE, EDGES])
@pytest.mark.parametrize("seed", range(20))
def test_a_force_and_its_reaction_turn_nothing_however_deep_and_askew_they_are(weights, seed):
    pair = deep_pair(weights, seed)
    assert_balanced(pair.x, pair.evaluate())


@pytest.mark.parametrize("height", [0.0, 1e-9, -1e-3])
def test_a_force_along_the_face_or_in_it_turns_nothing(height):
    pair = Pair([[0.02, 0.03, height], *CORNERS], FACE, (1.0, 0.0, 0.0))
    assert_balanced(pair.x, pair.evaluate())


def test_a_force_across_parallel_edges_turns_nothing():
    ends = [[0.0, 0.0, 0.0], [0.01, 0.0, 0.0], [0.003, 0.004, -0.002], [0.013, 0.004, -0.002]]
    pair = Pair(ends, EDGES, (0.0, 0.0, 1.0))
    assert_balanced(pair.x, pair.evaluate())


def test_nodes_on_one_line_or_in_one_place_get_finite_forces():
    for along in ([0.0, 0.003, 0.004, 0.01], [0.0, 0.0, 0.0, 0.0]):
        pair = Pair(np.outer(along, [1.0, 2.0, -1.0]), FACE, (0.3, 1.0, 0.2))
        assert np.isfinite(pair.evaluate()).all()


def test_a_force_acts_where_its_line_meets_the_face_and_nowhere_else():
    pair = Pair([[0.004, 0.003, -1e-3], *CORNERS], FACE, (0.0, 0.0, 1.0))
    forces = pair.evaluate()
    np.testing.assert_allclose(forces[:, 2] / forces[0, 2], [1.0, -0.3, -0.4, -0.3], atol=1e-12)
    assert np.abs(forces[:, :2]).max() < 1e-12 * forces[0, 2]
    assert pair.forces.balance.has_acted == 0


def least_changed(pair, forces):
    """Return the forces without resultant and moment nearest to those, by sum(|c|^2 / m)."""
    turns = np.zeros((4, 3, 6))
    for q, x in enumerate(pair.x):
        turns[q, :, :3] = np.eye(3)
        turns[q, :, 3:] = np.cross(np.eye(3), x).T
    turns = turns.reshape(12, 6)
    by_mass = np.repeat(pair.masses, 3)[:, None] * turns
    found = np.linalg.solve(turns.T @ by_mass, turns.T @ forces.ravel())
    return forces - (by_mass @ found).reshape(4, 3)


def test_what_the_line_leaves_is_the_least_change_in_the_sense_of_gauss():
    n_deep = 0
    for seed in range(20):
        pair = deep_pair(FACE, seed)
        found = pair.evaluate()
        total = pair.forces.acting[0, :3]
        expected = least_changed(pair, np.outer(pair.forces.spread[0], total))
        np.testing.assert_allclose(found, expected, atol=1e-9 * np.abs(total).max())
        n_deep += pair.forces.balance.has_acted
    assert n_deep > 10


def test_forces_do_not_jump_as_a_node_slides_off_or_its_normal_turns_into_the_face():
    angles = np.linspace(0.0, np.pi, 4001)
    for depth in (-2e-3, -1e-6):
        before, largest = None, 0.0
        for angle in angles:
            x = 0.003 + 0.02 * angle
            pair = Pair([[x, 0.003, depth], *CORNERS], FACE, (np.sin(angle), 0.0, np.cos(angle)))
            forces = pair.evaluate()
            if before is not None:
                largest = max(largest, np.abs(forces - before).max())
            before = forces
        assert largest < 0.06 * np.linalg.norm(pair.forces.acting[0, :3])


@pytest.mark.parametrize("seed", range(5))
def test_the_work_of_a_torque_balance_is_that_by_which_the_step_changes_the_kinetic_energy(seed):
    """Of position Verlet: a kick in the middle of the step, then half a step of drift."""
    pair, h = deep_pair(FACE, seed), 1e-4
    pair.v[:] = np.random.default_rng(seed).normal(size=(4, 3))

    def kinetic():
        return 0.5 * float(pair.masses @ (pair.v**2).sum(axis=1))

    before = kinetic()
    pair.v += h * pair.evaluate(h) / pair.masses[:, None]
    pair.x += 0.5 * h * pair.v
    end_contact_substep(pair.forces, pair.x, pair.v, pair.external)
    assert pair.forces.work == pytest.approx(kinetic() - before, rel=1e-9)
    assert not pair.forces.balance.turn.any()


@pytest.mark.parametrize("seed", range(3))
def test_many_contacts_of_one_body_neither_push_nor_turn_it(seed):
    body, forces, _ = stiffened(seed)
    is_floor = forces.node[:20, 0] == forces.node[:20, 1]
    forces.stiffness[:20][is_floor] = 0.0
    forces.offset[:20] = 1e-4
    external = np.zeros_like(body.positions)
    add_contact_forces(forces, body.positions, body.velocities, 1e-3, external)
    assert_balanced(body.positions, external)
