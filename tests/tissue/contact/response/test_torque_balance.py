"""Contacts as springs: forces neither push nor turn their nodes, and friction obeys Coulomb."""

import numpy as np
import pytest

from tests.tissue.contact.lists import FRICTION, random_contacts, stiffened
from tissue.contact.response.contacts import (
    clear_contact_forces,
    list_touching_nodes,
    new_penalty_forces,
)
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


STEP = 1e-4
"""Time between two evaluations [s]."""


def one_on_floor(depth=1e-4, velocity=(0.0, 0.0, 0.0), stiffness=100.0):
    """Return a body whose node 0 is that deep in the floor, and the contact of that node."""
    body, _ = random_contacts(0)
    forces = new_penalty_forces(1, FRICTION, 1e-4)
    forces.n_contacts = 1
    forces.weight[0, 0] = 1.0
    forces.normal[0] = [0.0, 0.0, 1.0]
    forces.stiffness[0] = stiffness
    forces.largest_depth[0] = 1.0
    body.positions[0, 2] = -depth
    body.velocities[0] = velocity
    return body, forces


def forces_of(body, forces, seconds=1e-3):
    external = np.zeros_like(body.positions)
    add_contact_forces(forces, body.positions, body.velocities, seconds, external)
    return external


def test_a_contact_that_is_open_adds_no_force_and_one_that_parts_does_not_pull():
    for depth, velocity in ((-1e-6, (0.0, 0.0, 0.0)), (1e-4, (0.0, 0.0, 5.0))):
        body, forces = one_on_floor(depth, velocity)
        assert not forces_of(body, forces).any()


@pytest.mark.parametrize("share", [0.5, 0.99, 2.0, 50.0])
def test_friction_is_a_spring_up_to_coulombs_limit_and_no_more(share):
    body, forces = one_on_floor()
    pressure = 100.0 * 1e-4
    stretch = share * FRICTION * pressure / 100.0
    forces.anchor[0] = body.positions[0] * [1.0, 1.0, 0.0] - [stretch, 0.0, 0.0]
    external = forces_of(body, forces)
    assert external[0, 2] == pytest.approx(pressure)
    assert external[0, 0] == pytest.approx(-min(share, 1.0) * FRICTION * pressure)


def test_the_anchor_of_what_slides_follows_until_the_spring_bears_coulombs_limit():
    body, forces = one_on_floor()
    forces.anchor[0] = body.positions[0] * [1.0, 1.0, 0.0] - [0.01, 0.0, 0.0]
    end_contact_substep(forces, body.positions, body.velocities, np.zeros_like(body.positions))
    assert body.positions[0, 0] - forces.anchor[0, 0] == pytest.approx(FRICTION * 1e-4)
    assert forces.n_pressing == 1
    assert forces.push[0] == pytest.approx(1e-2)
    assert forces.stored == pytest.approx(0.5 * 100.0 * 1e-8 * (1.0 + FRICTION**2))


def test_impulse_of_the_floor_and_work_are_counted_by_the_weight_of_the_evaluation():
    body, forces = one_on_floor(velocity=(0.0, 0.0, -0.5))
    external = forces_of(body, forces, 2e-3)
    np.testing.assert_allclose(forces.floor_impulse, 2e-3 * external[0])
    impulse = 2e-3 * external[0, 2]
    body.velocities[0, 2] = -0.1
    end_contact_substep(forces, body.positions, body.velocities, external)
    assert forces.work == pytest.approx(-0.3 * impulse)
    assert forces.pressure_impulse == 0.0


def test_forces_are_cleared_at_the_nodes_of_contacts_and_nowhere_else():
    body, forces = one_on_floor()
    list_touching_nodes(forces, np.zeros(body.n_nodes))
    assert list(forces.touching[: forces.n_nodes]) == [0]
    external = np.ones_like(body.positions)
    clear_contact_forces(forces, external)
    assert (external == 1.0).all(), "no forces have been added"
    add_contact_forces(forces, body.positions, body.velocities, 1e-3, external)
    clear_contact_forces(forces, external)
    assert not external[0].any()
    assert (external[1:] == 1.0).all()


def held_after(pair, velocities, n):
    """Move the nodes for `n` steps; return what the contact holds then, and all it did in work [J].

    Args:
        pair: The contact.
        velocities: Takes the positions; returns the velocities [m/s].
        n: How many steps.
    """
    for _ in range(n):
        middle = pair.x + 0.5 * STEP * velocities(pair.x)
        after = pair.x + STEP * velocities(middle)
        pair.x[:], pair.v[:] = middle, velocities(middle)
        pair.evaluate(STEP)
        pair.x[:] = after
        end_contact_substep(pair.forces, pair.x, pair.v, pair.external)
    return pair.forces.stored, pair.forces.work


def pressed(weights, seed):
    """Return a contact that is pressed by 0.4 mm, and what it holds [J]."""
    pair = deep_pair(weights, seed)
    forces = pair.forces
    along = (forces.weight[0] @ pair.x) @ forces.normal[0]
    forces.offset[0] = along + 4e-4
    end_contact_substep(forces, pair.x, pair.v, pair.external)
    return pair, forces.stored


@pytest.mark.parametrize("weights", [FACE, EDGES])
@pytest.mark.parametrize("seed", range(10))
def test_sides_that_turn_as_one_body_get_nothing_and_leave_the_spring_no_more_than_it_held(
    weights, seed
):
    for sign in (-1.0, 1.0):
        pair, before = pressed(weights, seed)
        axis = sign * np.random.default_rng(seed).normal(size=3)
        stored, work = held_after(pair, lambda x, axis=axis: np.cross(axis, x), 1000)
        assert abs(work) < 1e-5 * before
        assert stored < (1.0 + 1e-6) * before


@pytest.mark.parametrize("weights", [FACE, EDGES])
@pytest.mark.parametrize("seed", range(20))
def test_forces_do_no_more_work_than_the_spring_gives_up_however_the_nodes_move(weights, seed):
    pair, before = pressed(weights, seed)
    moving = 0.05 * np.random.default_rng(seed).normal(size=(4, 3))
    stored, work = held_after(pair, lambda x: moving, 200)
    assert work <= before - stored + 0.01 * before


@pytest.mark.parametrize("seed", range(5))
def test_the_two_sides_of_a_contact_get_equal_and_opposite_forces(seed):
    body, forces, _ = stiffened(seed)
    is_floor = forces.node[:20, 0] == forces.node[:20, 1]
    forces.stiffness[:20][is_floor] = 0.0
    forces.offset[:20] = 1e-4
    external = forces_of(body, forces)
    assert np.abs(external).max() > 0.0
    assert np.abs(external.sum(axis=0)).max() < 1e-12 * np.abs(external).sum()
