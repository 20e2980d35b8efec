"""Time steps that would take too many steps of the integrator are refused, and change nothing."""

import re

import pytest

from tissue import Material, SolverSettings, Tissue, block, fixed_nodes

MANY = r"time step of .* takes some .* because (.*); at most 20,000 .* at most (\S+) s"


def cube(relaxation="global", **quantities):
    mesh = block((4, 4, 4), (0.04, 0.04, 0.04))
    material = Material(**quantities)
    solver = SolverSettings(relaxation=relaxation)
    return Tissue(mesh, material, fixed=fixed_nodes(mesh, "left"), solver=solver)


@pytest.mark.parametrize(
    ("quantities", "dt"),
    [
        ({}, 1e6),
        ({"young_modulus": 1e15}, 1e-3),
        ({"density": 1e-6}, 1e-3),
        ({"retardation_time": 1e6}, 1e-3),
        ({"viscous_damping": 1e12}, 1e-3),
    ],
)
@pytest.mark.parametrize("relaxation", ["global", "verlet"])
def test_a_step_without_end_is_refused_and_changes_nothing(quantities, dt, relaxation):
    tissue, other = cube(relaxation, **quantities), cube(relaxation, **quantities)
    before = tissue.save_state().to_bytes()
    with pytest.raises(ValueError, match=MANY) as refused:
        tissue.step(None, dt)
    assert tissue.save_state().to_bytes() == before
    longest = float(re.search(MANY, str(refused.value))[2])
    short = 1e-3 * longest
    assert tissue.step(None, short).n_substeps == other.step(None, short).n_substeps
    assert tissue.snapshot().positions.tobytes() == other.snapshot().positions.tobytes()


@pytest.mark.parametrize(
    ("quantities", "dt", "reason"),
    [
        ({}, 1e6, "elements are small"),
        ({"retardation_time": 1e6}, 1e-3, "damping"),
        ({"viscous_damping": 1e12}, 1e-3, "damping"),
    ],
)
@pytest.mark.parametrize("relaxation", ["global", "verlet"])
def test_the_reason_is_the_one_that_is_there(quantities, dt, reason, relaxation):
    with pytest.raises(ValueError, match=rf"because .*{reason}.*; at most"):
        cube(relaxation, **quantities).step(None, dt)


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
