import mujoco
import numpy as np
import pytest

from scalpel_sim.viewer.model_shapes import body_poses, shapes_of
from tests.scalpel_sim.little_arm import little_arm


@pytest.fixture(scope="module")
def shapes():
    return {shape.name: shape for shape in shapes_of(little_arm()[0])}


def volume(mesh) -> float:
    """Return the volume that a closed surface encloses [m3]; negative if it is inside out."""
    return float(np.linalg.det(mesh.positions[mesh.triangles]).sum() / 6.0)


def test_what_mujoco_hides_is_not_drawn(shapes):
    assert "hidden" not in shapes
    assert "glass" not in shapes


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("ball", 4 / 3 * np.pi * 0.02**3),
        ("egg", 4 / 3 * np.pi * 0.01 * 0.02 * 0.03),
        ("drum", np.pi * 0.03**2 * 0.04),
        ("grip", np.pi * 0.006**2 * 0.06 + 4 / 3 * np.pi * 0.006**3),
    ],
)
def test_round_shapes_enclose_the_volume_of_their_geom(shapes, name, expected):
    assert volume(shapes[name].mesh) == pytest.approx(expected, rel=0.02)


def test_a_box_is_exact():
    model = mujoco.MjModel.from_xml_string(
        "<mujoco><worldbody><geom type='box' size='.1 .2 .3'/></worldbody></mujoco>"
    )
    (box,) = shapes_of(model)
    assert volume(box.mesh) == pytest.approx(8 * 0.1 * 0.2 * 0.3)
    assert not box.is_blade


def test_a_mesh_lies_where_the_file_had_it(shapes):
    _, data = little_arm()
    stone = shapes["stone"]
    rotation = data.geom("stone").xmat.reshape(3, 3)
    in_world = stone.mesh.positions @ rotation.T + data.geom("stone").xpos
    assert volume(stone.mesh) == pytest.approx(0.02**3 / 6.0, rel=1e-5)
    assert in_world.min(axis=0) == pytest.approx([-0.06, -0.15, 0.01], abs=1e-6)
    assert in_world.max(axis=0) == pytest.approx([-0.04, -0.13, 0.03], abs=1e-6)


def test_a_height_field_has_its_summit(shapes):
    assert shapes["hill"].mesh.positions.max(axis=0) == pytest.approx([0.05, 0.05, 0.02])


def test_every_shape_has_unit_normals(shapes):
    for shape in shapes.values():
        lengths = np.linalg.norm(shape.mesh.normals[shape.mesh.triangles], axis=2)
        assert np.allclose(lengths, 1.0, atol=1e-5), shape.name


def test_the_blade_is_sharp_from_heel_to_tip_and_no_wider_than_its_box(shapes):
    blade = shapes["blade"]
    assert blade.is_blade
    assert volume(blade.mesh) > 0.0
    points = np.unique(blade.mesh.positions, axis=0)
    heel, tip = np.array([0.0, 0.003, 0.02]), np.array([0.0, 0.003, -0.02])
    for end in (heel, tip):
        assert np.linalg.norm(points - end, axis=1).min() < 1e-12
    assert (np.abs(points) < np.array([0.0002, 0.003, 0.02]) + 1e-12).all()
    at_edge = np.abs(points[:, 1] - 0.003) < 1e-9
    assert (points[at_edge, 0] == 0.0).all(), "the edge has no thickness"


def test_only_the_marker_of_the_hand_is_a_target(shapes):
    assert [shape.name for shape in shapes.values() if shape.is_target] == ["target"]


def test_poses_are_those_of_mujoco():
    model, data = little_arm()
    poses = body_poses(data)
    assert poses.shape == (model.nbody, 7)
    assert poses[model.body("handle").id] == pytest.approx([0.0, 0.0, 0.12, 1.0, 0.0, 0.0, 0.0])
