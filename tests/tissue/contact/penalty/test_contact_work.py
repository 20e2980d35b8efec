"""A contact is passive: however its sides move, its forces do no more work than it took up."""

import numpy as np
import pytest

from tests.tissue.contact.penalty.test_line_of_action import FACE, RIDGES, deep_pair
from tissue.contact.penalty.contact_work import end_contact_substep

pytestmark = pytest.mark.kernel

STEP = 1e-4
"""Time between two evaluations [s]."""


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


@pytest.mark.parametrize("weights", [FACE, RIDGES])
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


@pytest.mark.parametrize("weights", [FACE, RIDGES])
@pytest.mark.parametrize("seed", range(20))
def test_forces_do_no_more_work_than_the_spring_gives_up_however_the_nodes_move(weights, seed):
    pair, before = pressed(weights, seed)
    moving = 0.05 * np.random.default_rng(seed).normal(size=(4, 3))
    stored, work = held_after(pair, lambda x: moving, 200)
    assert work <= before - stored + 0.01 * before
