"""Bodies of an arm that overlap as its file has them, and ways on which it is clear of itself."""

import logging

import mujoco
import numpy as np
import pytest

from bridge import DeviceLimits, TissueFrame
from scalpel_sim.arm.overlaps import first_configuration, overlaps, pass_where_they_overlap
from scalpel_sim.instruments.own_arm import move_to_start, own_arm
from scalpel_sim.strokes.stroke import Stroke
from tissue import BladeSegment

TWO_ELBOWS = """
<mujoco>
  <default><joint axis="0 0 1" armature=".1" damping="1" range="-170 170"/></default>
  <worldbody>
    POSTS
    <body><joint/><geom type="capsule" size=".02" fromto="0 0 0 .3 0 0" mass="1"/>
      <body name="fore" pos=".3 0 0"><joint name="elbow"/>
        <geom type="capsule" size=".02" fromto="0 0 0 .3 0 0" mass="1"/>
        <body pos=".3 0 0"><joint/><geom size=".02" mass=".3"/>
          <site name="heel" pos="0 0 -.05"/><site name="tip" pos="0 0 -.09"/>
        </body>
      </body>
    </body>
  </worldbody>
  <keyframe><key qpos=".7 -1.4 .7"/></keyframe>
</mujoco>
"""
LEFT, RIGHT = (
    f'<geom name="{name}" type="cylinder" size=".03 .1" pos=".23 {y} 0"/>'
    for name, y in (("left", 0.19), ("right", -0.19))
)

LOW, HIGH = 0.02, 0.03
BALLS = f"""
<mujoco>
  <worldbody>
    <geom type="plane" size="1 1 .1"/>
    <body name="base" pos="0 0 {HIGH}"><geom size=".025" mass="1"/>
      <body><joint axis="0 0 1" range="30 90"/><geom size=".02" mass="1"/>
        <body name="end" pos="0 0 .035"><joint axis="0 1 0"/><geom size=".02" mass="1"/>
          <body name="ball" pos="0 0 {LOW - 0.065}">
            <joint type="slide" axis="0 0 1"/><geom size=".03" mass="1"/>
          </body>
        </body>
      </body>
    </body>
  </worldbody>
</mujoco>
"""


def moved_to_start(tmp_path, posts):
    """Return an arm of two elbows at the start of a stroke, among posts."""
    path = tmp_path / "elbows.xml"
    path.write_text(TWO_ELBOWS.replace("POSTS", posts), encoding="utf-8")
    arm = own_arm(path, DeviceLimits(), forward=(1.0, 0.0, 0.0))
    tips = np.array([[0.459, 0.0, -0.09], [0.44, 0.0, -0.09]])
    up, ahead = np.array([0.0, 0.0, 0.04]), np.array([1.0, 0.0, 0.0])
    stroke = Stroke([0.0, 1.0], [BladeSegment(tip, tip + up, ahead) for tip in tips])
    move_to_start(arm, stroke, TissueFrame())
    return arm


def test_of_two_ways_that_reach_a_stroke_an_arm_takes_the_one_that_is_clear(tmp_path):
    elbows = [
        moved_to_start(tmp_path, posts).data.joint("elbow").qpos[0] for posts in ("", LEFT, RIGHT)
    ]
    assert np.sign(elbows).tolist() == [-1.0, 1.0, -1.0]


def test_an_arm_that_is_in_its_own_way_on_all_of_them_is_warned_of(tmp_path, caplog):
    moved_to_start(tmp_path, LEFT)
    assert not caplog.records
    moved_to_start(tmp_path, LEFT + RIGHT)
    assert "'elbows' cannot do the stroke clear of itself" in caplog.text
    assert "there overlap 'world' and 'fore' by" in caplog.text


def state_of(spec):
    model = spec.compile()
    data = mujoco.MjData(model)
    data.qpos[:] = first_configuration(model)
    mujoco.mj_kinematics(model, data)
    return model, data


def test_what_overlaps_in_the_file_of_an_arm_passes_and_a_floor_does_not(caplog):
    spec = mujoco.MjSpec.from_string(BALLS)
    pairs = {(each.one, each.other) for each in overlaps(*state_of(spec))}
    assert ("base", "") in pairs  # the parent stands still, which MuJoCo does not leave out
    with caplog.at_level(logging.INFO, "scalpel_sim"):
        pass_where_they_overlap(spec, "balls")
    rest = overlaps(*state_of(spec))
    assert [(each.one, each.other) for each in rest] == [("world", "ball")]
    assert rest[0].depth == pytest.approx(0.03 - LOW)
    assert "'base' and 'body_2' by 45 mm" in caplog.text


def test_where_contact_is_off_overlaps_pass_too_for_others_put_it_on():
    spec = mujoco.MjSpec.from_string(BALLS)
    spec.option.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
    pass_where_they_overlap(spec, "balls")
    assert ("base", "body_2") in {(each.bodyname1, each.bodyname2) for each in spec.excludes}
    assert spec.option.disableflags & int(mujoco.mjtDisableBit.mjDSBL_CONTACT)


def test_the_first_configuration_is_within_the_ranges():
    model = mujoco.MjSpec.from_string(BALLS).compile()
    np.testing.assert_allclose(first_configuration(model), [np.pi / 6.0, 0.0, 0.0])
