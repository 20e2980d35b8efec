"""The same stroke by arms of any build: each holds a scalpel at its flange, and feels the same."""

import csv
import os
from pathlib import Path

import mujoco
import numpy as np
import pytest

from scalpel_sim import prepare, read_scene
from scalpel_sim.arm.firm_hand import firm_impedance
from scalpel_sim.errors import UsageError
from scalpel_sim.scene.scene import changed
from scalpel_sim.scene.write import scene_text
from tests.scalpel_sim.instruments.test_own_arm import EXAMPLES

SAME = 0.03
"""Share by which mean forces of arms may differ: hands give way by what the arms weigh."""

SCENE = """
body = {shape = "block", cells = [3, 3, 2], size = [0.03, 0.03, 0.02], fixed = "left,right"}
[arm]
model = "ARM"
mount = "flange"
[world]
pos = POS
[[stroke]]
kind = "points"
points = [[0.015, -0.01, -0.005], [0.015, 0.045, -0.005]]
length = 0.05
"""

SLIDES = """
<mujoco>
  <option timestep="0.001"/>
  <default><joint type="slide" armature=".1" damping="2"/></default>
  <worldbody>
    <body pos="0 0 .5"><joint axis="1 0 0"/><geom size=".03" mass="1"/>
      <body><joint axis="0 1 0"/><geom size=".03" mass="1"/>
        <body><joint axis="0 0 1"/><geom size=".03" mass="1"/>
          <site name="flange" euler="180 0 180"/>
        </body>
      </body>
    </body>
  </worldbody>
</mujoco>
"""

WITH_JAWS = """
<mujoco>
  <compiler angle="radian" autolimits="true"/>
  <option timestep="0.001" integrator="implicitfast"/>
  <default><joint armature=".1" damping="1" range="-2.9 2.9"/></default>
  <worldbody>
    <geom name="ground" type="plane" size="1 1 .1"/>
    <body name="base"><geom type="cylinder" size=".08 .15" pos="0 0 .15" mass="3"/>
      <body pos="0 0 .35"><joint axis="0 0 1"/><geom size=".06" mass="4"/>
        <body><joint axis="0 1 0"/><geom type="capsule" size=".05" fromto="0 0 0 0 0 .3" mass="4"/>
          <body pos="0 0 .35"><joint axis="0 1 0"/>
            <geom type="capsule" size=".04" fromto="0 0 0 0 0 .25" mass="3"/>
            <body pos="0 0 .3"><joint axis="0 0 1"/><geom size=".04" mass="1"/>
              <body><joint axis="0 1 0"/><geom size=".04" mass="1"/>
                <body name="hand" pos="0 0 .1"><joint axis="0 0 1"/><geom size=".04" mass=".7"/>
                  <frame name="flange" pos="0 0 .05"/>
                  <body pos="0 .03 .06">
                    <joint name="left" type="slide" axis="0 1 0" range="0 .04"/>
                    <geom type="box" size=".01 .005 .03" mass=".02"/>
                  </body>
                  <body pos="0 -.03 .06">
                    <joint name="right" type="slide" axis="0 -1 0" range="0 .04"/>
                    <geom type="box" size=".01 .005 .03" mass=".02"/>
                  </body>
                </body>
              </body>
            </body>
          </body>
        </body>
      </body>
    </body>
  </worldbody>
  <tendon>
    <fixed name="split"><joint joint="left" coef=".5"/><joint joint="right" coef=".5"/></fixed>
  </tendon>
  <equality><joint joint1="left" joint2="right"/></equality>
  <actuator><position tendon="split" kp="100" ctrlrange="0 .04"/></actuator>
  <keyframe><key name="home" qpos="0 .3 1.8 0 1 0 .02 .02" ctrl=".02"/></keyframe>
</mujoco>
"""


