"""Slop: how much of an overlap contacts leave; warm start: what they carry to the next step."""

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


def test_an_overlap_from_before_the_step_is_undone_only_in_part():
    body, contacts = one_on_floor([0.0, 0.0, 0.0], depth=3e-4, before=2e-4, recovery=0.5e-4 / STEP)
    solve_positions(contacts, body, body.positions.copy(), 0.3, 0.0)
    assert gap(contacts, body.positions, 0) == pytest.approx(-1.5e-4, abs=1e-18)


@pytest.mark.parametrize("n_steps", [1, 4])
def test_an_overlap_is_undone_at_the_same_speed_in_steps_of_any_length(n_steps):
    """A correction that does not depend on the step length made pinched nodes oscillate."""
    body, contacts = one_on_floor([0.0, 0.0, 0.0], depth=3e-4, before=3e-4, recovery=0.1)
    body.positions[0, 2] = -3e-4
    for _ in range(n_steps):
        contacts.position_impulse[0], contacts.seconds = 0.0, STEP / n_steps
        set_slop(contacts, 0, body.positions)
        solve_positions(contacts, body, body.positions.copy(), 0.3, 0.0)
    assert gap(contacts, body.positions, 0) == pytest.approx(-3e-4 + 0.1 * STEP)


def fall(body, g=9.81):
    """Advance node 0 by one step of free fall."""
    body.positions[0, 2] += STEP * body.velocities[0, 2] - 0.5 * STEP**2 * g
    body.velocities[0, 2] -= STEP * g


def test_a_resting_contact_needs_no_more_than_the_impulse_of_the_last_step():
    """This does not hold in the second step: the first may have been an impact."""
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


def test_the_impulse_of_contacts_that_cannot_be_separated_does_not_grow():
    """The position impulse starts below the velocity impulse or a share of the last one."""
    _, contacts = one_on_floor([0.0, 0.0, 0.0])
    contacts.seconds = STEP
    contacts.position_impulse[0] = 1.0
    carry_over(contacts, 0, 0, 1.0)
    assert contacts.position_impulse[0] == WARM_START_SHARE < 1.0 and contacts.impulse[0] == 0.0
