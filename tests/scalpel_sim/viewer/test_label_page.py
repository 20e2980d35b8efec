"""A page shows the labels of a body: their colours on skin and cut faces, and their names."""

import numpy as np
import pytest

from scalpel_sim.viewer.messages import SceneState
from scalpel_sim.viewer.model_shapes import body_poses
from scalpel_sim.viewer.replay import ReplayWriter
from tests.scalpel_sim.little_arm import FRAME, little_arm, readings
from tests.scalpel_sim.viewer.test_label_textures import BLOCK, LABELS, LAYERS, LOOK, layers
from tests.support.browser import local_file, new_tab, pixels_of
from tissue import Tissue

pytestmark = pytest.mark.browser

ALONE = """() => {
    sceneView.lights.lamp.castShadow = false;
    setContacts(false);
    chooseCamera(0);
    viewer.set_property(["bodies"], "visible", false);
    element("overlay").style.visibility = "hidden";
}"""


@pytest.fixture(scope="module")
def shared_tab(browser, tmp_path_factory):
    path = tmp_path_factory.mktemp("labels") / "replay.html"
    model, data = little_arm()
    replay = ReplayWriter(model, title="layers", frame=FRAME, look=LOOK)
    whole = Tissue(BLOCK._replace(labels=LAYERS)).surface()
    for time, surface in ((0.0, whole), (1.0, layers().surface())):
        values = {"stress": np.full(len(surface.positions), 300.0)}
        replay.add(time, SceneState(surface, body_poses(data), readings(time), None, values))
    replay.write(path)
    tab = new_tab(browser)
    tab.goto(local_file(path))
    tab.wait_for_function("typeof player !== 'undefined' && player.shown >= 0")
    tab.evaluate("player.pause()")
    tab.wait_for_function("sceneView.appearances.get('skin').map.image")
    yield tab
    assert tab.failures == []
    tab.close()


@pytest.fixture
def tab(shared_tab):
    shared_tab.evaluate("setQuantity(''), setShown('faces'), player.seek(player.length)")
    return shared_tab


def hues(pixels):
    """Return the share of each channel in colours, shape (n, 3)."""
    return pixels / pixels.sum(axis=1, keepdims=True)


def shares_of_labels(pixels, names):
    """Return how many of the pixels are nearest in hue to each colour, as shares."""
    known = hues(np.array([list(bytes.fromhex(name)) for name in names], dtype=float))
    seen = hues(pixels.astype(float) + 1.0)
    nearest = np.linalg.norm(seen[:, None] - known, axis=2).argmin(axis=1)
    return np.bincount(nearest, minlength=len(names)) / len(nearest)


@pytest.mark.parametrize("at", ["0", "player.length"])
def test_skin_has_the_colours_of_its_labels_before_and_after_a_cut(tab, at):
    tab.evaluate(f"player.seek({at})")
    tab.evaluate(ALONE)
    shares = shares_of_labels(pixels_of(tab, "tissue/skin"), [each.skin for each in LABELS])
    tab.evaluate("element('overlay').style.visibility = 'visible'")
    assert (shares > 0.1).all()


def test_faces_of_a_cut_have_the_colours_of_the_labels_that_it_went_through(tab):
    tab.evaluate(ALONE)
    tab.evaluate("setShown('cut')")
    shares = shares_of_labels(pixels_of(tab, "tissue/cut"), [each.inside for each in LABELS])
    tab.evaluate("element('overlay').style.visibility = 'visible'")
    assert (shares > 0.1).all()


def test_the_legend_names_the_labels_until_values_are_shown(tab):
    assert tab.locator("#legend li").all_inner_texts() == ["muscle", "duct", "vein"]
    assert tab.get_attribute("#legend", "aria-label") == "parts of the body"
    swatches = tab.locator("#legend span").evaluate_all(
        "(all) => all.map((each) => getComputedStyle(each).backgroundImage)"
    )
    assert "rgb(192, 48, 32)" in swatches[0] and "rgb(160, 32, 24)" in swatches[0]
    tab.evaluate("setQuantity('stress')")
    assert tab.is_hidden("#legend") and tab.is_visible("#scale")
    tab.evaluate("setQuantity('')")
    assert tab.is_visible("#legend")


def test_the_legend_is_on_the_screen_of_a_phone(tab):
    before = tab.viewport_size
    tab.set_viewport_size({"width": 390, "height": 800})
    boxes = [each.bounding_box() for each in tab.locator("#legend li").all()]
    tab.set_viewport_size(before)
    assert all(box["x"] >= 0 and box["x"] + box["width"] <= 390 for box in boxes)
    assert all(box["y"] >= 0 and box["y"] + box["height"] <= 800 for box in boxes)


def test_a_body_of_one_label_has_no_legend(tab):
    tab.evaluate("viewer.handle_command({type: 'set_legend', entries: []})")
    hidden = tab.is_hidden("#legend")
    tab.evaluate("player.seek(0)")
    assert hidden
