"""How far two surfaces are from each other, both ways."""

import numpy as np
import pytest

from scalpel_sim.meshing.surface import tidied
from scalpel_sim.meshing.surface_distance import farthest_apart
from tests.support import surfaces

STEP = 5e-4
"""[m]"""


def read(mesh):
    return tidied(np.asarray(mesh.vertices), np.asarray(mesh.faces))


@pytest.mark.parametrize("radii", [(0.05, 0.049), (0.049, 0.05)])
def test_balls_in_each_other_are_as_far_apart_as_their_radii(radii):
    first, second = (read(surfaces.ball(radius, 3)) for radius in radii)
    assert farthest_apart(first, second, STEP) == pytest.approx(0.001, rel=1e-6)


@pytest.mark.parametrize("spiked", [0, 1])
def test_a_spike_of_either_surface_counts(spiked):
    both = [surfaces.ball(fineness=3), surfaces.ball(fineness=3)]
    vertices = np.array(both[spiked].vertices)
    vertices[7] *= 1.1
    both[spiked].vertices = vertices
    assert farthest_apart(*map(read, both), STEP) == pytest.approx(0.005, rel=0.01)


def test_a_wall_within_the_old_body_does_not_count_and_a_gap_that_is_filled_does():
    apart = surfaces.both(surfaces.box(), surfaces.moved(surfaces.box(), (0.07, 0.0, 0.0)))
    overlapping = surfaces.both(surfaces.box(), surfaces.moved(surfaces.box(), (0.05, 0.0, 0.0)))
    gap, wall = (surfaces.trimesh.creation.box((2 * 0.03 + x, 0.05, 0.04)) for x in (0.07, 0.05))
    for mesh, x in ((gap, 0.035), (wall, 0.025)):
        mesh.apply_translation((x, 0.0, 0.0))
    # Places of the wall that are nearer than a step to the outside are not asked about.
    assert farthest_apart(read(overlapping), read(wall), STEP) <= STEP
    # The middle of the gap's walls is as far from the outside as the box is half high.
    assert farthest_apart(read(apart), read(gap), STEP) == pytest.approx(0.02, rel=1e-6)
