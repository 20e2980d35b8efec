import re
import tomllib
from pathlib import Path

import numpy as np
import pytest

from scalpel_sim.errors import RunError
from scalpel_sim.recording.columns import ForceParts
from scalpel_sim.scene.schema import ViewTable
from scalpel_sim.viewer import page
from scalpel_sim.viewer import replay as replay_module
from scalpel_sim.viewer.messages import SceneState
from scalpel_sim.viewer.model_shapes import body_poses
from scalpel_sim.viewer.replay import BYTES_PER_TRIANGLE, ReplayWriter
from tests.scalpel_sim.little_arm import FRAME, little_arm, readings
from tests.scalpel_sim.real_cut import cut_tissue
from tests.support.browser import WINDOW, local_file, new_tab, pixels, pixels_of
from tissue import Energies

N_PIXELS = WINDOW["width"] * WINDOW["height"]


def times_in(path) -> list[float]:
    return [float(time) for time in re.findall(r'data-time="([^"]+)"', path.read_text())][1:]


def write_cut(path, *, n_frames=3, wireframe=False, title="a block"):
    model, data = little_arm()
    replay = ReplayWriter(model, title=title, frame=FRAME, wireframe=wireframe)
    for i in range(n_frames):
        surface = cut_tissue()[min(i, 2)]
        replay.add(0.1 * i, SceneState(surface, body_poses(data), readings(0.1 * i)))
    replay.write(path)


def test_a_run_of_a_second_is_kept_as_twenty_five_frames_and_its_last(tmp_path):
    model, data = little_arm()
    replay = ReplayWriter(model)
    whole, poses = cut_tissue()[0], body_poses(data)
    for frame in range(1000):
        replay.add(frame / 1000, SceneState(whole, poses))
    replay.write(tmp_path / "replay.html")
    times = times_in(tmp_path / "replay.html")
    assert len(times) == 26
    assert np.allclose(np.diff(times[:-1]), 0.04)
    assert times[-1] == 0.999


def test_a_heavy_body_gets_fewer_frames_evenly_spread(tmp_path, monkeypatch):
    model, data = little_arm()
    whole, poses = cut_tissue()[0], body_poses(data)
    limit = 10 * len(whole.triangles) * BYTES_PER_TRIANGLE
    monkeypatch.setattr(replay_module, "FILE_LIMIT", limit)
    replay = ReplayWriter(model)
    for frame in range(100):
        if replay.is_due(frame * 0.04):
            replay.add(frame * 0.04, SceneState(whole, poses))
    replay.write(tmp_path / "replay.html")
    times = times_in(tmp_path / "replay.html")
    assert 5 <= len(times) <= 10
    assert np.ptp(np.diff(times)) < 1e-9


def test_a_file_is_no_larger_than_estimated(tmp_path):
    write_cut(tmp_path / "few.html", n_frames=2)
    write_cut(tmp_path / "more.html", n_frames=12)
    added = (tmp_path / "more.html").stat().st_size - (tmp_path / "few.html").stat().st_size
    assert added / 10 < len(cut_tissue()[2].triangles) * BYTES_PER_TRIANGLE


def test_a_replay_without_frames_is_refused(tmp_path):
    with pytest.raises(ValueError, match="no frames"):
        ReplayWriter(little_arm()[0]).write(tmp_path / "replay.html")


def test_a_title_is_text_and_not_markup(tmp_path):
    write_cut(tmp_path / "replay.html", title="<b>$bold</b>")
    assert "<h1>&lt;b&gt;$bold&lt;/b&gt;</h1>" in (tmp_path / "replay.html").read_text()


def test_without_meshcats_bundle_one_sentence_names_the_path_that_was_tried(tmp_path, monkeypatch):
    monkeypatch.setattr(page, "_BUNDLE", Path("viewer", "dist", "moved.js"))
    with pytest.raises(RunError, match=r"^meshcat's viewer.*moved\.js: pip install 'meshcat>=.*'$"):
        write_cut(tmp_path / "replay.html")
    assert not (tmp_path / "replay.html").exists()


