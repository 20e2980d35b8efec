"""A visitor leads the blade in the live page, and a run repeats what was done."""

import json
import time

import numpy as np
import pytest

from scalpel_sim.runs.file_names import SUMMARY
from tests.scalpel_sim.hands.driven_view import DrivenView
from tests.support.browser import new_tab

pytestmark = pytest.mark.end_to_end

STEPS_OF_DRAG = 15
"""Moves of the mouse in a drag."""

PAUSE = 0.03
"""Between two of them [s]."""

LONGEST_LAG = 30.0
"""Time in which a picture shows what was done on a machine that is very busy [s]."""

HOLD_STICK = """([x, y, isPressed]) => {
    const buttons = Array.from({ length: 17 }, (_, i) => ({ pressed: i === 0 && isPressed }));
    const pad = { connected: true, axes: [x, y, 0, 0], buttons };
    navigator.getGamepads = () => [pad, null, null, null];
}"""

HANG = """(ms) => {
    const end = performance.now() + ms;
    while (performance.now() < end);
}"""

LAID_BARE = """() => {
    const { x, y, width, height } = viewer.renderer.domElement.getBoundingClientRect();
    return [x + 0.5 * width, y + 0.45 * height];
}"""


@pytest.fixture
def view(tmp_path, request, browser):
    with DrivenView(request.param, tmp_path / "led") as led:
        yield led
    for context in browser.contexts:
        context.close()


def opened(browser, view, leads=True):
    """Return a tab that shows the start, and that leads the blade or does not."""
    tab = new_tab(browser)
    tab.goto(view.url)
    is_told = "run.leads" if leads else "run.socket !== null"
    tab.wait_for_function(f"hand.tip !== null && {is_told}")
    return tab


def drag(tab, right, down, button="left", key=None, hangs=0.0):
    """Drag by so many pixels, without haste, while a key is pressed.

    Half-way the page hangs for so many seconds.

    Let go once the picture shows all that was asked: on a busy machine the tissue is behind, and a
    blade that is let go stops where it is.
    """
    x, y = tab.evaluate(LAID_BARE)
    tab.mouse.move(x, y)
    if key is not None:
        tab.keyboard.down(key)
    tab.mouse.down(button=button)
    for i in range(1, STEPS_OF_DRAG + 1):
        tab.mouse.move(x + right * i / STEPS_OF_DRAG, y + down * i / STEPS_OF_DRAG)
        time.sleep(PAUSE)
        if hangs and i == STEPS_OF_DRAG // 2:
            tab.evaluate(HANG, 1e3 * hangs)
    until_the_tip_rests(tab)
    tab.mouse.up(button=button)
    if key is not None:
        tab.keyboard.up(key)


def tip(tab):
    """Return where the tip is led in the picture [m], world frame."""
    return np.array(tab.evaluate("hand.tip"))


def until_it_rests(tab):
    """Wait until nothing leads the blade, and it no longer moves."""
    tab.wait_for_function("!hand.isEngaged")
    until_the_tip_rests(tab)


def until_the_tip_rests(tab):
    """Wait until the picture shows all that was asked, and the blade in it no longer moves."""
    tab.wait_for_function("hand.unshown.length === 0")
    before = None
    while before is None or not np.array_equal(before, tip(tab)):
        before = tip(tab)
        time.sleep(0.5)


def eye_at_rest(tab):
    """Wait until the view no longer turns, and return where it is seen from [m]."""
    eye = "viewer.camera.position.toArray()"
    before, now = None, tab.evaluate(eye)
    while now != before:
        time.sleep(0.5)
        before, now = now, tab.evaluate(eye)
    return now


def end(tab, view):
    """End the run in the page, and wait for its files."""
    tab.click("#end")
    tab.wait_for_function("hand.hasEnded")
    view.wait_for_files()
    assert tab.failures == []


def pieces(view):
    return json.loads((view.folder / SUMMARY).read_text())["pieces"]