def seven_hinges():
    """A URDF of seven hinges, about z and y in turn, that ends in a fixed flange."""
    links, joints = '<link name="link0"/>', ""
    for i, height in enumerate((0.34, 0.0, 0.4, 0.0, 0.4, 0.0, 0.13)):
        links += f"""<link name="link{i + 1}"><inertial><mass value="{4.0 - 0.5 * i}"/>
            <inertia ixx=".03" iyy=".03" izz=".01" ixy="0" ixz="0" iyz="0"/></inertial>
            <visual><geometry><sphere radius=".05"/></geometry></visual></link>"""
        joints += f"""<joint name="a{i}" type="revolute">
            <parent link="link{i}"/><child link="link{i + 1}"/>
            <origin xyz="0 0 {height}"/><axis xyz="0 {i % 2} {1 - i % 2}"/>
            <limit lower="-2.9" upper="2.9" effort="200" velocity="2"/><dynamics damping="1"/>
            </joint>"""
    joints += """<joint name="end" type="fixed"><parent link="link7"/><child link="flange"/>
        <origin xyz="0 0 .05"/></joint>"""
    return f'<robot name="seven">{links}<link name="flange"/>{joints}</robot>'


def six_hinges():
    """The robot of the examples without its scalpel."""
    spec = mujoco.MjSpec.from_file(str(EXAMPLES / "robot.xml"))
    spec.delete(spec.body("scalpel"))
    spec.body("wrist_3").add_site(name="flange", pos=[0.0, 0.0, 0.03])
    return spec.to_xml()


def six_with_hulls():
    """The same, with a pedestal and an upper arm that overlap wherever it is."""
    spec = mujoco.MjSpec.from_string(six_hinges())
    pedestal = spec.worldbody.add_body(name="pedestal")
    for body, at, size in (
        (pedestal, (0.03, 0.01, 0.1), 0.2),
        (spec.body("upper_arm"), (-0.1, 0.0, 0.13), 0.12),
    ):
        body.add_geom(size=[size, 0.0, 0.0], pos=at, mass=1e-3, contype=1, conaffinity=1)
    return spec.to_xml()


ARMS = {
    "slides.xml": (lambda: SLIDES, (0.0, 0.0, 0.2)),
    "six_hinges.xml": (six_hinges, (-0.03, 0.4, 0.02)),
    "six_with_hulls.xml": (six_with_hulls, (-0.03, 0.4, 0.02)),
    "seven_hinges.urdf": (seven_hinges, (0.5, 0.0, 0.1)),
    "with_jaws.xml": (lambda: WITH_JAWS, (0.4, 0.0, 0.1)),
}


def scene_of(folder, name):
    """Write an arm and its scene; return the scene."""
    make, pos = ARMS[name]
    (folder / name).write_text(make(), encoding="utf-8")
    path = folder / "scene.toml"
    path.write_text(SCENE.replace("ARM", name).replace("POS", str(list(pos))), encoding="utf-8")
    return read_scene(path)


def mean_force(scene):
    """Do the stroke; return the mean force on the blade [N], and the simulation."""
    simulation = prepare(scene)
    simulation.run(simulation.stroke.duration)
    force = np.linalg.norm(simulation.recording.vector("force"), axis=1)
    return float(force.mean()), simulation


@pytest.fixture(scope="module")
def of_preset(tmp_path_factory):
    """Mean force of the same stroke by the arm of the project [N]."""
    scene = scene_of(tmp_path_factory.mktemp("arm"), "slides.xml")
    return mean_force(changed(scene, model=None, mount=None, pos=(0.0, 0.0, 0.0)))[0]


@pytest.mark.parametrize("name", ARMS)
def test_a_scene_of_twelve_lines_has_any_arm_cut_with_the_force_of_the_preset(
    name, tmp_path, of_preset
):
    scene = scene_of(tmp_path, name)
    assert len((tmp_path / "scene.toml").read_text(encoding="utf-8").splitlines()) <= 12
    found, simulation = mean_force(scene)
    assert simulation.link.n_pieces() == 2
    assert found == pytest.approx(of_preset, rel=SAME)


def robots_of_a_lab():
    """Rows of `robots.csv` in the folder that the environment names: file, mount, x, y, z."""
    folder = os.environ.get("SCALPEL_SIM_TEST_ROBOTS")
    if folder is None:
        return [pytest.param(None, marks=pytest.mark.skip("SCALPEL_SIM_TEST_ROBOTS is not set"))]
    with (Path(folder) / "robots.csv").open(encoding="utf-8") as file:
        return [
            pytest.param((Path(folder) / row[0], *row[1:]), id=row[0]) for row in csv.reader(file)
        ]


@pytest.mark.parametrize("robot", robots_of_a_lab())
def test_a_robot_of_a_lab_cuts_with_the_force_of_the_preset(robot, tmp_path, of_preset):
    file, mount, *pos = robot
    scene = scene_of(tmp_path, "slides.xml")
    place = tuple(float(x) for x in pos)
    found, simulation = mean_force(changed(scene, model=str(file), mount=mount, pos=place))
    assert simulation.link.n_pieces() == 2
    assert found == pytest.approx(of_preset, rel=SAME)


