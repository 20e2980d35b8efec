import math

import mujoco
import numpy as np
import pytest

from scalpel_sim.arm.arm import CHOSEN_BY_SIZE, Arm
from scalpel_sim.arm.collision_geoms import TABLE_THICKNESS, ArmParts, JointReach, tables
from scalpel_sim.arm.grasper import add_grasper
from tests.scalpel_sim.little_arm import MJCF

BOTH = pytest.mark.parametrize("preset", CHOSEN_BY_SIZE)
CORNERS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])


def parts_of(arm):
    return ArmParts(arm.model, arm.data, arm.blade.body_id)


@BOTH
def test_the_parts_are_the_links_and_the_instrument_but_not_the_hand(preset):
    parts = parts_of(Arm(preset, base_position=(0.0, 0.0, 0.1))).parts
    assert {part.name for part in parts if part.is_instrument} == {"stylus", "neck", "blade"}
    standing = {part.name for part in parts if not part.checked_against_fixtures}
    assert {"base", "pedestal"} <= standing <= {"base", "pedestal", "column"}
    links = {
        part.name for part in parts if part.checked_against_instrument and not part.is_instrument
    }
    assert {"base", "torso", "upper_arm", "forearm"} <= links
    assert not links & {"wrist", "gimbal", "hand", "table"}


@BOTH
def test_the_parts_are_where_the_arm_is(preset):
    arm = Arm(preset)
    parts = parts_of(arm)
    (blade,) = [i for i, part in enumerate(parts.parts) if part.name == "blade"]
    edge = arm.blade.segment()
    half = parts.parts[blade].half_extents
    found = (edge.tip - parts.positions()[blade]) @ parts.axes()[blade]
    np.testing.assert_allclose(found, [0.0, half[1], -half[2]], atol=1e-12)


def test_the_table_is_a_box_whose_top_is_the_plane():
    (table,) = tables(Arm("touch").model).values()
    assert table.name == "table"
    assert table.centre[2] + 0.5 * table.size[2] == pytest.approx(0.0)
    np.testing.assert_allclose(table.size, [1.0, 1.0, TABLE_THICKNESS])


def test_an_infinite_plane_is_no_table():
    assert tables(mujoco.MjModel.from_xml_string(MJCF)) == {}


def test_the_parts_of_any_other_model_are_found_too():
    model = mujoco.MjModel.from_xml_string(MJCF)
    data = mujoco.MjData(model)
    parts = ArmParts(model, data, model.body("blade").id).parts
    assert {part.name for part in parts if part.is_instrument} >= {"grip", "blade"}


def corners_of(model, data):
    """Return the corners of the box around each geom, in the world, shape (n_geoms, 8, 3)."""
    centre, half = model.geom_aabb[:, None, :3], model.geom_aabb[:, None, 3:]
    axes = data.geom_xmat.reshape(-1, 3, 3)
    return data.geom_xpos[:, None] + np.einsum("gij,gcj->gci", axes, centre + half * CORNERS)


def geoms_of(model):
    """Return the geoms of bodies that the joints move."""
    return [i for i in range(model.ngeom) if model.body_weldid[model.geom_bodyid[i]] != 0]


def bounds_of_motions(model, data, geoms):
    """Return the bound of how far each of many motions of the joints moves a corner, over it."""
    rng, reach, found = np.random.default_rng(0), JointReach(model, data, geoms), []
    low, high = model.jnt_range.T
    for size in (1.0, 0.1, 1e-3) * 200:
        data.qpos[:] = start = rng.uniform(low, high)
        mujoco.mj_kinematics(model, data)
        reach.begin()
        before = corners_of(model, data)[geoms]
        share = size * rng.choice([0.0, 1.0], len(low))
        data.qpos[:] = start + share * rng.uniform(low - start, high - start)
        mujoco.mj_kinematics(model, data)
        moved = np.linalg.norm(corners_of(model, data)[geoms] - before, axis=2).max()
        assert moved <= reach.displacement() + 1e-12
        found.append(reach.displacement() / moved if moved > 0.0 else math.inf)
    return found


@BOTH
def test_no_point_of_an_arm_moves_farther_than_its_joints_allow(preset):
    model = Arm(preset, blade_length=0.06, mount_angle=0.4).model
    geoms = [i for i in geoms_of(model) if model.body_mocapid[model.geom_bodyid[i]] < 0]
    found = bounds_of_motions(model, mujoco.MjData(model), geoms)
    assert min(found) < 2.0  # the bound is of use too


def test_a_hinge_beside_the_origin_of_its_body_counts_with_its_distance():
    spec = mujoco.MjSpec()
    body = spec.worldbody.add_body(pos=[0.1, 0.0, 0.0])
    body.add_joint(pos=[0.0, 0.3, 0.0], axis=[0.0, 0.0, 1.0])
    body.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[0.01, 0.0, 0.0])
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    reach, before = JointReach(model, data, [0]), data.geom_xpos.copy()
    reach.begin()
    data.qpos[0] = 1e-3
    mujoco.mj_kinematics(model, data)
    assert np.linalg.norm(data.geom_xpos - before) == pytest.approx(3e-4, rel=1e-3)
    assert reach.displacement() >= 3e-4


def test_slides_of_a_grasper_count_with_how_far_they_slide_and_move_what_turns():
    spec = mujoco.MjSpec()
    arm = spec.worldbody.add_body(name="arm")
    arm.add_joint(axis=[0.0, 0.0, 1.0], range=[-1.0, 1.0], limited=True)
    arm.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[0.01, 0.0, 0.0])
    add_grasper(spec, "arm")
    model = spec.compile()
    found = bounds_of_motions(model, mujoco.MjData(model), geoms_of(model))
    assert min(found) == pytest.approx(1.0), "exact where only pads slide"


def test_nothing_is_known_before_the_start_nor_of_other_joints():
    arm = Arm("touch")
    reach = JointReach(arm.model, arm.data, geoms_of(arm.model))
    assert math.isnan(reach.displacement())
    reach.begin()
    assert reach.displacement() == 0.0
    spec = mujoco.MjSpec()
    body = spec.worldbody.add_body()
    body.add_freejoint()
    body.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[0.01, 0.0, 0.0])
    model = spec.compile()
    free = JointReach(model, mujoco.MjData(model), [0])
    free.begin()
    assert free.displacement() == math.inf
