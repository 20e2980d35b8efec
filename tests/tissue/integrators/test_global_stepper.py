"""The number of steps follows what is stiff and what is fast, and it has a limit."""

import math

import numpy as np
import pytest

from tissue import Material, SolverSettings, Tissue, TissueError, block
from tissue.integrators.step_choice import LONGEST_MOTION

SOLID = Material(law="neo_hookean", poisson_ratio=0.45, retardation_time=0.0)
FRAME = 1e-3
METHODS = ["global", "verlet"]


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
@pytest.mark.parametrize("speed", [1e9, np.nan])
def test_motion_that_became_unstable_ends_with_an_error_and_can_be_read(method, speed):
    tissue = moving(speed, method)
    with pytest.raises(TissueError, match=r"became unstable.* Use a shorter time step"):
        for _ in range(10):
            tissue.step(None, FRAME)
    assert tissue.snapshot().positions.shape == (tissue.n_nodes, 3)
