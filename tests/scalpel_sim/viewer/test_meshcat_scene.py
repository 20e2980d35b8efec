"""A run is drawn into a meshcat scene that someone else owns, by a real server of meshcat."""

import base64
import os
import re
import signal
import subprocess
import sys
import time

import meshcat
import numpy as np
import pytest
import umsgpack

from scalpel_sim import Viewer
from scalpel_sim.errors import UsageError
from scalpel_sim.viewer import meshcat_scene
from scalpel_sim.viewer.model_shapes import body_poses
from tests.scalpel_sim.little_arm import FRAME, little_arm, readings
from tests.scalpel_sim.real_cut import cut_tissue
from tests.support.browser import new_tab

NO_WAIT = 0.25
"""Longest time of a call of `show` on a busy machine [s]. If it waited for a server that does not
answer, it would wait for ever."""

NEWTON = 0.15 * np.linalg.norm([0.044, 0.06, 0.04])
"""Length of the force arrow of a newton [m]: the body is 44 x 60 x 40 mm as it is held."""

CORNERS = """(path) => {
    // Lowest and highest corner of an object in meshcat's world, in which z is up.
    viewer.scene.updateMatrixWorld(true);
    const box = new MeshCat.THREE.Box3(), point = new MeshCat.THREE.Vector3();
    viewer.scene_tree.find(["meshcat", ...path]).object.traverse((each) => {
        if (!each.isMesh) return;
        const at = each.geometry.attributes.position;
        for (let i = 0; i < at.count; i++) {
            point.fromBufferAttribute(at, i).applyMatrix4(each.matrixWorld);
            box.expandByPoint(point.set(point.x, -point.z, point.y));
        }
    });
    return [box.min.toArray(), box.max.toArray()];
}"""


@pytest.fixture(scope="module")
def owner():
    visualizer = meshcat.Visualizer()
    yield visualizer
    visualizer.window.server_proc.kill()
    visualizer.window.server_proc.wait()


def commands_in(visualizer) -> dict:
    """Return the commands that a page which is opened now would get, by path and type."""
    blobs = re.findall(r"octet-binary;base64,([^\"]+)\"", visualizer.static_html())
    packets = [umsgpack.unpackb(base64.b64decode(blob)) for blob in blobs]
    return {(packet["path"], packet["type"]): packet for packet in packets}


def show_cut(visualizer) -> None:
    """Show a cut block, and an arm that is pushed back with 1 N."""
    model, data = little_arm()
    with Viewer(model, frame=FRAME, visualizer=visualizer) as viewer:
        viewer.show(cut_tissue()[2], body_poses(data), readings(0.1))


def test_the_shapes_the_tissue_and_the_force_arrive_below_the_path_of_the_owner(owner):
    owner["mine"].set_object(meshcat.geometry.Box([1.0, 1.0, 1.0]))
    show_cut(owner["theirs/tissue"])
    commands = commands_in(owner)
    below = "/meshcat/theirs/tissue"
    assert ("/meshcat/mine", "set_object") in commands
    assert (f"{below}/bodies/3/blade", "set_object") in commands
    body = commands[f"{below}/body", "set_object"]["object"]["geometries"][0]["data"]
    surface = cut_tissue()[2]
    points = np.frombuffer(body["attributes"]["position"]["array"].data, np.float32).reshape(-1, 3)
    triangles = np.frombuffer(body["index"]["array"].data, np.uint32).reshape(-1, 3)
    assert np.allclose(points[triangles], surface.positions[surface.triangles], atol=1e-7)
    colours = np.frombuffer(body["attributes"]["color"]["array"].data, np.float32).reshape(-1, 3)
    red, green, _ = colours[triangles[surface.is_cut]].reshape(-1, 3).T
    skin_red, skin_green, _ = colours[triangles[~surface.is_cut]].reshape(-1, 3).T
    assert red.min() / green.max() > 1.25 * skin_red.max() / skin_green.min()
    pose = np.reshape(commands[f"{below}/body", "set_transform"]["matrix"], (4, 4)).T
    assert np.array_equal(pose[:3, 3], FRAME.origin)
    arrow = np.reshape(commands[f"{below}/force", "set_transform"]["matrix"], (4, 4)).T
    assert arrow[:3, 3] == pytest.approx([0.0, 0.0, 0.08])
    assert arrow[:3, 1] == pytest.approx([0.0, -NEWTON, 0.0], rel=0.05)


