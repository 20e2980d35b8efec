"""A visitor draws a line on the tissue in the live page, and the script cuts along it."""

import json

import numpy as np
import pytest

from scalpel_sim import SCENES, read_scene
from scalpel_sim.runs.file_names import SCENE, SUMMARY
from scalpel_sim.strokes.skin import BodySkin
from tests.scalpel_sim.hands.driven_view import DrivenView, LiveView, assert_a_run_repeats
from tests.support.browser import new_tab

pytestmark = pytest.mark.end_to_end

FOUND = """places => {
    const { camera, renderer } = viewer, { skin } = drawing;
    const { left, top, width, height } = renderer.domElement.getBoundingClientRect();
    return places.map((near) => {
        const place = skin.at(near, [0, 0, -1]);
        const at = new THREE.Vector3(...skin.now(place)).applyMatrix4(skin.matrix).project(camera);
        return [skin.rest(place), [left + (at.x + 1) / 2 * width, top + (1 - at.y) / 2 * height]];
    });
}"""
"""Returns where vertical lines enter the body at rest [m], and where in the window that is now."""

DEPTH_OF_SHEET = """() => {
    const at = drawing.sheet.geometry.attributes.position, [top, bottom] = [0, 1].map(
        (k) => new THREE.Vector3().fromBufferAttribute(at, k));
    return top.distanceTo(bottom);
}"""
"""Returns how deep the sheet hangs from the first point of the line [m]."""

CORNERS = [(0.02, 0.012, 0.04), (0.026, 0.03, 0.04), (0.02, 0.048, 0.04)]
"""Places on the upper side of the slab [m]."""

WIDE = {"width": 700, "height": 600}
"""A window in which the panels leave the body free [pixels]."""

NARROW = {"width": 390, "height": 780}
"""A telephone [pixels]."""

A_PIXEL = 3e-4
"""Size of a pixel of the window on the slab, about [m]."""


def begin_to_draw(tab):
    tab.wait_for_function("run.leads && sceneView.tissue.size > 0")
    tab.click("#draw-mode")
    tab.wait_for_selector("#draw-cut")


def found(tab, near):
    """Return places of the skin at rest [m], and where they are in the window."""
    return zip(*tab.evaluate(FOUND, [list(each) for each in near]), strict=True)


@pytest.mark.browser
def test_the_script_cuts_along_the_line_that_was_clicked_and_the_run_repeats(tmp_path, browser):
    with LiveView("slab", tmp_path / "out", "--seconds", "1000") as view:
        tab = new_tab(browser)
        tab.set_viewport_size(WIDE)
        tab.goto(view.url)
        begin_to_draw(tab)
        tab.click("#pause")
        tab.wait_for_function("run.isPaused")
        for corner in CORNERS:
            _, (at,) = found(tab, [corner])
            tab.mouse.click(*at)
        line = tab.evaluate("drawing.line")
        np.testing.assert_allclose(line["points"], CORNERS, atol=A_PIXEL)
        np.testing.assert_allclose(line["edge"], [0.0, 0.0, 1.0], atol=1e-3)
        assert "mm deep" in tab.inner_text("#draw-hint")
        tab.fill("#draw-depth", "4")
        assert tab.evaluate(DEPTH_OF_SHEET) == pytest.approx(4e-3, abs=1e-6)
        tab.click("#draw-cut")
        tab.wait_for_function("CHOICES.lines.length === 1")
        assert tab.evaluate("CHOICES.lines[0].points") == line["points"], "it is drawn again"
        tab.wait_for_selector("#results")
        assert "planned cut that is open" in tab.inner_text("#score")
        assert tab.evaluate("planLine.isOpen.filter((each) => each).length") > 20, "of some 37 mm"
        tab.close()
        assert tab.failures == []
    (stroke,) = read_scene(tmp_path / "out-2" / SCENE).strokes
    assert stroke.kind == "traced" and stroke.depth == 4e-3
    assert [list(point) for point in stroke.points] == line["points"]
    assert json.loads((tmp_path / "out-2" / SUMMARY).read_text())["score"]["terms"]["covered"] > 0.9
    assert_a_run_repeats(tmp_path / "out-2", tmp_path / "again")


@pytest.mark.browser
def test_a_line_is_drawn_by_a_drag_and_by_keys_and_points_are_taken_back(tmp_path, browser):
    with DrivenView("organ", tmp_path / "out") as view:
        tab = new_tab(browser)
        tab.set_viewport_size(NARROW)
        tab.goto(view.url)
        button = tab.locator("#draw-mode").bounding_box()
        assert button["x"] + button["width"] < NARROW["width"], "it is in reach of a thumb"
        tab.set_viewport_size(WIDE)
        begin_to_draw(tab)
        assert not tab.evaluate("hand.isClosed"), "a press draws, and does not lead the blade"
        near = [[0.03, 0.025, 0.04], [0.05, 0.03, 0.0], [0.065, 0.028, 0.02]]
        at_rest, (start, between, end) = found(tab, near)
        np.testing.assert_allclose(at_rest, places_of_the_skin("organ", near), atol=1e-7)
        tab.mouse.move(*start)
        tab.mouse.down()
        tab.mouse.move(*end, steps=30)
        tab.mouse.up()
        assert tab.evaluate("drawing.points.length") > 5
        tab.keyboard.press("ArrowUp")
        tab.keyboard.press("Backspace")
        assert tab.evaluate("drawing.points.length") == 0, "a drag is taken back as one"
        assert tab.is_disabled("#draw-cut")
        tab.evaluate("cursor => { drawing.cursor = cursor; }", between)
        tab.keyboard.press("Enter")
        drawn = tab.evaluate("drawing.points[0].rest")
        np.testing.assert_allclose(drawn, at_rest[1], atol=2 * A_PIXEL)
        tab.keyboard.press("Escape")
        assert tab.evaluate("hand.isClosed && !run.isDrawing")
        tab.close()
        assert tab.failures == []


def places_of_the_skin(scene, near):
    """Where vertical lines enter the body of a scene, as a run finds it [m]."""
    skin = BodySkin.of(SCENES[scene].mesh())
    down = np.array([0.0, 0.0, -1.0])
    return [skin.rest_place(skin.entered_at(np.array(at), down)) for at in near]
