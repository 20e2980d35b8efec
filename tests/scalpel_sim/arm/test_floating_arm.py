"""Instruments that no arm carries are where their hands are, in frames of any length."""

import numpy as np
import pytest

from scalpel_sim import SCENES, changed, prepare
from scalpel_sim.arm.floating_arm import FloatingArm
from scalpel_sim.arm.grasper import HALF_PAD

FRAME = 0.02


@pytest.fixture(scope="module")
def retract():
    return prepare(SCENES["retract"], records=False, frame_seconds=FRAME)


def test_the_blade_is_where_its_stroke_has_it_in_each_frame():
    simulation = prepare(SCENES["slab"], records=False, frame_seconds=FRAME)
    for i in range(20):
        simulation.step()
        edge, wanted = simulation.blade.segment, simulation.stroke.pose(i * FRAME)
        for now, then in zip(edge, wanted, strict=True):
            assert np.allclose(now, then, atol=1e-12)


def test_a_cut_in_frames_of_20_ms_is_that_of_an_arm_at_1_khz():
    found = []
    for frame in (None, FRAME):
        simulation = prepare(SCENES["grid2"], records=False, frame_seconds=frame)
        forces = []
        simulation.run(simulation.duration, lambda s, f=forces: f.append(s.wrench.force.copy()))
        found.append((simulation.result.cut_area, np.linalg.norm(forces, axis=1).max()))
    (area, peak), (floating_area, floating_peak) = found
    assert floating_area == pytest.approx(area, rel=1e-6)
    assert floating_peak == pytest.approx(peak, rel=0.05)


def test_a_grasper_goes_along_its_motion_and_pulls_as_one_of_an_arm_does(retract):
    with_arm = prepare(SCENES["retract"], records=False)
    seconds = 1.0
    for simulation in (with_arm, retract):
        simulation.reset()
        simulation.run(seconds)
    (grasper,), (other,) = retract.graspers, with_arm.graspers
    wanted = grasper.motion.stroke(HALF_PAD, HALF_PAD).pose(seconds - FRAME)
    assert np.allclose(grasper.grasper.pads.centre, 0.5 * (wanted.tip + wanted.heel), atol=1e-12)
    assert grasper.grasper.opening == pytest.approx(grasper.motion.opening(seconds - FRAME))
    assert grasper.holds and other.holds
    forces = [np.linalg.norm(each.wrench.force) for each in (grasper, other)]
    assert forces[0] == pytest.approx(forces[1], rel=0.05)


def test_it_returns_to_its_start_to_the_bit(retract):
    def forces():
        retract.reset()
        found = []
        retract.run(0.5, lambda s: found.append(s.graspers[0].wrench.numbers))
        return np.array(found)

    assert np.array_equal(forces(), forces())


def test_a_pose_jumps_as_a_whole_however_the_blade_is_turned():
    scene = changed(SCENES["grid2"], stroke="press")
    simulation = prepare(scene, records=False, frame_seconds=FRAME)
    arm = simulation.arm
    assert isinstance(arm, FloatingArm)
    rng = np.random.default_rng(0)
    for _ in range(20):
        axes = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        place = rng.normal(size=3)
        pose = simulation.blade.segment._replace(
            tip=place + 0.5 * arm.blade.length * axes[0],
            heel=place - 0.5 * arm.blade.length * axes[0],
            forward=axes[1],
        )
        arm.hand.follow(pose)
        arm.step1()
        for now, then in zip(arm.blade.segment(), pose, strict=True):
            assert np.allclose(now, then, atol=1e-12)