def test_the_owner_goes_on_to_use_the_scene_meanwhile(owner):
    surfaces, (model, data) = cut_tissue(), little_arm()
    with Viewer(model, frame=FRAME, visualizer=owner["tissue"]) as viewer:
        for i in range(200):
            viewer.show(surfaces[i % 3], body_poses(data), readings(0.001 * i))
            owner["mine"].set_transform(np.eye(4))
    assert ("/meshcat/tissue/body", "set_object") in commands_in(owner)


def test_tissue_without_a_model_is_drawn(owner):
    with Viewer(visualizer=owner["alone"]) as viewer:
        viewer.show(cut_tissue()[0])
    assert ("/meshcat/alone/body", "set_object") in commands_in(owner)


def test_a_server_that_does_not_answer_does_not_make_the_run_wait(monkeypatch, caplog):
    monkeypatch.setattr(meshcat_scene, "PATIENCE", 0.5)
    visualizer, (model, data) = meshcat.Visualizer(), little_arm()
    server = visualizer.window.server_proc
    try:
        with Viewer(model, frame=FRAME, visualizer=visualizer) as viewer:
            os.kill(server.pid, signal.SIGSTOP)
            longest, end = 0.0, time.monotonic() + 60.0
            while viewer._scene.is_drawn and time.monotonic() < end:
                start = time.perf_counter()
                viewer.show(cut_tissue()[0], body_poses(data), readings(0.0))
                longest = max(longest, time.perf_counter() - start)
                time.sleep(0.01)
            assert not viewer._scene.is_drawn and viewer.is_running
    finally:
        server.kill()
        server.wait()
    assert longest < NO_WAIT
    assert "does not answer; nothing more is drawn there" in caplog.text


def test_what_is_no_visualizer_is_refused():
    with pytest.raises(UsageError, match=r"a str is no meshcat scene; give it a meshcat\.Vis"):
        Viewer(visualizer="http://127.0.0.1:7000")


def test_without_a_visualizer_the_package_of_meshcat_is_not_imported():
    program = (
        "import sys, scalpel_sim\n"
        "scalpel_sim.Viewer().close()\n"
        "assert not {'meshcat', 'zmq', 'IPython'} & set(sys.modules)"
    )
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    done = subprocess.run([sys.executable, "-c", program], env=environment)
    assert done.returncode == 0


@pytest.mark.browser
def test_meshcats_own_page_shows_tissue_blade_and_force_where_they_are(owner, browser):
    tab = new_tab(browser)
    tab.goto(owner.url())
    show_cut(owner["seen"])
    tab.wait_for_function(
        "viewer.scene_tree.find(['meshcat', 'seen', 'body', '<object>']).object.isMesh"
    )

    def corners(*path):
        return np.array(tab.evaluate(CORNERS, ["seen", *path]))

    points = FRAME.points_to_world(cut_tissue()[2].positions)
    assert corners("body") == pytest.approx(np.array([points.min(0), points.max(0)]), abs=1e-6)
    blade = corners("bodies", "3", "blade")
    assert blade[:, 2] == pytest.approx([0.08, 0.12], abs=1e-6)  # tip and heel
    arrow = corners("force")
    assert arrow[:, 1] == pytest.approx([-NEWTON, 0.0], rel=0.05, abs=1e-6)
    assert arrow.mean(axis=0)[[0, 2]] == pytest.approx([0.0, 0.08], abs=1e-6)
    assert tab.failures == []
    tab.close()