def test_without_meshcat_one_sentence_names_it_as_missing(tmp_path, monkeypatch):
    monkeypatch.setattr(page.importlib.util, "find_spec", lambda name: None)
    with pytest.raises(
        RunError, match=r"^meshcat, .* is not installed: pip install 'meshcat>=.*'$"
    ):
        write_cut(tmp_path / "replay.html")


def test_the_message_names_the_versions_of_meshcat_that_the_project_requires():
    project = tomllib.loads((Path(__file__).parents[3] / "pyproject.toml").read_text("utf-8"))
    assert page._REQUIREMENT in project["project"]["dependencies"]


@pytest.mark.browser
def test_the_page_plays_the_cut_by_itself_and_sends_no_request(tab, tmp_path):
    schemes = []
    tab.on("request", lambda request: schemes.append(request.url.split(":")[0]))
    write_cut(tmp_path / "replay.html")
    tab.goto(local_file(tmp_path / "replay.html"))
    tab.wait_for_function("window.viewer && typeof player !== 'undefined' && player.shown === 2")
    assert set(schemes) <= {"file", "data", "blob"}
    assert tab.title() == "a block"
    assert tab.text_content("#force") == "1.00 N"
    tab.click("#play")
    assert not tab.evaluate("player.isPlaying")


@pytest.mark.browser
def test_each_contact_is_a_line_along_its_force_and_can_be_switched_off(tab, tmp_path):
    model, data = little_arm()
    shown = readings(0.0)._replace(
        contact_points=np.array([[0.0, 0.0, 0.08], [0.01, 0.0, 0.08]]),
        contact_forces=np.array([[0.0, -0.5, 0.0], [0.0, -0.5, 0.1]]),
        parts=ForceParts(np.array([0.0, -0.6, 0.8]), np.zeros(3), np.array([0.2, 0.0, 0.0])),
        energies=Energies(*np.zeros(len(Energies._fields)))._replace(
            cutting=3e-3, friction=1e-3, elastic=-2e-3
        ),
    )
    replay = ReplayWriter(model, frame=FRAME)
    replay.add(0.0, SceneState(cut_tissue()[0], body_poses(data), shown))
    replay.write(tmp_path / "replay.html")
    tab.goto(local_file(tmp_path / "replay.html"))
    tab.wait_for_function("typeof player !== 'undefined' && player.shown === 0")
    ends = tab.evaluate("[...sceneView.contacts.geometry.attributes.position.array]")
    start, end, _, other = np.reshape(ends, (4, 3))
    assert start == pytest.approx([0.0, 0.0, 0.08])
    assert (end - start)[1] < 0.0 and (other[2] - 0.08) / (end - start)[1] == pytest.approx(-0.2)
    assert tab.text_content("#parts") == "1.00 · 0.00 · 0.20 N"
    right = "(s) => document.querySelector(s).getBoundingClientRect().right"
    assert tab.evaluate(right, "#parts") < tab.evaluate(right, "#readings")
    bars = tab.evaluate("[...document.querySelectorAll('#energies span')].map((s) => s.title)")
    assert bars == ["cutting: toughness x area: 3.00 mJ", "friction on the blade: 1.00 mJ"]
    tab.uncheck("#contacts")
    assert not tab.evaluate("sceneView.contacts.visible")


