import mujoco
import numpy as np
import pytest

from scalpel_sim.arm.arm import CHOSEN_BY_SIZE, Arm
from scalpel_sim.arm.inverse_kinematics import geometry


def pose_in_base(arm):
    base, blade = arm.data.body("base"), arm.data.body("blade")
    back = base.xmat.reshape(3, 3).T
    return back @ (blade.xpos - base.xpos), back @ blade.xmat.reshape(3, 3)


@pytest.mark.parametrize("preset", CHOSEN_BY_SIZE)
@pytest.mark.parametrize("mount_angle", [0.0, 0.6, np.pi / 2])
def test_forward_then_inverse_kinematics_comes_back(preset, mount_angle):
    arm = Arm(preset, mount_angle=mount_angle, base_position=(0.1, 0.2, 0.03), base_yaw=0.4)
    low, high = arm.model.jnt_range.T
    random = np.random.default_rng(0)
    seen = 0
    for _ in range(100):
        angles = low + (high - low) * random.uniform(0.05, 0.95, 6)
        arm.data.qpos[:] = angles
        mujoco.mj_kinematics(arm.model, arm.data)
        gimbal = arm.data.body("base").xmat.reshape(3, 3).T @ (
            arm.data.body("gimbal").xpos - arm.data.body("torso").xpos
        )
        if np.cos(angles[0]) * gimbal[1] - np.sin(angles[0]) * gimbal[0] < 0.01:
            continue  # bent over backwards: `reach` turns the waist instead
        position, axes = pose_in_base(arm)
        found = geometry(arm.model).reach(position, axes, mount_angle)
        assert np.allclose(found.angles, angles, atol=1e-9)
        seen += 1
    assert seen > 50


def test_the_margin_is_the_smallest_distance_from_a_range_end():
    arm = Arm("touch")
    low, high = arm.model.jnt_range.T
    arm.data.qpos[:] = (low + high) / 2.0
    arm.data.qpos[3] = low[3] + 0.1 * (high[3] - low[3]) / 2.0
    mujoco.mj_kinematics(arm.model, arm.data)
    assert geometry(arm.model).reach(*pose_in_base(arm), 0.0).margin == pytest.approx(0.1)


def test_the_same_poses_give_the_same_bits_wherever_their_arrays_lie_in_memory():
    """NumPy 2.0 gave others in one of ten calls; the arm of a run that was repeated stood there."""
    arm, random = geometry(Arm("touch").model), np.random.default_rng(0)
    positions = random.uniform(-0.2, 0.2, (3000, 9, 3))
    axes = np.linalg.qr(random.normal(size=(3000, 9, 3, 3))).Q
    first, blocks = arm.reach(positions, axes, 0.4).angles, []
    for _ in range(60):
        blocks += [bytearray(int(2.0**k)) for k in random.uniform(3.0, 20.0, 100)]
        random.shuffle(blocks)
        del blocks[len(blocks) // 2 :]
        assert np.array_equal(arm.reach(positions, axes, 0.4).angles, first)
