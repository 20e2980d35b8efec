"""Skin that is drawn smoother than its triangles, and stays where it was at edges."""

import numpy as np
import pytest
from trimesh import creation

from scalpel_sim.viewer.messages import SceneState
from scalpel_sim.viewer.model_shapes import body_poses
from scalpel_sim.viewer.replay import ReplayWriter
from tests.scalpel_sim.little_arm import FRAME, little_arm, readings
from tests.scalpel_sim.real_cut import cut_tissue
from tests.support.browser import local_file, new_tab

pytestmark = pytest.mark.browser

SINGLE = 1e-6
"""Rounding of positions in single precision, over the size of a body of 6 cm [m]; generous."""

SMOOTHED = """([positions, normals, index]) => {
    const geometry = new THREE.BufferGeometry(), round = (n) => Math.round(32767 * n);
    const set = (name, array, size) =>
        geometry.setAttribute(name, new THREE.BufferAttribute(array, size, name !== "position"));
    set("position", new Float32Array(positions), 3);
    set("normal", new Int16Array(normals.map(round)), 3);
    set("color", new Int16Array(positions.length).fill(32767), 3);
    geometry.setIndex(new THREE.BufferAttribute(new Uint16Array(index), 1));
    geometry.userData = { tints: geometry.attributes.color, levels: {} };
    const none = new THREE.BufferGeometry();
    none.setAttribute("position", new THREE.BufferAttribute(new Float32Array(0), 3));
    none.setIndex(new THREE.BufferAttribute(new Uint16Array(0), 1));
    const smooth = new SmoothSkin().of(geometry, none);
    return [[...smooth.attributes.position.array], [...smooth.index.array]];
}"""
"""Positions and index of the smooth twin of a geometry without a cut."""

SHOWN = """(name) => {
    const { mesh, geometry } = sceneView.tissue.get(name);
    const parts = [mesh.geometry, geometry].map((each) =>
        [[...each.attributes.position.array], [...each.index.array]]);
    return [...parts, mesh.geometry === sceneView.smoothSkin.geometry];
}"""
"""Positions and index of a part of the tissue as it is drawn and as it came; if it is smoothed."""


@pytest.fixture(scope="module")
def tab(browser, tmp_path_factory):
    path = tmp_path_factory.mktemp("smooth") / "replay.html"
    model, data = little_arm()
    replay = ReplayWriter(model, frame=FRAME)
    for time, surface in enumerate(cut_tissue()):
        replay.add(float(time), SceneState(surface, body_poses(data), readings(time)))
    replay.write(path)
    tab = new_tab(browser)
    tab.goto(local_file(path))
    tab.wait_for_function("typeof player !== 'undefined' && player.shown >= 0")
    tab.evaluate("player.pause()")
    yield tab
    assert tab.failures == []
    tab.close()


def shown(tab, name):
    """Return what is drawn of a part of the tissue, what came, and whether the skin is smooth."""
    drawn, came, is_smooth = tab.evaluate(SHOWN, name)
    meshes = [(np.array(p).reshape(-1, 3), np.array(i).reshape(-1, 3)) for p, i in (drawn, came)]
    return *meshes, is_smooth


def edges_of(points, triangles):
    """Return the edges between places, each with its lower place first, shape (n, 2, 3)."""
    edges = points[np.concatenate([triangles[:, [i, (i + 1) % 3]] for i in range(3)])]
    swapped = [tuple(a) > tuple(b) for a, b in edges]
    edges[swapped] = edges[swapped][:, ::-1]
    return edges


def test_a_ball_is_six_times_as_round(tab):
    ball = creation.icosphere(subdivisions=2, radius=0.03)
    points, index = tab.evaluate(
        SMOOTHED,
        [each.ravel().tolist() for each in (ball.vertices, ball.vertex_normals, ball.faces)],
    )
    smooth = np.reshape(points, (-1, 3)), np.reshape(index, (-1, 3))
    assert len(smooth[1]) == 16 * len(ball.faces)

    def depth(points, triangles):
        return 0.03 - np.linalg.norm(points[triangles].mean(axis=1), axis=1).min()

    assert depth(*smooth) < depth(ball.vertices, ball.faces) / 6.0
    assert np.array_equal(smooth[0][: len(ball.vertices)], ball.vertices.astype(np.float32))


@pytest.mark.parametrize("time", [0, 1, 2])
def test_smooth_skin_is_closed_up_to_the_cut_and_meets_its_faces(tab, time):
    tab.evaluate(f"player.seek({time})")
    tab.wait_for_function("coarseness.drawn === 0")
    smooth, came, is_smooth = shown(tab, "skin")
    assert is_smooth and len(smooth[1]) == 16 * len(came[1])
    cut = shown(tab, "cut")[1]
    sides = {each.tobytes() for each in edges_of(*cut)} if len(cut[1]) else set()
    rim = [each for each in edges_of(*came) if each.tobytes() in sides]
    assert (len(rim) > 0) == (time > 0)
    drawn, counts = np.unique(edges_of(*smooth).reshape(-1, 6), axis=0, return_counts=True)
    lonely = drawn[counts == 1].reshape(-1, 2, 3)
    assert len(lonely) == 4 * len(rim), "else there would be gaps in the skin"
    for a, b in lonely:
        on_rim = min(max(distance(p, *edge) for p in (a, b)) for edge in rim)
        assert on_rim < SINGLE, "the rim has stayed where the faces of the cut are"


def distance(point, start, end):
    """Return the distance of a point from a piece of a line."""
    way = end - start
    share = np.clip((point - start) @ way / max(way @ way, SINGLE**2), 0.0, 1.0)
    return np.linalg.norm(start + share * way - point)


def test_the_flat_sides_of_a_block_stay_flat_and_its_edges_sharp(tab):
    tab.evaluate("player.seek(0)")
    (points, _), (came, _), _ = shown(tab, "skin")
    low, high = came.min(axis=0), came.max(axis=0)
    from_sides = np.minimum(np.abs(points - low), np.abs(points - high)).min(axis=1)
    assert from_sides.max() < SINGLE
    assert (points.min(axis=0), points.max(axis=0)) == (pytest.approx(low), pytest.approx(high))


def test_coarse_pictures_and_edges_are_those_of_the_triangles_that_came(tab):
    tab.evaluate("coarseness.levels.level = LEVELS.length - 1, coarseness.onChange()")
    assert not shown(tab, "skin")[2]
    tab.wait_for_function("coarseness.drawn === 0")
    assert shown(tab, "skin")[2]
    for change in ("setWireframe(true)", "setShown('grid')"):
        tab.evaluate(change)
        assert not shown(tab, "skin")[2]
        tab.evaluate("setWireframe(false), setShown('faces')")
        assert shown(tab, "skin")[2]
