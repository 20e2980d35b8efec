"""Robots from URDF files: their links, their meshes wherever they are, and what they lack."""

import logging

import numpy as np
import pytest
import trimesh

from scalpel_sim.arm.model_file import ModelFileError, spec_of_file

MASS = """<inertial><mass value="1"/>
    <inertia ixx=".01" iyy=".01" izz=".01" ixy="0" ixz="0" iyz="0"/></inertial>"""
MESH = '<geometry><mesh filename="package://lab_robot/meshes/{}"/></geometry>'
BALL = '<geometry><sphere radius=".05"/></geometry>'


def robot(folder, upper=MASS, meshes=("arm.stl", "arm.dae")):
    """Write a robot of two hinges with a fixed flange; return its file."""
    collision, visual = (MESH.format(mesh) for mesh in meshes)
    path = folder / "robot.urdf"
    path.write_text(
        f"""<robot name="two hinges">
  <link name="base"/>
  <link name="lower">{MASS}<visual>{visual}</visual><collision>{collision}</collision></link>
  <link name="upper">{upper}<visual>{BALL}</visual></link>
  <link name="flange"/>
  <joint name="first" type="revolute"><parent link="base"/><child link="lower"/>
    <axis xyz="0 0 1"/><limit lower="-3" upper="3" effort="150" velocity="1"/></joint>
  <joint name="second" type="continuous"><parent link="lower"/><child link="upper"/>
    <axis xyz="0 1 0"/><limit effort="0" velocity="1"/></joint>
  <joint name="last" type="fixed"><parent link="upper"/><child link="flange"/>
    <origin xyz="0 0 .2"/></joint>
</robot>""",
        encoding="utf-8",
    )
    return path


@pytest.fixture
def clone(tmp_path):
    """A clone of a repository that holds the package in a folder of another name."""
    (tmp_path / "clone" / "meshes").mkdir(parents=True)
    (tmp_path / "clone" / "urdf").mkdir()
    trimesh.creation.box((0.1, 0.1, 0.1)).export(tmp_path / "clone" / "meshes" / "arm.stl")
    return tmp_path / "clone" / "urdf"


def names(model, kind, n):
    return [getattr(model, kind)(i).name for i in range(n)]


def test_links_joints_and_efforts_are_those_of_the_file_and_a_fixed_flange_stays(clone, caplog):
    model = spec_of_file(robot(clone)).compile()
    assert names(model, "body", model.nbody) == ["world", "base", "lower", "upper", "flange"]
    assert names(model, "joint", model.njnt) == ["first", "second"]
    assert model.jnt_actfrcrange.tolist() == [[-150.0, 150.0], [0.0, 0.0]]
    assert model.jnt_actfrclimited.tolist() == model.jnt_limited.tolist() == [True, False]
    assert model.ngeom == 2 and model.nmesh == 1  # the mesh to collide with, and the ball
    assert not caplog.records


def test_a_package_is_found_by_its_name_in_a_folder_above(clone):
    path = robot(clone)
    package = clone.parent.parent / "lab_robot"
    clone.parent.rename(package)
    assert spec_of_file(package / "urdf" / path.name).compile().nmesh == 1


def test_meshes_that_are_not_there_or_of_another_kind_are_left_out_with_a_word(clone, caplog):
    path = robot(clone, meshes=("gone.stl", "arm.dae"))
    with caplog.at_level(logging.WARNING, logger="scalpel_sim"):
        model = spec_of_file(path).compile()
        spec_of_file(path)
    assert model.nmesh == 0 and model.nv == 2
    (record,) = caplog.records
    assert "without 1 of its meshes" in record.message and "meshes/gone.stl" in record.message


def test_meshes_are_found_in_the_folder_that_the_robot_names_for_mujoco(clone, caplog):
    path = robot(clone, meshes=("elsewhere/arm.stl", "arm.dae"))
    option = '<mujoco><compiler meshdir="../meshes"/></mujoco><link name="base"/>'
    path.write_text(path.read_text().replace('<link name="base"/>', option))
    assert spec_of_file(path).compile().nmesh == 1
    assert not caplog.records


def test_an_inertia_that_no_solid_has_is_balanced_with_a_word(clone, caplog):
    path = robot(clone, upper=MASS.replace('ixx=".01"', 'ixx=".04"'))
    model = spec_of_file(path).compile()
    np.testing.assert_allclose(model.body("upper").inertia, 0.02)
    np.testing.assert_allclose(model.body("lower").inertia, 0.01)
    (record,) = caplog.records
    assert "no solid has the inertia that the robot 'two hinges' gives for upper" in record.message


def test_a_link_that_moves_without_mass_is_named(clone):
    with pytest.raises(ModelFileError, match=r"have no mass: upper\. Give each an <inertial>"):
        spec_of_file(robot(clone, upper=""))


def test_a_xacro_file_is_told_from_a_robot(tmp_path):
    path = tmp_path / "robot.urdf"
    path.write_text(
        '<robot xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:include filename="a"/></robot>'
    )
    with pytest.raises(ModelFileError, match=r"xacro FILE > robot\.urdf"):
        spec_of_file(path)
