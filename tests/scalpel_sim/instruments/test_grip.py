"""A body of MuJoCo that holds tissue: both feel it."""

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from bridge import TissueFrame
from scalpel_sim import Grip
from scalpel_sim.instruments.grip import GripError
from tissue import Material, Tissue, block, fixed_nodes

DT = 1e-3
JAWS = """
<mujoco>
  <option timestep="0.001" integrator="implicitfast" gravity="0 0 -9.81"/>
  <worldbody>
    <body name="left" pos="{left}" gravcomp="1">
      <joint name="left" type="slide" axis="{axis}" damping="5"/>
      <geom type="box" size=".01 .01 .01" mass=".2"/>
    </body>
    <body name="right" pos="{right}" gravcomp="1">
      <joint name="right" type="slide" axis="{axis}" damping="5"/>
      <geom type="box" size=".01 .01 .01" mass=".2"/>
    </body>
  </worldbody>
  <actuator>
    <position name="left" joint="left" kp="2000"/>
    <position name="right" joint="right" kp="2000"/>
  </actuator>
</mujoco>
"""
GEL = Material(
    law="neo_hookean", young_modulus=20e3, poisson_ratio=0.45, toughness=5.0, viscous_damping=40.0
)
BAR = block((8, 2, 2), (0.08, 0.025, 0.025))
"""50 g."""


def jaws(left, right, axis):
    places = {"left": left, "right": right, "axis": axis}
    text = JAWS.format(**{name: "{} {} {}".format(*at) for name, at in places.items()})
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


def advance(model, data, tissue, grips, steps, sweep=None):
    for i in range(steps):
        mujoco.mj_step1(model, data)
        for grip in grips:
            grip.follow()
        tissue.step(None if sweep is None else sweep(i), DT)
        for grip in grips:
            grip.apply()
        mujoco.mj_step2(model, data)


def hanging(rotation=None):
    """A bar of 50 g that the left jaw holds at a side, in a tissue frame that may be turned."""
    axes = np.eye(3) if rotation is None else rotation
    frame = TissueFrame(axes, np.array([0.1, -0.2, 0.5]))
    model, data = jaws(frame.points_to_world(np.zeros(3)), (9, 9, 9), (0, 0, 1))
    gravity = frame.vectors_to_tissue(np.array([0.0, 0.0, -9.81]))
    tissue = Tissue(BAR, GEL, gravity=gravity)
    grip = Grip(data, "left", tissue, "top", frame=frame, stiffness=1000.0, damping=10.0)
    return model, data, tissue, grip


def turned():
    return Rotation.from_euler("xyz", [0.3, 1.2, -0.5]).as_matrix()


@pytest.mark.parametrize("rotation", [None, turned()], ids=["as the world", "turned"])
def test_a_held_piece_of_50_g_hangs_with_its_weight(rotation):
    model, data, tissue, grip = hanging(rotation)
    advance(model, data, tissue, [grip], 2500)
    weight = 9.81 * float(tissue.snapshot().masses.sum())
    assert weight == pytest.approx(9.81 * 0.05, rel=0.01)
    np.testing.assert_allclose(grip.wrench.force, [0, 0, -weight], atol=0.01 * weight)
    # What the jaw's actuator bears is that weight, too.
    assert data.actuator_force[0] == pytest.approx(weight, rel=0.01)


def test_forces_on_tissue_and_on_the_body_sum_to_zero_in_each_step():
    model, data, tissue, grip = hanging(turned())
    for _ in range(100):
        before = (tissue.snapshot().masses[:, None] * tissue.snapshot().velocities).sum(axis=0)
        advance(model, data, tissue, [grip], 1)
        body = tissue.snapshot()
        after = (body.masses[:, None] * body.velocities).sum(axis=0)
        weight = body.masses.sum() * grip._frame.vectors_to_tissue(np.array([0, 0, -9.81]))
        on_tissue = grip._frame.vectors_to_world((after - before) / DT - weight)
        np.testing.assert_allclose(on_tissue + data.xfrc_applied[1, :3], 0.0, atol=1e-9)


def test_the_wrench_acts_about_the_centre_of_mass_of_the_body():
    model, data, tissue, grip = hanging(turned())
    advance(model, data, tissue, [grip], 300)
    wrench = grip.wrench
    arm = wrench.point - data.xipos[1]
    np.testing.assert_allclose(
        data.xfrc_applied[1, 3:], wrench.torque + np.cross(arm, wrench.force), atol=1e-12
    )


def test_tissue_follows_a_jaw_that_moves():
    model, data, tissue, grip = hanging()
    data.ctrl[0] = 0.02
    advance(model, data, tissue, [grip], 2500)
    end = tissue.positions_of(grip.attachment.points).mean(axis=0)
    at_first = BAR.positions[fixed_nodes(BAR, "top")].mean(axis=0)
    # The hold yields by weight / stiffness, the actuator by weight / kp.
    assert end[2] - at_first[2] == pytest.approx(0.02 - 0.49 / 1000.0 - 0.49 / 2000.0, abs=2e-4)


def test_a_body_that_lets_go_feels_nothing_more():
    model, data, tissue, grip = hanging()
    advance(model, data, tissue, [grip], 200)
    data.xfrc_applied[1] += 0.25  # of somebody else
    grip.release()
    np.testing.assert_allclose(data.xfrc_applied[1], 0.25, atol=1e-12)
    assert grip.n_points == 0
    grip.release()  # once more does nothing
    advance(model, data, tissue, [grip], 50)
    assert tissue.snapshot().velocities[:, 2].mean() < -0.3  # it falls


@pytest.mark.parametrize("size", [np.nan, 1e6])
def test_a_wrench_that_no_tissue_exerts_is_refused_and_the_one_before_stays(size):
    model, data, tissue, grip = hanging()
    advance(model, data, tissue, [grip], 5)
    before = data.xfrc_applied[1].copy()
    grip.attachment.end_step(np.array([size, 0.0, 0.0]), np.zeros(3), np.zeros(9, int))
    with pytest.raises(GripError, match="the hold: a wrench of"):
        grip.apply()
    np.testing.assert_array_equal(data.xfrc_applied[1], before)


def test_a_body_that_is_not_there_is_named():
    _, data = jaws((0, 0, 0), (1, 0, 0), (1, 0, 0))
    with pytest.raises(GripError, match=r"no body 'jaw'. It has: 'left', 'right'"):
        Grip(data, "jaw", Tissue(BAR, GEL), "left", stiffness=100.0)
