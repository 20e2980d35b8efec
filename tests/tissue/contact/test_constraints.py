"""What contacts may leave of an overlap, and what they carry over to the next step."""

import pytest

from tests.tissue.contact.on_floor import STEP, one_on_floor
from tissue.contact.constraints import (
    WARM_START_SHARE,
    carry_over,
    gap,
    set_slop,
    warm_start,
)
from tissue.contact.solver import solve_positions, solve_velocities

pytestmark = pytest.mark.kernel


def test_of_what_was_in_the_floor_before_the_step_a_little_is_undone():
    body, contacts = one_on_floor([0.0, 0.0, 0.0], depth=3e-4, before=2e-4, recovery=0.5e-4 / STEP)
    solve_positions(contacts, body, body.positions.copy(), 0.3, 0.0)
    assert gap(contacts, body.positions, 0) == pytest.approx(-1.5e-4, abs=1e-18)


@pytest.mark.parametrize("n_steps", [1, 4])
def test_an_overlap_is_undone_at_the_same_speed_in_steps_of_any_length(n_steps):
    """Where a step undid as much however short, nodes that are pinched were thrown to and fro."""
    body, contacts = one_on_floor([0.0, 0.0, 0.0], depth=3e-4, before=3e-4, recovery=0.1)
    body.positions[0, 2] = -3e-4
    for _ in range(n_steps):
        contacts.position_impulse[0], contacts.seconds = 0.0, STEP / n_steps
        set_slop(contacts, 0, body.positions)
        solve_positions(contacts, body, body.positions.copy(), 0.3, 0.0)
    assert gap(contacts, body.positions, 0) == pytest.approx(-3e-4 + 0.1 * STEP)


def fall(body, g=9.81):
    """Let node 0 fall freely for a step, from where it is and as it moves."""
    body.positions[0, 2] += STEP * body.velocities[0, 2] - 0.5 * STEP**2 * g
    body.velocities[0, 2] -= STEP * g


def test_what_rests_needs_no_more_than_what_it_took_in_the_step_before():
    """Not in the second step: it is not known yet whether the first was an impact."""
    body, contacts = one_on_floor([0.0, 0.0, 0.0])
    for step in range(4):
        start = body.positions.copy()
        fall(body)
        if step > 0:
            carry_over(contacts, 0, 0, 1.0)
            warm_start(contacts, body, 0)
        set_slop(contacts, 0, start)
        is_right = abs(gap(contacts, body.positions, 0)) < 1e-15
        assert is_right == (step > 1)
        assert (abs(body.velocities[0, 2]) < 1e-12) == is_right
        solve_positions(contacts, body, start, 0.3, 0.0)
        solve_velocities(contacts, body, 0.3, STEP, 0.0)
    assert contacts.impulse[0] == pytest.approx(0.5 * 9.81 * STEP)


def test_a_step_that_is_twice_as_long_begins_with_twice_the_impulse():
    _, contacts = one_on_floor([0.0, 0.0, -1.0])
    contacts.impulse[0], contacts.last_impulse[0], contacts.position_impulse[0] = 2.0, 2.0, 1e-4
    contacts.seconds = 2.0 * STEP
    carry_over(contacts, 0, 0, 2.0)
    assert contacts.impulse[0] == 4.0
    assert contacts.position_impulse[0] == pytest.approx(4e-4)


def test_sides_that_cannot_be_parted_take_no_more_in_each_step():
    """What a contact begins with is bounded by its impulse; without one, by a share of the last."""
    _, contacts = one_on_floor([0.0, 0.0, 0.0])
    contacts.seconds = STEP
    contacts.position_impulse[0] = 1.0
    carry_over(contacts, 0, 0, 1.0)
    assert contacts.position_impulse[0] == WARM_START_SHARE < 1.0 and contacts.impulse[0] == 0.0
