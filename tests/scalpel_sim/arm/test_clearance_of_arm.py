"""An arm that is far from everything is tested rarely, and no collision is missed for it."""

import mujoco
import numpy as np
import pytest

from bridge import Collisions, FixtureBox, FixtureMesh
from scalpel_sim.arm.arm import CHOSEN_BY_SIZE, Arm
from scalpel_sim.arm.collision_geoms import ArmParts, tables
from scalpel_sim.arm.collision_monitor import CollisionMonitor

CLAMP = FixtureBox("clamp", np.array([0.02, 0.01, 0.12]), np.array([0.03, 0.2, 0.06]))
SHEET = FixtureMesh(
    "sheet",
    np.array([[-0.2, 0.1, 0.25], [0.0, 0.3, 0.2], [-0.1, 0.2, 0.4]]),
    np.array([[0, 1, 2]]),
)


def wander(arm, rng, n_frames):
    """Turn the joints smoothly to and fro, at speeds that change; yield in each frame."""
    low, high = arm.model.jnt_range.T
    angles, step = arm.data.qpos.copy(), np.zeros(6)
    for i in range(n_frames):
        if i % 100 == 0:
            speed = rng.choice([1e-4, 1e-3, 5e-3])
            step = speed * np.sign(rng.uniform(low, high) - angles) * rng.uniform(0.0, 1.0, 6)
        angles = np.clip(angles + step, low, high)
        arm.data.qpos[:] = angles
        mujoco.mj_kinematics(arm.model, arm.data)
        yield


@pytest.mark.parametrize("preset", CHOSEN_BY_SIZE)
@pytest.mark.parametrize("seed", range(3))
def test_the_collisions_of_every_frame_are_those_of_a_test_in_every_frame(preset, seed, caplog):
    arm, rng = Arm(preset, blade_length=0.08), np.random.default_rng(seed)
    fixtures = [CLAMP, SHEET]
    monitor = CollisionMonitor(arm, fixtures)
    parts = ArmParts(arm.model, arm.data, arm.blade.body_id)
    always = Collisions(parts.parts, [*tables(arm.model).values(), *fixtures])
    n_touching, n_free = 0, 0
    for _ in wander(arm, rng, 3000):
        monitor.check()
        found = always.colliding_pairs(parts.positions(), parts.axes())
        assert monitor.now == found
        n_touching += bool(found)
        n_free += not found
    assert n_free > 100 and n_touching > 10