def test_jaws_that_do_not_carry_the_blade_stay_where_they_are(tmp_path):
    _, simulation = mean_force(scene_of(tmp_path, "with_jaws.xml"))
    jaws = [simulation.arm.data.joint(name).qpos[0] for name in ("left", "right")]
    assert jaws == pytest.approx([0.02, 0.02], abs=2e-3)


def test_the_hand_is_as_firm_as_suits_the_arm_where_it_works_not_where_its_file_has_it(tmp_path):
    arm = prepare(scene_of(tmp_path, "seven_hinges.urdf")).arm
    there, stiffness = firm_impedance(arm), arm.model.actuator_gainprm[arm.hand.actuators[0], 0]
    arm.reset(np.zeros(7))  # stretched, it does not move along itself
    assert firm_impedance(arm).stiffness < 0.2 * there.stiffness
    assert stiffness == pytest.approx(there.stiffness, rel=1e-9)


def left_of_self_motion(arm):
    """Push the joints so that the edge stays; return the share of their speed left after 0.3 s."""
    position, rotation = np.zeros((2, 3, arm.model.nv))
    mujoco.mj_jacSite(arm.model, arm.data, position, rotation, arm.hand.edge)
    still = np.linalg.svd(np.vstack([position, rotation]))[2][6]
    arm.data.qvel[:] = 0.2 * still
    start = arm.blade.segment().tip
    while arm.time < 0.3:
        arm.step1()
        arm.step2()
    assert np.linalg.norm(arm.blade.segment().tip - start) < 1e-4
    return np.linalg.norm(arm.data.qvel) / 0.2


def test_an_elbow_that_the_edge_leaves_free_comes_to_rest(tmp_path):
    arm = prepare(scene_of(tmp_path, "seven_hinges.urdf")).arm
    start, damped = np.array(arm.data.qpos), left_of_self_motion(arm)
    arm.model.dof_damping[:] = 0.0
    arm.reset(start)
    assert damped < 0.1 < 0.5 < left_of_self_motion(arm)


def test_joints_that_the_edge_holds_are_not_damped_further(tmp_path):
    for name, damping in (("slides.xml", 2.0), ("six_hinges.xml", 2.0)):
        assert prepare(scene_of(tmp_path, name)).arm.model.dof_damping.tolist()[:3] == [damping] * 3


def test_a_scalpel_is_as_long_as_the_stroke_needs_and_as_thick_as_the_blade(tmp_path):
    scene = changed(scene_of(tmp_path, "slides.xml"), blade=None)
    arm = prepare(scene).arm
    assert arm.blade.length == pytest.approx(0.05)
    assert 2.0 * arm.model.geom("scalpel_blade").size[0] == pytest.approx(0.4e-3)


def test_the_edge_cuts_where_forward_points_in_the_frame_of_the_mount(tmp_path):
    scene = changed(scene_of(tmp_path, "six_hinges.xml"), forward=(-1.0, 0.0, 0.0))
    arm = prepare(scene).arm
    x_of_flange = arm.data.site("flange").xmat.reshape(3, 3)[:, 0]
    np.testing.assert_allclose(arm.blade.segment().forward, -x_of_flange, atol=1e-9)


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({"mount": "flang"}, "no site, body or frame 'flang'. Did you mean 'flange'"),
        ({"heel": "a"}, "mount = 'flange', which holds a scalpel, and heel = 'a'"),
        ({"model": None}, "mount is for an arm of your own"),
        ({"forward": (0.0, 0.0, 1.0)}, "along the handle"),
    ],
)
def test_a_mount_that_makes_no_sense_is_refused(changes, expected, tmp_path):
    with pytest.raises(UsageError, match=expected):
        prepare(changed(scene_of(tmp_path, "slides.xml"), **changes))


def test_a_scene_with_a_mount_reads_back_the_same(tmp_path):
    scene = scene_of(tmp_path, "slides.xml")
    path = tmp_path / "again.toml"
    path.write_text(scene_text(scene, path), encoding="utf-8")
    found = read_scene(path)
    assert changed(found, model=scene.arm.model).settings() == scene.settings()
