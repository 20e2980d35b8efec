"""A grasper on an arm: its jaws, the hand that leads it, and what it feels."""

import mujoco
import numpy as np
import pytest

from scalpel_sim.arm.arm import ASSETS
from scalpel_sim.arm.grasper import (
    FORWARD,
    PAD_LENGTH,
    PADS_HEEL,
    PADS_TIP,
    SHAFT_LENGTH,
    GrasperError,
    GuidedGrasper,
    add_grasper,
)
from scalpel_sim.arm.hand import Impedance, add_hand
from scalpel_sim.tables.values import WIDEST_OPENING

FLANGE = """
<mujoco>
  <option timestep="0.001" gravity="0 0 0"/>
  <worldbody>
    <body name="arm" pos="0.1 0.2 0.3">
      <joint name="x" type="slide" axis="1 0 0"/>
      <joint name="y" type="slide" axis="0 1 0"/>
      <joint name="z" type="slide" axis="0 0 1"/>
      <geom size=".02" mass=".1"/>
      <site name="flange" pos="0 0 -0.02" euler="90 0 0"/>
    </body>
  </worldbody>
</mujoco>
"""


def held(at="arm", **settings):
    spec = mujoco.MjSpec.from_string(FLANGE)
    prefix = add_grasper(spec, at, **settings)
    hand = add_hand(spec, Impedance(), prefix + PADS_HEEL, prefix + PADS_TIP, FORWARD)
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    grasper = GuidedGrasper(model, data, prefix, hand)
    grasper.hold()
    return model, data, grasper


def steps(model, data, n):
    for _ in range(n):
        mujoco.mj_step(model, data)


def test_the_model_opens_by_itself_and_has_the_measures_that_are_said():
    model = mujoco.MjModel.from_xml_path(str(ASSETS / "grasper.xml"))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    assert data.site("pinch").xpos == pytest.approx([0.0, SHAFT_LENGTH, 0.0])
    ends = data.site("tip").xpos - data.site("heel").xpos
    assert ends == pytest.approx([0.0, PAD_LENGTH, 0.0])
    assert 2.0 * model.geom("pad_low").size[1] == pytest.approx(PAD_LENGTH)
    assert model.jnt_range.sum() == pytest.approx(WIDEST_OPENING)
    assert 5e-3 < model.body_mass.sum() < 0.05


@pytest.mark.parametrize(
    ("at", "middle", "along"),
    [
        ("arm", [0.1, 0.2, 0.3 + SHAFT_LENGTH], [0.0, 0.0, 1.0]),
        ("flange", [0.1, 0.2 - SHAFT_LENGTH, 0.28], [0.0, -1.0, 0.0]),
    ],
)
def test_it_points_along_z_of_the_body_or_site_that_holds_it(at, middle, along):
    _, _, grasper = held(at)
    assert grasper.pads.centre == pytest.approx(middle)
    assert grasper.pads.axes[:, 1] == pytest.approx(along, abs=1e-12)


def test_a_place_that_is_not_there_is_refused_with_those_that_are():
    with pytest.raises(GrasperError, match=r"no site, body or frame 'flang'\. .*'flange', .*'arm'"):
        add_grasper(mujoco.MjSpec.from_string(FLANGE), "flang")


def test_both_jaws_move_alike_to_the_opening_that_is_asked_for():
    model, data, grasper = held()
    for opening in (0.015, 0.004):
        grasper.open_to(opening)
        steps(model, data, 300)
        assert grasper.opening == pytest.approx(opening, abs=1e-5)
        low, high = data.joint("grasper_jaw_low").qpos, data.joint("grasper_jaw_high").qpos
        assert low == pytest.approx(high, abs=1e-5)
        assert 2.0 * grasper.pads.half_size[0] == pytest.approx(grasper.opening)


@pytest.mark.parametrize(("settings", "most"), [({}, 5.0), ({"force": 0.5}, 0.5)])
def test_jaws_close_with_a_limited_force(settings, most):
    """Both pads are pushed apart by a bit less, and a bit more, than the jaws close with."""
    model, data, grasper = held(**settings)
    grasper.open_to(0.01)
    steps(model, data, 300)
    grasper.open_to(0.0)
    for share, closes in ((0.9, True), (1.1, False)):
        before, data.qvel[:] = grasper.opening, 0.0
        for side, sign in (("low", -1.0), ("high", 1.0)):
            data.body(f"grasper_jaw_{side}").xfrc_applied[0] = sign * share * most
        steps(model, data, 20)
        assert (grasper.opening < before) == closes


def test_a_force_between_the_pads_moves_it_by_force_over_stiffness_and_does_not_turn_it():
    model, data, grasper = held()
    before = grasper.pads
    shaft = data.body(grasper.body)
    shaft.xfrc_applied[:3] = force = np.array([0.3, -0.2, 0.4])
    shaft.xfrc_applied[3:] = np.cross(before.centre - shaft.xipos, force)
    steps(model, data, 400)
    assert grasper.hand.deflection == pytest.approx(force / 5e3, abs=1e-6)
    assert grasper.pads.axes == pytest.approx(before.axes, abs=1e-6)


def test_its_wrench_is_the_sum_of_those_on_shaft_and_jaws_about_the_middle_between_the_pads():
    model, data, grasper = held("flange")
    grasper.open_to(0.012)
    steps(model, data, 200)
    rng = np.random.default_rng(0)
    force, torque = np.zeros(3), np.zeros(3)
    for part in ("shaft", "jaw_low", "jaw_high"):
        body = data.body(f"grasper_{part}")
        body.xfrc_applied = applied = rng.normal(size=6)
        force += applied[:3]
        torque += applied[3:] + np.cross(body.xipos - grasper.pads.centre, applied[:3])
    assert grasper.wrench.force == pytest.approx(force)
    assert grasper.wrench.torque == pytest.approx(torque)
    assert grasper.wrench.point == pytest.approx(grasper.pads.centre)


@pytest.mark.parametrize(
    ("on_low", "on_high", "expected"),
    [(-1.0, 1.0, True), (0.0, 0.0, False), (-1.0, 0.0, False), (1.0, -1.0, False)],
)
def test_it_says_whether_something_between_the_pads_pushes_them_apart(on_low, on_high, expected):
    _, data, grasper = held()
    across = data.body(grasper.body).xmat.reshape(3, 3)[:, 0]
    data.body(grasper.bodies[1]).xfrc_applied[:3] = on_low * across
    data.body(grasper.bodies[2]).xfrc_applied[:3] = on_high * across
    assert grasper.is_pushed_apart == expected
