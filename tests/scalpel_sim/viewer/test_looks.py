"""How a page draws the tissue, and the picture that it saves: in the replay of a cut block."""

import io
import itertools
import re

import matplotlib
import numpy as np
import pytest
from PIL import Image

from scalpel_sim.viewer.messages import SceneState
from scalpel_sim.viewer.model_shapes import body_poses
from scalpel_sim.viewer.replay import ReplayWriter
from tests.scalpel_sim.little_arm import FRAME, little_arm, readings
from tests.scalpel_sim.real_cut import cut_tissue
from tests.support.browser import UNTIL_DRAWN, WINDOW, local_file, new_tab, pixels_of

pytestmark = pytest.mark.browser

SHADE = 0.02
"""Largest error of a colour that is read between two of the seventeen of the page, of 1."""

SHOW_PANELS = "(on) => { element('overlay').style.visibility = on ? 'visible' : 'hidden'; }"

FROM_ABOVE = """() => {
    viewer.controls.target.set(0, 0.07, 0);
    viewer.camera.position.set(0, 0.25, 0.001);
    viewer.controls.update();
    setContacts(false);
    viewer.set_property(["bodies"], "visible", false);
}"""


@pytest.fixture(scope="module")
def shared_tab(browser, tmp_path_factory):
    path = tmp_path_factory.mktemp("looks") / "replay.html"
    model, data = little_arm()
    replay = ReplayWriter(model, title="block: a <cut>", frame=FRAME)
    for time, surface, stress in ((0.0, cut_tissue()[0], 700.0), (1.25, cut_tissue()[2], 300.0)):
        values = {"stress": np.full(len(surface.positions), stress)}
        replay.add(time, SceneState(surface, body_poses(data), readings(time), None, values))
    replay.write(path)
    tab = new_tab(browser)
    tab.goto(local_file(path))
    tab.wait_for_function("typeof player !== 'undefined' && player.shown >= 0")
    tab.evaluate("player.pause(), player.seek(player.length)")
    assert not tab.evaluate("element('display').open"), "the screen is small"
    tab.click("#display summary")
    tab.wait_for_function("sceneView.appearances.get('skin').map.image")
    yield tab
    assert tab.failures == []
    tab.close()


@pytest.fixture
def tab(shared_tab):
    """A tab that shows the block after the cut, as at first."""
    shared_tab.evaluate("setShown('faces'), setQuantity(''), setWireframe(false), chooseCamera(0)")
    shared_tab.evaluate("player.seek(player.length), setContacts(true)")
    shared_tab.evaluate("viewer.set_property(['bodies'], 'visible', true)")
    shared_tab.evaluate("document.activeElement.blur()")
    shared_tab.evaluate(SHOW_PANELS, True)
    shared_tab.wait_for_function("viewer.renderer.domElement.width === innerWidth")
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


def test_colours_are_those_of_viridis_on_a_scale_for_the_whole_run(tab):
    tab.select_option("#quantity", "stress")
    assert tab.inner_text("#scale-title") == "stress, von Mises [kPa]"
    assert tab.inner_text("#scale-ticks").split("\n") == ["0", "0.5", "\u2265 1"]
    tab.evaluate(FROM_ABOVE)
    tab.evaluate(SHOW_PANELS, False)
    for seek, share in (("player.length", 0.3), ("0", 0.7)):
        tab.evaluate(f"player.seek({seek})")
        expected = 255.0 * np.array(matplotlib.colormaps["viridis"](share)[:3])
        assert np.median(pixels_of(tab, "tissue/skin"), axis=0) == pytest.approx(expected, abs=4)
    tab.evaluate(SHOW_PANELS, True)
    assert tab.inner_text("#scale-ticks").split("\n") == ["0", "0.5", "\u2265 1"]
    tab.select_option("#quantity", "")
    assert tab.is_hidden("#scale")
    tab.evaluate(SHOW_PANELS, False)
    red, green, blue = np.median(pixels_of(tab, "tissue/skin"), axis=0)
    assert red > green and red > blue


def test_a_table_of_the_page_is_the_viridis_of_matplotlib(tab):
    shares = np.linspace(0.0, 1.0, 101)
    colours = tab.evaluate("(shares) => shares.map((share) => viridis(share))", shares.tolist())
    assert np.abs(colours - matplotlib.colormaps["viridis"](shares)[:, :3]).max() < SHADE


def test_a_key_goes_through_the_quantities_and_one_that_is_missing_is_named(tab):
    chosen = []
    for _ in range(4):
        tab.keyboard.press("q")
        chosen.append((tab.input_value("#quantity"), tab.evaluate("sceneView.colours.isThere")))
    assert chosen == [("displacement", False), ("strain", False), ("stress", True), ("", False)]
    tab.keyboard.press("q")
    assert tab.inner_text("#scale-title") == "displacement [mm]: not in this picture yet"