@pytest.mark.browser
@pytest.mark.parametrize("view", ["grid2"], indirect=True)
def test_the_view_is_turned_by_the_right_button_by_ctrl_and_with_the_clutch_open(view, browser):
    tab = opened(browser, view)

    def turns(action):
        before = eye_at_rest(tab)
        action()
        return not np.allclose(before, eye_at_rest(tab))

    assert turns(lambda: drag(tab, 60, 0, button="right"))
    assert turns(lambda: drag(tab, 60, 0, key="Control"))
    assert not turns(lambda: drag(tab, 5, 0))
    tab.click("#clutch")
    assert turns(lambda: drag(tab, 60, 0))
    assert tab.failures == []


@pytest.mark.browser
@pytest.mark.parametrize("view", ["grid2"], indirect=True)
def test_a_gamepad_keys_and_wheel_lead_the_blade_and_the_clutch_holds_it(view, browser):
    tab, other = opened(browser, view), opened(browser, view, leads=False)
    at_first = tip(tab)

    def moves(action, least):
        before, patience = tip(tab), time.monotonic() + LONGEST_LAG
        while True:
            action()
            until_it_rests(tab)
            has_moved = np.linalg.norm(tip(tab) - before) > least
            # A step is let go after a while: on a slow machine the blade is then not there yet.
            if has_moved or least == 0.0 or time.monotonic() > patience:
                return has_moved

    def press(key, n):
        for _ in range(n):
            tab.keyboard.press(key)

    def tilt_stick(is_pressed):
        tab.evaluate(HOLD_STICK, [0.0, -1.0, is_pressed])
        time.sleep(1.0)
        tab.evaluate(HOLD_STICK, [0.0, 0.0, False])

    tab.mouse.move(*tab.evaluate(LAID_BARE))
    assert moves(lambda: press("ArrowUp", 4), 1e-3)
    assert moves(lambda: tab.mouse.wheel(0, -200), 1e-3)
    assert moves(lambda: tilt_stick(False), 1e-3)
    assert not moves(lambda: tilt_stick(True), 0.0)
    assert moves(lambda: drag(tab, 60, 0, key="Shift"), 1e-3)
    assert not moves(lambda: drag(tab, 60, 0, button="right"), 0.0)
    press(" ", 1)
    assert tab.get_attribute("#clutch", "aria-pressed") == "false"
    assert not moves(lambda: press("ArrowUp", 4), 0.0)
    press(" ", 1)

    assert not other.evaluate("run.leads")
    assert other.inner_text("#hint") == "Another tab leads the blade."
    tab.close()
    other.click("#take-over")
    other.wait_for_function("run.leads")
    tab = other
    assert moves(lambda: press("ArrowUp", 4), 1e-3)
    assert np.linalg.norm(tip(tab) - at_first) > 3e-3
    end(tab, view)


@pytest.mark.browser
@pytest.mark.parametrize("view", ["grid2"], indirect=True)
def test_a_run_that_waits_is_paused_or_has_ended_shows_what_is_asked_for(view, browser):
    tab = opened(browser, view)
    tab.click("#display summary")
    tab.select_option("#quantity", "displacement")
    tab.wait_for_function("sceneView.colours.isThere")
    tab.select_option("#quantity", "stress")
    tab.wait_for_function("sceneView.colours.isThere")
    tab.evaluate("document.activeElement.blur()")
    tab.keyboard.press("ArrowUp")
    until_it_rests(tab)
    assert tab.evaluate("sceneView.colours.isThere")
    tab.click("#pause")
    tab.wait_for_function("run.isPaused")
    tab.select_option("#quantity", "displacement")
    tab.wait_for_function("sceneView.colours.isThere")
    end(tab, view)
    tab.select_option("#quantity", "strain")
    tab.wait_for_function("sceneView.colours.isThere")
    assert tab.inner_text("#scale-title") == "strain, largest principal"
    assert tab.failures == []
