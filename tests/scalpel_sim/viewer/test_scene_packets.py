import msgspec
import mujoco
import numpy as np
import pytest

from bridge import TissueFrame
from scalpel_sim.scene.schema import ViewTable
from scalpel_sim.viewer.messages import SceneState
from scalpel_sim.viewer.model_shapes import body_poses, shapes_of
from scalpel_sim.viewer.scene_packets import ScenePackets
from tests.scalpel_sim.cut_block import cut_block
from tests.scalpel_sim.little_arm import FRAME, little_arm, readings


def commands(packet: bytes) -> dict[str, dict]:
    """Return the commands of a packet by their kind and path, or name."""
    decoded = msgspec.msgpack.decode(packet, ext_hook=lambda code, body: bytes(body))
    return {
        " ".join(filter(None, (each["type"], each.get("path") or each.get("name")))): each
        for each in decoded["commands"]
    }


def opening(surface, frame=FRAME):
    model, data = little_arm()
    return commands(ScenePackets(shapes_of(model), frame).opening(surface, body_poses(data)))


@pytest.mark.parametrize("size", [0.1, 1.0, 30.0])
def test_the_camera_frames_bodies_of_any_size(size):
    block = cut_block(0.0)
    camera = opening(block._replace(positions=block.positions * size))["set_cameras"]["cameras"][0]
    centre = np.array([0.02, 0.03, 0.02]) * size + FRAME.origin
    diagonal = np.linalg.norm([0.04, 0.06, 0.04]) * size
    assert camera["target"] == pytest.approx(centre)
    distance = np.linalg.norm(np.subtract(camera["eye"], centre))
    assert 1.5 * diagonal < distance < 4.0 * diagonal
    assert camera["eye"][2] > centre[2] + 0.3 * distance, "the camera looks down on it"


def test_views_stand_in_the_frame_of_the_tissue_before_the_pages_own():
    quarter = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    frame = TissueFrame(rotation=quarter, origin=np.array([0.0, 0.0, 1.0]))
    view = ViewTable(name="side", eye=(0.2, 0.0, 0.0), target=(0.0, 0.0, 0.0), up=(0.0, 1.0, 0.0))
    model, data = little_arm()
    packets = ScenePackets(shapes_of(model), frame, views=[view])
    opening = commands(packets.opening(cut_block(0.0), body_poses(data)))["set_cameras"]
    first, own = opening["cameras"]
    assert first["name"] == "side"
    assert first["eye"] == pytest.approx([0.0, 0.2, 1.0])
    assert first["target"] == pytest.approx([0.0, 0.0, 1.0])
    assert first["up"] == pytest.approx([-1.0, 0.0, 0.0])
    alone = ScenePackets(shapes_of(model), frame).opening(cut_block(0.0), body_poses(data))
    assert commands(alone)["set_cameras"]["cameras"] == [own]


def test_a_view_with_the_name_of_the_pages_own_stands_in_its_place():
    view = ViewTable(name="where the blade enters", eye=(0.2, 0.0, 0.0), target=(0.0, 0.0, 0.0))
    model, data = little_arm()
    packets = ScenePackets(shapes_of(model), FRAME, views=[view])
    opening = commands(packets.opening(cut_block(0.0), body_poses(data)))["set_cameras"]
    assert [camera["fov"] for camera in opening["cameras"]] == [view.fov_degrees]


def test_tissue_is_drawn_in_its_own_frame_and_the_arm_in_the_world():
    model, data = little_arm()
    packets = ScenePackets(shapes_of(model), FRAME)
    first = commands(packets.opening(cut_block(0.0), body_poses(data)))
    data.qpos[0] = 0.01
    mujoco.mj_kinematics(model, data)
    later = commands(packets.frame(SceneState(cut_block(0.01), body_poses(data), readings(0.1))))
    assert first["set_transform /tissue"]["matrix"][12:15] == pytest.approx(FRAME.origin)
    assert "set_transform /tissue" not in later
    handle = model.body("handle").id
    assert later[f"set_transform /bodies/{handle}"]["matrix"][12:15] == pytest.approx(
        [0.0, 0.01, 0.12]
    )


def test_textures_are_sent_once_and_geometry_with_every_frame():
    model, data = little_arm()
    packets = ScenePackets(shapes_of(model), FRAME)
    first = commands(packets.opening(cut_block(0.0), body_poses(data)))
    later = commands(packets.frame(SceneState(cut_block(0.01), body_poses(data))))
    assert {"set_appearance skin", "set_appearance cut"} <= first.keys()
    assert {"set_object /tissue/skin", "set_object /tissue/cut"} <= later.keys()
    assert not any(key.startswith("set_appearance") for key in later)
    assert not any(key.startswith("set_object /bodies") for key in later)


def test_a_model_without_shapes_is_accepted():
    packets = ScenePackets([])
    camera = commands(packets.opening(cut_block(0.0), np.zeros((1, 7))))["set_cameras"]["cameras"][
        0
    ]
    assert np.isfinite(camera["eye"]).all()
