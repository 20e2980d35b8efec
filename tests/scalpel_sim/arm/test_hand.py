import mujoco
import numpy as np
import pytest

from scalpel_sim import Blade
from scalpel_sim.arm.arm import CHOSEN_BY_SIZE, Arm
from scalpel_sim.arm.hand import Hand, Impedance, add_hand
from tissue import BladeSegment, Wrench

NOTHING = Wrench(np.zeros(3), np.zeros(3), np.zeros(3))


def settle(arm, wrench_on, seconds=1.0):
    for _ in range(round(seconds / arm.model.opt.timestep)):
        arm.step1()
        arm.blade.apply(wrench_on(arm.blade.segment()))
        arm.step2()
        arm.check()


def above_desk(preset):
    """An arm on a column of 5 cm: its blade of 7 cm would else reach 7 mm into the desk."""
    return Arm(preset, blade_length=0.07, base_position=(0.0, 0.0, 0.05))


def middle(segment):
    return (segment.tip + segment.heel) / 2.0


@pytest.mark.parametrize("preset", CHOSEN_BY_SIZE)
@pytest.mark.parametrize("axis", range(3))
def test_a_held_blade_yields_by_force_over_stiffness(preset, axis):
    arm = above_desk(preset)
    load = 8.0 * np.eye(3)[axis]
    settle(arm, lambda segment: Wrench(load, np.zeros(3), middle(segment)))
    assert np.allclose(arm.hand.deflection, load / 5e3, atol=5e-6)
    assert np.allclose(arm.hand.force, -load, atol=0.02)  # the rest is friction in the joints


def test_a_torque_turns_the_blade_by_torque_over_turning_stiffness():
    arm = Arm("premium")
    before = arm.blade.segment()
    torque = 0.1 * before.forward
    settle(arm, lambda segment: Wrench(np.zeros(3), torque, middle(segment)))
    after = arm.blade.segment()
    edges = [(segment.tip - segment.heel) / arm.blade.length for segment in (before, after)]
    assert np.arccos(edges[0] @ edges[1]) == pytest.approx(0.1 / 10.0, rel=0.03)


@pytest.mark.parametrize("preset", CHOSEN_BY_SIZE)
@pytest.mark.parametrize("end", ["tip", "heel"])
@pytest.mark.parametrize("axis", range(3))
def test_a_blade_against_tissue_of_10_kilonewton_a_metre_comes_to_rest(preset, end, axis):
    arm = above_desk(preset)
    wall = getattr(arm.blade.segment(), end)[axis] - 1e-3  # starts 1 mm deep

    def push_back(segment):
        force = np.zeros(3)
        force[axis] = -1e4 * (getattr(segment, end)[axis] - wall)
        return Wrench(force, np.zeros(3), getattr(segment, end))

    settle(arm, push_back)
    assert np.abs(arm.data.qvel).max() < 1e-2


def moved(segment, shift):
    return BladeSegment(segment.tip + shift, segment.heel + shift, segment.forward)


@pytest.mark.parametrize("preset", CHOSEN_BY_SIZE)
def test_the_blade_does_not_lag_behind_a_steady_motion(preset):
    arm = Arm(preset)
    start = arm.blade.segment()
    for k in range(400):
        arm.hand.follow(moved(start, [0.0, 0.06e-3 * k, 0.0]))
        arm.step1()
        arm.step2()
    # Friction in the joints leaves 0.2 mm; dampers that resist all motion would add 0.48 mm.
    assert np.abs(arm.hand.deflection).max() < 0.3e-3


def test_the_hand_holds_any_pose_to_which_it_is_brought_slowly():
    arm = Arm("touch")
    start = arm.blade.segment()
    angle = 0.3
    turn = np.array(
        [[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]]
    )
    goal = BladeSegment(
        middle(start) + turn @ (start.tip - middle(start)),
        middle(start) + turn @ (start.heel - middle(start)),
        turn @ start.forward,
    )
    arm.hand.hold(goal)
    settle(arm, lambda segment: NOTHING)
    segment = arm.blade.segment()
    assert np.allclose(segment.tip, goal.tip, atol=2e-4)
    assert np.allclose(segment.forward, goal.forward, atol=5e-3)


@pytest.mark.parametrize("value", [0.0, -1.0, np.nan, np.inf])
def test_an_impedance_is_positive(value):
    with pytest.raises(ValueError, match="rotational_stiffness is"):
        Impedance(rotational_stiffness=value)


# A free blade in space: the hand can be added to any model.
FREE_BLADE = """
<mujoco>
  <worldbody>
    <body name="knife" gravcomp="1">
      <freejoint/> <geom type="box" size=".005 .02 .003" pos="0 .02 0" mass=".05"/>
      <site name="heel"/> <site name="tip" pos="0 .04 0"/>
    </body>
  </worldbody>
</mujoco>"""


def test_the_hand_holds_the_blade_of_any_model():
    spec = mujoco.MjSpec.from_string(FREE_BLADE)
    add_hand(spec)
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    hand, blade = Hand(model, data), Blade(model, data)
    goal = moved(blade.segment(), [0.002, -0.001, 0.003])
    hand.hold(goal)
    mujoco.mj_step(model, data, 1000)
    mujoco.mj_kinematics(model, data)
    assert np.allclose(blade.segment().tip, goal.tip, atol=1e-9)


def test_a_hand_on_a_site_that_does_not_exist_is_refused_by_name():
    with pytest.raises(ValueError, match=r"no site 'point'\. It has: 'heel', 'tip'"):
        add_hand(mujoco.MjSpec.from_string(FREE_BLADE), tip="point")
