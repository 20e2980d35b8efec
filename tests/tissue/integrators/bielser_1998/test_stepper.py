"""The number of steps that each ring takes in a frame."""

import itertools

import pytest

from tests.tissue.integrators.networks import block
from tissue import Hierarchical
from tissue.integrators.bielser_1998.stepper import HierarchicalStepper, ring_steps


def steps(options, needed):
    n, every = ring_steps(options, needed)
    assert all(n % e == 0 for e in every)
    assert all(later % earlier == 0 for earlier, later in itertools.pairwise(every))
    return [n // e for e in every.tolist()]


def test_each_ring_takes_half_the_steps_of_the_one_inside_as_in_the_paper():
    options = Hierarchical(updates=16, rings=4)
    assert steps(options, [0.5] * 6) == [16, 8, 4, 2, 1, 1]


def test_a_ring_that_would_be_unstable_takes_twice_or_four_times_as_many_steps():
    options = Hierarchical(updates=16, rings=4)
    assert steps(options, [9.0, 0.5, 0.5, 0.5, 3.5, 1.5]) == [16, 8, 4, 4, 4, 2]


def test_rings_inside_a_stiff_one_take_no_fewer_steps():
    options = Hierarchical(updates=8, rings=3)
    assert steps(options, [0.5, 0.5, 14.0, 0.5, 0.5]) == [16, 16, 16, 1, 1]


@pytest.mark.parametrize("updates", [12, 24, 96])
def test_updates_need_not_be_a_power_of_two(updates):
    options = Hierarchical(updates=updates, rings=2)
    needed = [0.5, 0.5, 1.1 * updates, 3.5]
    found = steps(options, needed)
    assert all(taken >= least for taken, least in zip(found, needed, strict=True))


def test_after_a_body_was_settled_all_its_nodes_have_moved_even_frozen_ones():
    body = block(2).body
    stepper = HierarchicalStepper(Hierarchical(updates=16, rings=3, far="frozen"), len(body.rest))
    stepper.body_moved(body)
    assert stepper.moved.n_nodes == body.n_nodes
