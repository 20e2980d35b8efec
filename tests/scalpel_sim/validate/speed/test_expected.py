"""The real-time factor of each scene follows from one number, and the machine is described."""

import pytest

from scalpel_sim.scene.read import SCENES
from scalpel_sim.scene.scene import changed
from scalpel_sim.validate.speed.expected import (
    N_FRAMES,
    ReferenceFrames,
    as_run,
    expected_factors,
    scene_costs,
)


def test_a_scene_that_costs_two_frames_of_half_a_millisecond_runs_in_real_time():
    factors = expected_factors(0.5e-3, {"a": 2.0, "b": 0.1})
    assert factors == {"a": pytest.approx(1.0), "b": pytest.approx(20.0)}


def test_twice_the_time_of_the_reference_halves_every_factor():
    costs = scene_costs()
    fast, slow = (expected_factors(seconds, costs) for seconds in (1e-3, 2e-3))
    assert {name: fast[name] / slow[name] for name in costs} == dict.fromkeys(costs, 2.0)


def test_every_scene_that_is_shipped_has_a_cost():
    assert list(scene_costs()) == list(SCENES)
    assert min(scene_costs().values()) > 0.0


def test_the_costs_are_ordered_as_the_bodies_are():
    """48, 576 and some 5,400 tetrahedra: no processor puts these in another order."""
    costs = scene_costs()
    assert costs["grid2"] < costs["slab"] < costs["organ"] < costs["excise"]


def test_the_same_frames_of_the_organ_are_done_each_time():
    reference = ReferenceFrames()
    simulation = reference._simulation
    cut = []
    for _ in range(2):
        assert reference.seconds(1) > 0.0
        cut.append(simulation.result.cut_area)
        assert simulation.n_frames % N_FRAMES == 0
    assert cut[0] == cut[1] > 0.0
    assert simulation.result.wrench.force.any()


def test_a_scene_is_measured_as_run_does_it():
    """With an account of the energy, where the relaxation can keep one."""
    organ = SCENES["organ"]
    assert as_run(organ).solver.audit and not organ.solver.audit
    assert not as_run(changed(organ, law="springs", relaxation="hierarchical")).solver.audit