@pytest.mark.parametrize("size", [(1280, 800), (390, 844), (844, 390), (700, 600)])
def test_no_panels_overlap_on_a_wide_a_narrow_and_a_low_screen(tab, size):
    width, height = size
    tab.select_option("#quantity", "stress")
    tab.set_viewport_size({"width": width, "height": height})
    boxes = [
        tab.locator(each).bounding_box() for each in ("header", "#readings", "#looks", "footer")
    ]
    controls = "#looks select, #looks button, #scale-ticks span"
    inside = [each.bounding_box() for each in tab.locator(controls).all()]
    tab.set_viewport_size(WINDOW)
    for box in boxes + inside:
        assert box["x"] >= 0 and box["x"] + box["width"] <= width
        assert box["y"] >= 0 and box["y"] + box["height"] <= height
    for group in (boxes, inside):
        assert not any(overlap(a, b) for a, b in itertools.combinations(group, 2))


def overlap(a, b):
    return all(
        a[start] < b[start] + b[length] and b[start] < a[start] + a[length]
        for start, length in (("x", "width"), ("y", "height"))
    )


def test_texts_have_the_contrast_that_wcag_asks_for_on_any_scene_behind_them(tab):
    tab.select_option("#quantity", "stress")
    panel = rgba(tab, "#looks", "backgroundColor")
    for behind in (0.0, 255.0):
        backdrop = panel[3] * panel[:3] + (1.0 - panel[3]) * behind
        for text in ("#looks", "#scale-title", "#scale-ticks"):
            assert contrast(rgba(tab, text, "color")[:3], backdrop) >= 4.5
    for control in ("#shown", "#quantity", "#save-picture"):
        on = rgba(tab, control, "backgroundColor")[:3]
        assert contrast(rgba(tab, control, "color")[:3], on) >= 4.5


def rgba(tab, selector, name):
    """Return a computed colour: red, green and blue from 0 to 255, and opacity."""
    text = tab.eval_on_selector(selector, f"(e) => getComputedStyle(e).{name}")
    numbers = [float(number) for number in re.findall(r"[\d.]+", text)]
    return np.array([*numbers, 1.0][:4])


def contrast(a, b):
    """Return the contrast of two colours as WCAG 2 defines it."""

    def luminance(colour):
        shares = colour / 255.0
        linear = np.where(shares <= 0.04045, shares / 12.92, ((shares + 0.055) / 1.055) ** 2.4)
        return float(linear @ [0.2126, 0.7152, 0.0722])

    low, high = sorted((luminance(a), luminance(b)))
    return (high + 0.05) / (low + 0.05)


def test_the_controls_have_labels_and_are_reached_in_order_by_the_tab_key(tab):
    for name, role in (("show", "combobox"), ("colour", "combobox"), ("save picture", "button")):
        assert tab.get_by_role(role, name=name, exact=True).count() == 1
    tab.focus("#shown")
    reached = []
    for _ in range(3):
        tab.keyboard.press("Tab")
        reached.append(tab.evaluate("document.activeElement.id"))
    assert reached == ["quantity", "save-picture", "play"]
    tab.evaluate("document.activeElement.blur()")


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
    tab.evaluate("element('overlay').hidden = true")
    tab.evaluate(
        "document.head.insertAdjacentHTML('beforeend', '<style id=bare>*[hidden], "
        "#scene-tree { display: none !important }</style>')"
    )
    tab.evaluate(UNTIL_DRAWN)
    screen = np.asarray(Image.open(io.BytesIO(tab.screenshot())).convert("RGB"), dtype=int)
    tab.evaluate("element('overlay').hidden = false")
    tab.evaluate("element('bare').remove()")
    differs = np.abs(picture - screen).max(axis=2) > 24
    texts = np.zeros_like(differs)
    texts[:70] = texts[-230:, :380] = True  # where the heading and the readings are
    assert differs[~texts].mean() < 0.01, "the scene is that of the screen"
    assert differs[:70].any() and differs[-230:, :380].any()


def test_the_scale_is_in_the_picture(tab):
    def corner():
        with tab.expect_download() as download:
            tab.click("#save-picture")
        return saved(download.value)[-100:, -260:].reshape(-1, 3)

    tab.select_option("#quantity", "stress")
    yellow, violet = [
        255.0 * np.array(matplotlib.colormaps["viridis"](end)[:3]) for end in (1.0, 0.0)
    ]
    pixels = corner()
    for colour in (yellow, violet):
        assert np.abs(pixels - colour).max(axis=1).min() <= 4
    tab.select_option("#quantity", "")
    assert np.abs(corner() - yellow).max(axis=1).min() > 40


def saved(download):
    """Return a downloaded picture: red, green and blue from 0 to 255."""
    return np.asarray(Image.open(download.path()).convert("RGB"), dtype=int)
