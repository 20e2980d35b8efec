"""The patient-side manipulator against the table of its joints that the research kit publishes."""

import mujoco
import numpy as np
import pytest

from scalpel_sim.arm.arm import ASSETS, Arm
from scalpel_sim.arm.kinematics import ArmPoses
from scalpel_sim.arm.placement import PlacementError, place
from scalpel_sim.arm.psm_kinematics import TROCAR_CLEARANCE, psm_geometry
from tests.support.planned_strokes import PLANNED, plan_stroke
from tissue import block

SLAB = block((4, 6, 4), (0.04, 0.06, 0.04))
BOUNDS = np.array([SLAB.positions.min(axis=0), SLAB.positions.max(axis=0)])
HALF = np.pi / 2.0
# Modified Denavit-Hartenberg parameters, in the order of the file of the research kit: alpha, a,
# offset of the joint, d, and whether it slides.
PUBLISHED = (
    (HALF, 0.0, HALF, 0.0, False),
    (-HALF, 0.0, -HALF, 0.0, False),
    (HALF, 0.0, -0.4318, 0.0, True),
    (0.0, 0.0, 0.0, 0.4162, False),
    (-HALF, 0.0, -HALF, 0.0, False),
    (-HALF, 0.0091, -HALF, 0.0, False),
)


def turned_and_moved(axis, angle, shift):
    """A rotation about x or z, and a shift along it, as a matrix of shape (4, 4)."""
    c, s = np.cos(angle), np.sin(angle)
    matrix = np.eye(4)
    i, j = {"x": (1, 2), "z": (0, 1)}[axis]
    matrix[[i, i, j, j], [i, j, i, j]] = c, -s, s, c
    matrix["xyz".index(axis), 3] = shift
    return matrix


def wrist_by_the_published_table(joints):
    found = np.eye(4)
    for (alpha, a, offset, d, slides), q in zip(PUBLISHED, joints, strict=True):
        angle, along = (0.0, offset + q + d) if slides else (offset + q, d)
        found = found @ turned_and_moved("x", alpha, a) @ turned_and_moved("z", angle, along)
    return found


def with_bars(joints):
    """Yaw, pitch and so on with the bars of the parallelogram, which follow the pitch."""
    return np.array([joints[0], joints[1], -joints[1], *joints[1:]])


def random_joints(n):
    low, high = psm_geometry(Arm("psm").model).ranges.T
    low[2] = 0.05
    return np.random.default_rng(0).uniform(0.95 * low, 0.95 * high, (n, 6))


def test_the_model_opens_by_itself_and_is_where_it_is_left():
    model = mujoco.MjModel.from_xml_path(str(ASSETS / "psm.xml"))
    assert model.opt.timestep == 1e-3
    arm = Arm("psm")
    before = arm.data.qpos.copy()
    for _ in range(300):
        arm.step1()
        arm.step2()
        arm.check()
    np.testing.assert_allclose(arm.data.qpos, before, atol=1e-9)


def test_the_wrist_and_the_jaws_are_where_the_published_table_has_them():
    arm = Arm("psm")
    for joints in random_joints(50):
        arm.data.qpos[:] = with_bars(joints)
        mujoco.mj_kinematics(arm.model, arm.data)
        wanted, tool = wrist_by_the_published_table(joints), arm.data.body("tool")
        np.testing.assert_allclose(tool.xpos, wanted[:3, 3], atol=1e-12)
        jaws = tool.xmat.reshape(3, 3)[:, 1]
        np.testing.assert_allclose(jaws, wanted[:3, 1], atol=1e-12)


@pytest.mark.parametrize("mount_angle", [0.0, 0.6, HALF])
def test_forward_then_inverse_kinematics_has_the_blade_where_it_was(mount_angle):
    arm = Arm("psm", mount_angle=mount_angle)
    measures, blade = psm_geometry(arm.model), arm.data.body("blade")
    for joints in random_joints(50):
        arm.data.qpos[:] = with_bars(joints)
        mujoco.mj_kinematics(arm.model, arm.data)
        position, axes = blade.xpos.copy(), blade.xmat.reshape(3, 3).copy()
        found = measures.reach(position[None], axes[None], mount_angle)
        arm.data.qpos[:] = found.angles[0]
        mujoco.mj_kinematics(arm.model, arm.data)
        np.testing.assert_allclose(blade.xpos, position, atol=1e-12)
        np.testing.assert_allclose(blade.xmat.reshape(3, 3), axes, atol=1e-12)
        arm.reset(np.clip(found.angles[0], *arm.ranges()))


def test_the_spheres_cover_the_parts_up_to_the_wrist_within_a_centimetre():
    arm = Arm("psm")
    measures, model, data = psm_geometry(arm.model), arm.model, arm.data
    parts = [i for i in range(model.ngeom) if model.geom(i).name not in {"blade", "hand", "clevis"}]
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    for joints in random_joints(20):
        data.qpos[:] = with_bars(joints)
        mujoco.mj_kinematics(model, data)
        poses = ArmPoses(None, data.qpos[None], np.zeros((1, 3)), np.eye(3)[None], 0.0)
        centres, radii = measures.spheres(poses)
        for i in parts:
            if model.geom_bodyid[i]:
                box = model.geom_aabb[i, :3] + corners * model.geom_aabb[i, 3:]
                there = data.geom_xpos[i] + box @ data.geom_xmat[i].reshape(3, 3).T
                apart = np.linalg.norm(there[:, None] - centres[0], axis=2) - radii
                assert apart.min(axis=1).max() < 0.01


@pytest.mark.parametrize("name", PLANNED)
def test_it_leads_the_blade_along_every_stroke_from_outside_of_the_body(name):
    stroke = plan_stroke(name, SLAB)
    placement = place(stroke, BOUNDS, "psm")
    trocar = placement.base_position - placement.tissue_origin
    apart = np.maximum(np.maximum(BOUNDS[0] - trocar, trocar - BOUNDS[1]), 0.0)
    assert np.linalg.norm(apart) >= TROCAR_CLEARANCE
    arm = placement.arm()
    origin, worst = placement.tissue_origin, 0.0
    for pose in stroke.poses(int(stroke.duration / 1e-3)):
        wanted = pose._replace(tip=pose.tip + origin, heel=pose.heel + origin)
        arm.hand.follow(wanted)
        arm.step1()
        there = arm.blade.segment()
        worst = max(
            worst, *np.abs(np.concatenate([there.tip - wanted.tip, there.heel - wanted.heel]))
        )
        arm.step2()
        arm.check()
    assert worst < 1e-3


def test_the_remote_centre_is_where_the_trocar_is_asked_for():
    stroke = plan_stroke("straight", SLAB)
    placement = place(stroke, BOUNDS, "psm", trocar=(0.05, 0.0, 0.15))
    np.testing.assert_allclose(
        placement.base_position - placement.tissue_origin, (0.05, 0.0, 0.15), atol=1e-12
    )


@pytest.mark.parametrize("trocar", [(0.02, 0.03, 0.03), (0.02, 0.03, 0.6), (0.5, 0.03, 0.15)])
def test_a_trocar_in_the_body_or_too_far_away_is_refused_with_what_would_do(trocar):
    with pytest.raises(PlacementError, match=r"Move the trocar: at least 20 mm off the body"):
        place(plan_stroke("straight", SLAB), BOUNDS, "psm", trocar=trocar)
