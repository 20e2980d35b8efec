"""The number of steps follows what is stiff and what is fast, and it has a limit.

A time step that would take too many steps is refused, and changes nothing.
"""

import math
import re

import numpy as np
import pytest

from tests.support import incisions
from tissue import Material, SolverSettings, Tissue, TissueError, block, fixed_nodes
from tissue.integrators.step_size import LONGEST_MOTION, MOTION_BETWEEN_STRAIN_BOUNDS

SOLID = Material(law="neo_hookean", poisson_ratio=0.45, retardation_time=0.0)
DAMPED = Material(law="neo_hookean", poisson_ratio=0.45, retardation_time=2e-3)
FRAME = 1e-3
METHODS = ["global", "verlet"]
MANY = r"time step of .* takes some .* because (.*); at most 20,000 .* at most (\S+) s"


def moving(speed, method):
    """Return a free body that moves along x at this speed [m/s]."""
    tissue = Tissue(
        block((2, 2, 2)), SOLID, gravity=(0.0, 0.0, 0.0), solver=SolverSettings(relaxation=method)
    )
    tissue._body.velocities[: tissue.n_nodes] = [speed, 0.0, 0.0]
    return tissue


@pytest.mark.parametrize("method", METHODS)
def test_no_node_moves_farther_in_a_step_than_a_part_of_its_size(method):
    at_rest = moving(0.0, method)
    slow = at_rest.step(None, FRAME).n_substeps
    speed = 10.5 * slow * LONGEST_MOTION * at_rest.node_size / FRAME
    assert moving(speed, method).step(None, FRAME).n_substeps == math.ceil(10.5 * slow)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(
    ("speed", "said"), [(1e9, "A shorter time step"), (np.nan, "no step was taken")]
)
def test_motion_that_became_unstable_ends_with_an_error_and_can_be_read(method, speed, said):
    tissue = moving(speed, method)
    with pytest.raises(TissueError, match=rf"became unstable.*{said}"):
        for _ in range(10):
            tissue.step(None, FRAME)
    assert tissue.snapshot().positions.shape == (tissue.n_nodes, 3)


def bounds_in(tissue, n_frames):
    """Return how often the frequencies of the strained body are bounded in some frames."""
    solid = tissue._model.elasticity.arrays.solid
    before = solid.test
    for _ in range(n_frames):
        tissue.step(None, FRAME)
    return tissue._model.elasticity.arrays.solid.test - before


@pytest.mark.parametrize("method", METHODS)
def test_a_body_is_bounded_again_once_it_has_moved_by_a_part_of_its_node_size(method):
    tissue = moving(0.0, method)
    speed = 0.4 * MOTION_BETWEEN_STRAIN_BOUNDS * tissue.node_size / FRAME
    assert bounds_in(tissue, 10) == 1
    assert 4 <= bounds_in(moving(speed, method), 10) <= 5


@pytest.mark.parametrize("method", METHODS)
def test_a_body_that_was_cut_or_settled_is_bounded_again(method):
    tissue = moving(0.0, method)
    tissue.step(None, FRAME)
    tissue.incise(*incisions.incision(block((2, 2, 2)), "tilted", 0))
    assert bounds_in(tissue, 1) > 0
    tissue.settle()
    tissue.push([[0.01, 0.01, 0.01]], (0.0, 0.0, -1e-6))  # else it is at rest
    assert bounds_in(tissue, 1) > 0


@pytest.mark.parametrize(("factor", "interval"), [(1.0, 2), (2.0, 2), (4.0, 1)])
def test_damping_acts_once_in_two_steps_unless_slivers_would_be_turned_round(factor, interval):
    """The rate of the uncut body times two steps is 0.45; that of its slivers a multiple of it."""
    tissue = Tissue(block((2, 2, 2)), DAMPED, solver=SolverSettings(relaxation="verlet"))
    elastic, damping = tissue._model.elasticity.arrays, tissue._model.damping
    seconds = 0.225 / damping.rate_uncut
    elastic.highest_of_tetrahedra *= factor
    assert tissue.step(None, seconds).n_substeps == 1
    assert damping.interval == interval


def cube(relaxation="global", **quantities):
    mesh = block((4, 4, 4), (0.04, 0.04, 0.04))
    material = Material(**quantities)
    solver = SolverSettings(relaxation=relaxation)
    return Tissue(mesh, material, fixed=fixed_nodes(mesh, "left"), solver=solver)


@pytest.mark.parametrize(
    ("quantities", "dt", "reason"),
    [
        ({}, 1e6, "elements are small"),
        ({"young_modulus": 1e15}, 1e-3, ""),
        ({"density": 1e-6}, 1e-3, ""),
        ({"retardation_time": 1e6}, 1e-3, "damping"),
        ({"viscous_damping": 1e12}, 1e-3, "damping"),
    ],
)
@pytest.mark.parametrize("relaxation", METHODS)
def test_a_step_without_end_is_refused_with_its_reason_and_changes_nothing(
    quantities, dt, reason, relaxation
):
    tissue, other = cube(relaxation, **quantities), cube(relaxation, **quantities)
    before = tissue.save_state().to_bytes()
    with pytest.raises(ValueError, match=MANY) as refused:
        tissue.step(None, dt)
    assert tissue.save_state().to_bytes() == before
    found, longest = re.search(MANY, str(refused.value)).groups()
    assert reason in found
    short = 1e-3 * float(longest)
    assert tissue.step(None, short).n_substeps == other.step(None, short).n_substeps
    assert tissue.snapshot().positions.tobytes() == other.snapshot().positions.tobytes()


def test_springs_that_hold_it_too_stiffly_are_named_as_the_reason():
    tissue = cube(density=1e3)
    tissue.attach("right", stiffness=1e9)
    with pytest.raises(ValueError, match="attached to it is held stiffly"):
        tissue.step(None, 1.0)


def test_the_stiffest_springs_that_are_allowed_take_some_hundred_steps():
    tissue = cube()
    tissue.attach("right", stiffness=1e9)
    assert 100 < tissue.step(None, 1e-3).n_substeps < 1000


def test_steps_of_a_second_are_done():
    assert cube().step(None, 1.0).n_substeps > 100
