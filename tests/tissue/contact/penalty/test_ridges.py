"""Edges touch edges where both are ridges, and the direction across both is out of both bodies."""

import itertools

import numpy as np
import pytest

from tests.overlaps import NO_GRAVITY, joined
from tests.test_conservation import momentum
from tests.tissue.contact.penalty.two_blocks import SIZE, TwoBlocks
from tissue import Material, TetrahedralMesh, Tissue
from tissue.contact.penalty.near_pairs import CONTACT_REACH

pytestmark = pytest.mark.kernel

DT = 1e-4
"""Length of a frame [s]: the method is of fourth order in it, so momentum is kept to 1e-8."""

FALLING = [0.02, 0.01, -0.2]
"""Velocity of the upper roof [m/s]."""


def edges_of_ridges(search: TwoBlocks) -> set[tuple[int, int]]:
    """Return the ridges that are listed, lower node first."""
    ridges = search.ridges
    listed = ridges.listed[: ridges.n_ridges]
    return {tuple(sorted(map(int, ridges.node[edge]))) for edge in listed}


def test_the_ridges_of_blocks_are_their_edges_each_once():
    search = TwoBlocks()
    search.look()
    # Along each edge of a block two of its coordinates are at their ends.
    x = search.body.rest[: search.body.n_nodes]
    wanted = set()
    for of_block in (search.is_upper, ~search.is_upper):
        nodes = np.flatnonzero(of_block[: len(x)])
        low, high = x[nodes].min(axis=0), x[nodes].max(axis=0)
        for a, b in itertools.combinations(nodes, 2):
            at_end = np.isclose(x[a], x[b]) & (np.isclose(x[a], low) | np.isclose(x[a], high))
            if at_end.sum() == 2 and np.linalg.norm(x[a] - x[b]) < 1.1 * SIZE:
                wanted.add((int(a), int(b)))
    assert len(wanted) == 2 * (8 * 2 + 4)
    assert edges_of_ridges(search) == wanted
    assert search.ridges.n_ridges == len(wanted)


def ridges_within_reach(search: TwoBlocks) -> set[frozenset[int]]:
    """Return the pairs of ridges of two blocks that cross within reach and face each other."""
    x, ridges = search.body.positions, search.ridges
    middle = {upper: x[search.is_upper == upper].mean(axis=0) for upper in (False, True)}
    near = set()
    for one, other in itertools.combinations(ridges.listed[: ridges.n_ridges], 2):
        (a, b), (c, d) = x[ridges.node[one]], x[ridges.node[other]]
        of_upper = [bool(search.is_upper[ridges.node[edge, 0]]) for edge in (one, other)]
        if of_upper[0] == of_upper[1]:
            continue
        system = np.column_stack([b - a, c - d])
        (s, t), *_ = np.linalg.lstsq(system, c - a, rcond=None)
        apart = a + s * (b - a) - c - t * (d - c)
        if not (0.0 < s < 1.0 and 0.0 < t < 1.0 and np.linalg.norm(apart) < CONTACT_REACH * SIZE):
            continue
        if (a - middle[of_upper[0]]) @ (c - middle[of_upper[1]]) < 0.0:
            near.add(frozenset(map(int, (*ridges.node[one], *ridges.node[other]))))
    return near


@pytest.mark.parametrize("seed", range(3))
def test_no_ridges_within_reach_are_missing_as_nodes_move(seed):
    search, random = TwoBlocks(), np.random.default_rng(seed)
    search.body.positions[search.is_upper] += [0.014, 0.003, -0.0002]
    n_near = 0
    for _ in range(20):
        move = random.normal(scale=2e-4, size=search.body.positions.shape)
        drift = random.normal(scale=5e-4, size=3) * [1.0, 1.0, 0.2]
        search.body.positions[:] += move * (random.random() < 0.5)
        search.body.positions[search.is_upper] += drift
        search.look()
        found, node = search.ridge_pairs, search.ridges.node
        pairs = found.ridge[: found.n_pairs]
        listed = {frozenset(map(int, (*node[one], *node[other]))) for one, other in pairs}
        assert len(listed) == found.n_pairs
        near = ridges_within_reach(search)
        assert near <= listed
        n_near += len(near)
    assert n_near > 3 and search.n_updates > 2


def roof(upside_down: bool) -> TetrahedralMesh:
    """Return a tetrahedron whose upper edge is a ridge along x, or its lower one along y."""
    positions = SIZE * np.array(
        [[-1.0, 0.0, 1.0], [1.0, 0.0, 1.0], [0.0, -1.0, 0.0], [0.0, 1.0, 0.0]]
    )
    if upside_down:  # turned about the bisector of the x and y axes
        positions = positions[:, [1, 0, 2]] * [1.0, 1.0, -1.0] + [0.0, 0.0, SIZE]
    return TetrahedralMesh(positions, np.array([[0, 1, 2, 3]]))


def two_roofs(beside: float) -> Tissue:
    """Return a roof that falls on another, `beside` it along y [m], from 0.5 mm above."""
    mesh = joined(roof(False), roof(True), (0.0, beside, 0.0105))
    free = Material(30e3, viscous_damping=0.0, retardation_time=0.0, friction=0.0)
    tissue = Tissue(mesh, free, gravity=NO_GRAVITY)
    tissue._body.velocities[4:8] = FALLING
    return tissue


def contacts_of(tissue: Tissue) -> int:
    """Let roofs meet; return the greatest number of contacts."""
    return max(tissue.step(None, DT).body_contacts.n_contacts for _ in range(100))


@pytest.mark.parametrize("beside", [0.0, 0.003])
def test_ridges_that_cross_push_each_other_apart_and_keep_their_momentum(beside):
    tissue = two_roofs(beside)
    linear, angular = momentum(tissue)
    assert contacts_of(tissue) == 1
    body = tissue.snapshot()
    assert body.velocities[:4, 2].mean() < body.velocities[4:, 2].mean()
    linear_t1, angular_t1 = momentum(tissue)
    np.testing.assert_allclose(linear_t1, linear, atol=1e-12 * np.linalg.norm(linear))
    np.testing.assert_allclose(angular_t1, angular, atol=1e-8 * np.linalg.norm(angular))


def test_ridges_that_pass_beside_each_other_do_not_touch():
    tissue = two_roofs(0.0215)
    assert contacts_of(tissue) == 0
    np.testing.assert_allclose(tissue.snapshot().velocities[4:], [FALLING] * 4)


def test_ridges_that_lost_their_contact_and_overlap_come_apart_slowly():
    tissue, deep = two_roofs(0.0), 3e-4
    body = tissue._body
    body.velocities[:] = 0.0
    body.positions[4:8, 2] -= 5e-4 + deep
    assert contacts_of(tissue) == 1

    def gap() -> float:
        return float(body.positions[4:6, 2].min() - body.positions[:2, 2].max())

    assert -deep < gap() < -0.2 * deep, "they come out at one node size per second"
    for _ in range(400):
        tissue.step(None, DT)
    assert gap() > -0.1 * deep
