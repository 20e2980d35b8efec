import math

import fcl
import numpy as np
import pytest

from bridge.collision.collisions import ArmGeom


@pytest.mark.parametrize(
    ("shape", "sizes", "why"),
    [
        ("cone", (1.0, 1.0), "is a 'cone'; wanted one of box, sphere"),
        ("box", (1.0, 1.0), "a box has 3, all positive"),
        ("sphere", (0.0,), "all positive"),
        ("capsule", (1.0, math.nan), "all positive"),
        ("cylinder", (1.0, math.inf), "all positive"),
    ],
)
def test_a_geom_of_unknown_shape_or_bad_size_is_refused_by_name(shape, sizes, why):
    with pytest.raises(ValueError, match=f"geom 'wrist'.*{why}"):
        ArmGeom("wrist", shape, sizes)


@pytest.mark.parametrize(
    ("shape", "sizes", "half_extents"),
    [
        ("box", (1.0, 2.0, 3.0), (1.0, 2.0, 3.0)),
        ("sphere", (2.0,), (2.0, 2.0, 2.0)),
        ("capsule", (1.0, 3.0), (1.0, 1.0, 4.0)),
        ("cylinder", (1.0, 3.0), (1.0, 1.0, 3.0)),
    ],
)
def test_the_box_around_a_geom_is_that_of_the_collision_library(shape, sizes, half_extents):
    geom = ArmGeom("wrist", shape, sizes)
    np.testing.assert_array_equal(geom.half_extents, half_extents)
    collision_object = fcl.CollisionObject(geom.geometry(), fcl.Transform())
    for axis in range(3):
        for gap, collides in ((-1e-3, True), (1e-3, False)):
            centre = np.zeros(3)
            centre[axis] = half_extents[axis] + 0.01 + gap
            probe = fcl.CollisionObject(fcl.Sphere(0.01), fcl.Transform(centre))
            assert bool(fcl.collide(collision_object, probe)) == collides