@pytest.mark.browser
def test_views_are_chosen_by_their_names_or_by_keys(tab, tmp_path):
    above = ViewTable(name="above", eye=(0.02, 0.03, 0.3), target=(0.02, 0.03, 0.0), up=(0, 1, 0))
    side = ViewTable(name="<side>", eye=(0.3, 0, 0), target=(0, 0, 0), fov_degrees=20.0)
    replay = ReplayWriter(little_arm()[0], frame=FRAME, views=[above, side])
    replay.add(0.0, SceneState(cut_tissue()[0], body_poses(little_arm()[1]), readings(0.0)))
    replay.write(tmp_path / "replay.html")
    tab.goto(local_file(tmp_path / "replay.html"))
    tab.wait_for_function("typeof player !== 'undefined' && player.shown === 0")
    select = tab.get_by_role("combobox", name="view", exact=True)
    names = select.evaluate("(list) => [...list.options].map((option) => option.text)")
    assert names == ["above", "<side>", "where the blade enters"]

    def seen(point):  # across and up from the target in the picture, where half of it is 1
        return tab.evaluate(SEEN, FRAME.points_to_world(np.array(point)).tolist())

    across, up = seen([0.02, 0.04, 0.0])
    assert across == pytest.approx(0.0, abs=1e-6)
    assert up == pytest.approx(0.01 / (0.3 * np.tan(np.radians(19.0))), rel=1e-4)
    tab.keyboard.press("2")
    assert select.input_value() == "1"
    height = 0.01 / (0.3 * np.tan(np.radians(10.0)))
    assert seen([0.0, 0.0, 0.01]) == pytest.approx([0.0, height], abs=1e-6)
    select.select_option("where the blade enters")
    own = tab.evaluate("viewer.camera.position.toArray()")
    tab.keyboard.press("9")
    # With each picture the controls of the view may round the place anew.
    assert tab.evaluate("viewer.camera.position.toArray()") == pytest.approx(own, rel=1e-12)
    tab.evaluate("viewer.camera.position.set(1, 1, 1)")
    tab.click("#home")
    assert tab.evaluate("viewer.camera.position.toArray()") == pytest.approx(own)


@pytest.mark.browser
def test_a_page_with_its_own_view_alone_offers_no_choice(replay_tab):
    assert not replay_tab.is_visible("#view")
    assert replay_tab.evaluate("[viewer.camera.fov, viewer.camera.up.toArray()]") == [38, [0, 1, 0]]


SEEN = """(point) => {
    viewer.camera.updateMatrixWorld();
    const [x, y, z] = point;
    const seen = new THREE.Vector3(x, z, -y).project(viewer.camera);
    return [seen.x, seen.y - 2 * viewer.camera.view.offsetY];
}"""


@pytest.fixture(scope="module")
def replay_tab(browser, tmp_path_factory):
    """A tab that shows the last frame of a cut, and nothing beside the picture."""
    path = tmp_path_factory.mktemp("replay") / "replay.html"
    write_cut(path, wireframe=True)
    tab = new_tab(browser)
    tab.goto(local_file(path))
    tab.wait_for_function("typeof player !== 'undefined' && player.shown >= 0")
    tab.evaluate("player.pause(), player.seek(player.length)")
    tab.evaluate("document.querySelectorAll('header, dl').forEach((e) => e.hidden = true)")
    tab.wait_for_function(
        "sceneView.appearances.get('skin').map.image && sceneView.appearances.get('cut').map.image"
    )
    yield tab
    tab.close()


@pytest.mark.browser
def test_the_wireframe_is_drawn_on_request(replay_tab):
    assert replay_tab.is_checked("#wireframe")
    wired = pixels(replay_tab)
    replay_tab.uncheck("#wireframe")
    assert (np.abs(wired - pixels(replay_tab)).max(axis=2) > 12).sum() > 1000


@pytest.mark.browser
def test_skin_and_cut_faces_are_seen_and_differ_in_colour(replay_tab):
    replay_tab.uncheck("#wireframe")
    skin, cut = pixels_of(replay_tab, "tissue/skin"), pixels_of(replay_tab, "tissue/cut")
    assert len(skin) > N_PIXELS / 30
    assert len(cut) > N_PIXELS / 300
    red, green, _ = np.median(skin, axis=0)
    cut_red, cut_green, _ = np.median(cut, axis=0)
    assert red > 1.2 * green
    assert cut_red / cut_green > 1.25 * red / green
    assert skin.std(axis=0).min() > 5.0, "the skin has no texture"


@pytest.mark.browser
def test_before_the_cut_there_is_skin_only_and_the_blade_is_seen(replay_tab):
    replay_tab.evaluate("player.seek(0)")
    assert len(pixels_of(replay_tab, "tissue/skin")) > N_PIXELS / 30
    assert len(pixels_of(replay_tab, "tissue/cut")) == 0
    assert len(pixels_of(replay_tab, "bodies/3/blade")) > 15
