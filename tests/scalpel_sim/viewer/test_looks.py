"""How a page draws the tissue, and the picture that it saves: in the replay of a cut block."""

import io

import numpy as np
import pytest
from PIL import Image

from scalpel_sim.viewer.model_shapes import body_poses
from scalpel_sim.viewer.replay import ReplayWriter
from tests.browser import UNTIL_DRAWN, local_file, new_tab, pixels_of
from tests.scalpel_sim.little_arm import FRAME, little_arm, readings
from tests.scalpel_sim.real_cut import cut_tissue

pytestmark = pytest.mark.browser


@pytest.fixture(scope="module")
def shared_tab(browser, tmp_path_factory):
    path = tmp_path_factory.mktemp("looks") / "replay.html"
    model, data = little_arm()
    replay = ReplayWriter(model, title="block: a <cut>", frame=FRAME)
    replay.add(0.0, cut_tissue()[0], body_poses(data), readings(0.0))
    replay.add(1.25, cut_tissue()[2], body_poses(data), readings(1.25))
    replay.write(path)
    tab = new_tab(browser)
    tab.goto(local_file(path))
    tab.wait_for_function("typeof player !== 'undefined' && player.shown >= 0")
    tab.evaluate("player.pause(), player.seek(player.length)")
    tab.wait_for_function("sceneView.appearances.get('skin').map.image")
    yield tab
    assert tab.failures == []
    tab.close()


@pytest.fixture
def tab(shared_tab):
    """A tab that shows the block after the cut, as at first."""
    shared_tab.evaluate("setShown('faces'), setWireframe(false), chooseCamera(0)")
    return shared_tab


def n_pixels(tab, part):
    """Return how many pixels a part of the tissue changes, at the sides and behind other parts."""
    return len(pixels_of(tab, f"tissue/{part}"))


def test_the_grid_is_all_edges_without_faces(tab):
    with_faces = n_pixels(tab, "skin")
    tab.keyboard.press("g")
    assert tab.input_value("#shown") == "grid"
    assert 0 < n_pixels(tab, "skin") < 0.8 * with_faces
    assert n_pixels(tab, "cut") > 0
    materials = "['skin', 'cut'].map((name) => sceneView.appearances.get(name).visible)"
    assert tab.evaluate(materials) == [False, False]
    tab.keyboard.press("f")
    assert n_pixels(tab, "skin") == pytest.approx(with_faces, rel=0.02)


def test_the_cut_alone_is_seen_through_a_faint_skin(tab):
    seen_between_lips = n_pixels(tab, "cut")
    tab.keyboard.press("c")
    assert tab.input_value("#shown") == "cut"
    assert n_pixels(tab, "cut") > 3 * seen_between_lips
    tab.select_option("#shown", "faces")
    assert n_pixels(tab, "cut") == pytest.approx(seen_between_lips, rel=0.02)


def test_keys_that_are_typed_with_control_or_in_a_list_are_no_shortcuts(tab):
    tab.evaluate("element('meshcat-pane').click()")
    tab.keyboard.press("Control+c")
    assert tab.input_value("#shown") == "faces"
    tab.focus("#shown")
    tab.keyboard.press("v")
    assert tab.is_checked("#contacts")
    tab.evaluate("element('shown').blur()")
    tab.keyboard.press("v")
    assert not tab.is_checked("#contacts")
    tab.keyboard.press("v")


def test_a_key_saves_the_picture_with_heading_and_readings_under_scene_and_time(tab):
    with tab.expect_download() as download:
        tab.keyboard.press("p")
    assert download.value.suggested_filename == "block-a-cut-1.250s.png"
    picture = saved(download.value)
    assert picture.shape[:2] == tuple(tab.evaluate("[innerHeight, innerWidth]"))
    tab.evaluate("document.querySelectorAll('header, dl, footer').forEach((e) => e.hidden = true)")
    tab.evaluate(
        "document.head.insertAdjacentHTML('beforeend', '<style id=bare>*[hidden], "
        "#scene-tree { display: none !important }</style>')"
    )
    tab.evaluate(UNTIL_DRAWN)
    screen = np.asarray(Image.open(io.BytesIO(tab.screenshot())).convert("RGB"), dtype=int)
    tab.evaluate("document.querySelectorAll('header, dl, footer').forEach((e) => e.hidden = false)")
    tab.evaluate("element('bare').remove()")
    differs = np.abs(picture - screen).max(axis=2) > 24
    texts = np.zeros_like(differs)
    texts[:70] = texts[-230:, :380] = True  # where the heading and the readings are
    assert differs[~texts].mean() < 0.01, "the scene is that of the screen"
    assert differs[:70].any() and differs[-230:, :380].any()


def test_the_button_saves_a_picture_too(tab):
    with tab.expect_download() as download:
        tab.click("#save-picture")
    assert saved(download.value).std() > 5.0


def saved(download):
    """Return a downloaded picture: red, green and blue from 0 to 255."""
    return np.asarray(Image.open(download.path()).convert("RGB"), dtype=int)
