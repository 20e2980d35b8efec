import mujoco
import numpy as np
import pytest

from bridge import MAX_PLAUSIBLE_FORCE
from scalpel_sim import Blade
from scalpel_sim.arm.blade import BladeError
from tissue import Wrench

# Two hinges, a bent blade whose centre of mass is off the edge.
ARM = """
<mujoco>
  <worldbody>
    <site name="nail"/>
    <body name="upper">
      <joint axis="0 0 1"/> <geom size=".01" fromto="0 0 0 0 .2 0" type="capsule"/>
      <body name="blade" pos="0 .2 0" euler="20 0 10">
        <joint axis="1 0 0"/>
        <geom size=".01 .03 .005" pos=".01 .03 .02" type="box"/>
        <site name="heel" pos="0 0 -.003"/> <site name="tip" pos="0 .06 -.003"/>
        <site name="tip2" pos="0 0 -.003"/>
      </body>
    </body>
  </worldbody>
</mujoco>"""


@pytest.fixture
def arm():
    model = mujoco.MjModel.from_xml_string(ARM)
    data = mujoco.MjData(model)
    data.qpos[:] = 0.3, -0.5
    mujoco.mj_step1(model, data)
    return model, data


def wrench(force=(0.0, 0.0, 0.0), torque=(0.0, 0.0, 0.0), point=(0.0, 0.0, 0.0)):
    return Wrench(np.array(force), np.array(torque), np.array(point))


def test_the_segment_is_a_copy_of_the_positions_of_the_sites(arm):
    model, data = arm
    blade = Blade(model, data)
    segment = blade.segment()
    assert np.array_equal(segment.tip, data.site("tip").xpos)
    assert np.array_equal(segment.heel, data.site("heel").xpos)
    data.qpos[:] = 0.0
    mujoco.mj_kinematics(model, data)
    assert not np.allclose(segment.tip, data.site("tip").xpos)
    assert blade.length == pytest.approx(0.06)


def test_forward_turns_with_the_body_and_is_orthogonal_to_the_edge(arm):
    model, data = arm
    segment = Blade(model, data, forward=(0.0, 0.7, -1.0)).segment()
    assert abs(segment.forward @ (segment.tip - segment.heel)) < 1e-15
    assert np.allclose(segment.forward, -data.body("blade").xmat.reshape(3, 3)[:, 2])


def test_the_applied_wrench_is_j_transpose_w(arm):
    model, data = arm
    applied = wrench((1.0, -2.0, 0.5), (0.01, 0.02, -0.03), data.site("tip").xpos)
    Blade(model, data).apply(applied)
    mujoco.mj_step2(model, data)  # fills qfrc_smooth with passive - bias + actuator + applied
    generalised_force = data.qfrc_smooth - (data.qfrc_passive - data.qfrc_bias + data.qfrc_actuator)
    translation, rotation = np.zeros((3, 2)), np.zeros((3, 2))
    mujoco.mj_jac(model, data, translation, rotation, applied.point, model.body("blade").id)
    assert np.allclose(
        generalised_force, translation.T @ applied.force + rotation.T @ applied.torque, atol=1e-14
    )


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf, 1e9, 1.01 * MAX_PLAUSIBLE_FORCE])
@pytest.mark.parametrize("where", ["force", "torque", "point"])
def test_an_implausible_wrench_never_reaches_mujoco(arm, bad, where):
    model, data = arm
    blade = Blade(model, data)
    blade.apply(wrench((1.0, 0.0, 0.0), point=data.xipos[blade.body_id]))
    before = data.xfrc_applied.copy()
    parts = {"force": (0.1, 0.0, 0.0), "torque": (0.0, 0.0, 0.0), "point": (0.0, 0.0, 0.0)}
    with pytest.raises(BladeError, match="must be finite and at most"):
        blade.apply(wrench(**{**parts, where: (0.0, bad, 0.0)}))
    assert np.array_equal(data.xfrc_applied, before)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            {"heel": "hell"},
            "no site 'hell'. Did you mean 'heel'? It has: 'nail', 'heel', 'tip', 'tip2'",
        ),
        ({"body": "hand"}, "no body 'hand'. It has: 'upper', 'blade'"),
        ({"heel": "nail"}, "site 'nail' sits on body 'world', not on 'blade'"),
        ({"body": "upper"}, "site 'heel' sits on body 'blade', not on 'upper'"),
        ({"heel": "nail", "tip": "nail"}, "welded to the world"),
        ({"tip": "tip2"}, "apart"),
        ({"forward": (0.0, -2.0, 0.0)}, "runs along the edge"),
        ({"forward": (0.0, np.nan, 1.0)}, "three finite numbers"),
    ],
)
def test_sites_that_do_not_form_a_blade_are_refused_by_name(arm, arguments, message):
    with pytest.raises(BladeError) as error:
        Blade(*arm, **arguments)
    assert message in str(error.value)
