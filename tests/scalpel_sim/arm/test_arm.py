import logging
import os
import subprocess
import sys

import mujoco
import numpy as np
import pytest

from scalpel_sim.arm.arm import ASSETS, CHOSEN_BY_SIZE, Arm, ArmError
from tissue import Wrench

BOTH = pytest.mark.parametrize("preset", CHOSEN_BY_SIZE)


@BOTH
def test_the_model_file_opens_by_itself(preset):
    model = mujoco.MjModel.from_xml_path(str(ASSETS / f"{preset}.xml"))
    assert [model.joint(i).name for i in range(model.njnt)] == [
        "waist",
        "shoulder",
        "elbow",
        "yaw",
        "pitch",
        "roll",
    ]
    assert model.opt.timestep == 1e-3


@BOTH
def test_the_arm_is_balanced_and_stays_where_it_is_left(preset):
    arm = Arm(preset)
    before = arm.data.qpos.copy()
    for _ in range(1000):
        arm.step1()
        arm.step2()
        arm.check()
    assert np.allclose(arm.data.qpos, before, atol=1e-9)


@pytest.mark.parametrize(("preset", "published"), [("touch", 0.045), ("premium", 0.075)])
def test_the_apparent_mass_at_the_gimbal_is_as_published(preset, published):
    """The figures are the vendor's. The mass differs by direction, as it does in the device."""
    arm = Arm(preset)
    inertia = np.zeros((6, 6))
    mujoco.mj_fullM(arm.model, arm.data, inertia)
    jacobian = np.zeros((3, 6))
    gimbal = arm.model.body("gimbal").id
    mujoco.mj_jac(arm.model, arm.data, jacobian, None, arm.data.xpos[gimbal], gimbal)
    apparent = np.linalg.eigvalsh(np.linalg.inv(jacobian @ np.linalg.solve(inertia, jacobian.T)))
    assert 0.9 * published < apparent[0] < apparent[2] < 2.2 * published


@BOTH
def test_the_blade_has_the_given_length_and_forward_is_across_it(preset):
    arm = Arm(preset, blade_length=0.083, mount_angle=0.7)
    segment = arm.blade.segment()
    assert np.linalg.norm(segment.tip - segment.heel) == pytest.approx(0.083)
    assert segment.forward @ (segment.tip - segment.heel) == pytest.approx(0.0, abs=1e-12)


def test_the_mount_angle_is_that_between_stylus_and_blade():
    arm = Arm("touch", mount_angle=0.7)
    stylus, blade = (arm.data.body(name).xmat.reshape(3, 3)[:, 1] for name in ("stylus", "blade"))
    assert np.arccos(stylus @ blade) == pytest.approx(0.7)


def test_the_base_has_the_given_position_and_yaw():
    here, there = (
        Arm("touch", base_position=position, base_yaw=yaw).blade.segment()
        for position, yaw in (((0, 0, 0), 0.0), ((0.1, 0.2, 0.3), np.pi / 2))
    )
    x, y, z = here.tip
    assert np.allclose(there.tip, [0.1 - y, 0.2 + x, 0.3 + z])


def test_an_unknown_arm_is_refused_with_the_known_ones():
    with pytest.raises(ValueError, match="Did you mean 'touch'\\? Known: touch, premium, psm"):
        Arm("toch")


@pytest.mark.parametrize(
    ("qpos", "message"),
    [
        ([0, 0.5, 0, 0, 1.5], "must be 6 finite angles"),
        ([0, 0.5, 0, 0, 1.5, np.nan], "must be 6 finite angles"),
        (
            [0, 2.0, 0, 0, 1.5, 0],
            "joint 'shoulder' is set to 2.000 rad; its range is 0.000 to 1.75",
        ),
    ],
)
def test_angles_that_the_arm_cannot_take_are_refused(qpos, message):
    with pytest.raises(ValueError, match=message):
        Arm("touch").reset(qpos)


def test_a_state_that_is_not_finite_stops_the_run_and_never_resets_silently():
    arm = Arm("touch")
    for _ in range(10):
        arm.step1()
        arm.step2()
    arm.data.qvel[1] = np.nan
    with pytest.raises(ArmError, match=r"t = 0.0100 s .*\(joints: shoulder\)"):
        arm.check()


def test_angles_that_are_no_numbers_are_found_before_the_first_check_too():
    arm = Arm("touch")
    arm.data.qpos[:] = np.nan
    with pytest.raises(ArmError, match="state is not finite"):
        arm.check_if_set()


@pytest.mark.parametrize(
    "where, value", [("qvel", 1e3), ("qvel", 1e9), ("qpos", 1e3), ("qpos", -1e9), ("qvel", 501.0)]
)
def test_a_joint_that_no_hand_moves_so_is_named(where, value):
    arm = Arm("touch")
    for _ in range(10):
        arm.step1()
        arm.step2()
        arm.check()
    getattr(arm.data, where)[1] = value
    with pytest.raises(ArmError, match=r"t = 0.0100 s joint 'shoulder' moves by .* rad, or m"):
        arm.check()
    arm.reset(arm.model.key("home").qpos)  # it may be put elsewhere on purpose
    arm.check()


@pytest.mark.parametrize("force", [np.nan, 1e12])
def test_a_force_that_bypasses_the_blade_is_detected_within_the_step(force, caplog):
    arm = Arm("touch")
    arm.step1()
    arm.data.xfrc_applied[arm.blade.body_id, 0] = force
    with caplog.at_level(logging.WARNING, "scalpel_sim"), pytest.raises(ArmError):
        arm.step2()
        arm.check()
        arm.step1()  # MuJoCo checks the state when a step begins
        arm.check()
    assert arm.time > 0.0


def test_mujoco_leaves_no_log_file_behind(tmp_path):
    script = (
        "from scalpel_sim.arm.arm import Arm\n"
        "arm = Arm('touch')\n"
        "arm.data.qpos[0] = float('nan')\n"
        "arm.step1()\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", script],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
    )
    assert done.returncode == 0, done.stderr
    assert "MuJoCo: " in done.stderr
    assert list(tmp_path.iterdir()) == []


def test_a_reset_arm_moves_like_a_new_one():
    arm = Arm("touch")
    fresh = Arm("touch")
    arm.blade.apply(Wrench(np.array([3.0, 0, 0]), np.zeros(3), arm.blade.segment().tip))
    for _ in range(50):
        arm.step1()
        arm.step2()
    arm.reset(arm.model.key("home").qpos)
    for _ in range(20):
        for each in (arm, fresh):
            each.step1()
            each.step2()
    assert np.array_equal(arm.data.qpos, fresh.data.qpos)
    assert arm.time == fresh.time
