"""A visitor stops the time of a run in the live page, slows it down, and goes back."""

import numpy as np
import pytest

from tests.scalpel_sim.hands.driven_view import DrivenView, LiveView
from tests.scalpel_sim.hands.test_driven_page import drag, tip, until_it_rests
from tests.support.browser import new_tab

pytestmark = pytest.mark.end_to_end

TIME = "lastReadings?.time"
"""The simulated time that the page shows [s]."""

A_WHILE = 400
"""In which a run that goes on shows other times [ms]."""


@pytest.fixture
def scripted(tmp_path, browser):
    """A tab that shows a run that a script leads."""
    with LiveView("grid2", tmp_path / "out", "--seconds", "1000") as view:
        tab = new_tab(browser)
        tab.goto(view.url)
        tab.wait_for_function("run.leads && run.state !== null")
        yield tab
        tab.close()  # it would lead the next run at this port
        assert tab.failures == []


@pytest.mark.browser
def test_a_run_pauses_goes_on_by_steps_and_in_slow_motion(scripted):
    tab = scripted
    tab.click("#pause")
    tab.wait_for_function("run.isPaused")
    assert tab.inner_text("#pause") == "continue" and tab.inner_text("#pace") == "paused"
    before = tab.evaluate(TIME)
    tab.wait_for_timeout(A_WHILE)
    assert tab.evaluate(TIME) == before
    tab.click("#step")
    tab.wait_for_function(f"Math.abs({TIME} - {before + 0.01}) < 1e-6")
    tab.keyboard.press(".")
    tab.wait_for_function(f"Math.abs({TIME} - {before + 0.02}) < 1e-6")
    tab.select_option("#rate", "0.1")
    tab.wait_for_function("run.state.rate === 0.1")
    tab.focus("#rate")
    tab.keyboard.press("k")  # a key in a list of choices is its own
    assert tab.evaluate("run.isPaused")
    tab.focus("#step")
    tab.keyboard.press("k")
    tab.wait_for_function(f"!run.isPaused && {TIME} > {before + 0.02:.2f}")
    tab.wait_for_function("run.state.real_time < 0.11")


@pytest.mark.browser
def test_a_reset_takes_a_scripted_run_back_to_its_start(scripted):
    tab = scripted
    tab.wait_for_function(f"{TIME} > 0.1")
    tab.click("#pause")
    tab.wait_for_function("run.isPaused")
    before = tab.evaluate(TIME)
    tab.click("#reset")
    tab.wait_for_function(f"{TIME} < {before}")
    assert tab.evaluate(TIME) == 0.0 and tab.inner_text("#area") == "0 mm²"
    tab.click("#pause")
    tab.wait_for_function(f"!run.isPaused && {TIME} > 0.03")


@pytest.mark.browser
def test_a_stroke_is_undone_in_the_page(tmp_path, browser):
    with DrivenView("grid2", tmp_path / "led") as view:
        tab = new_tab(browser)
        tab.goto(view.url)
        tab.wait_for_function("hand.isClosed")
        assert tab.is_disabled("#undo")
        drag(tab, 60, 0)
        until_it_rests(tab)
        between = tip(tab)
        drag(tab, 0, 60)
        until_it_rests(tab)
        assert not np.allclose(tip(tab), between, atol=1e-4)
        tab.keyboard.press("Control+z")
        tab.wait_for_function("run.state.strokes === 1")
        assert np.allclose(tip(tab), between, atol=1e-4)
        tab.click("#undo")
        tab.wait_for_function("run.state.strokes === 0")
        assert tab.is_disabled("#undo")
        tab.close()  # it would lead the next run at this port
        assert tab.failures == []


@pytest.mark.browser
def test_the_panel_begins_a_run_with_what_was_chosen_and_a_hand_takes_over(scripted):
    tab = scripted
    tab.click("summary")
    assert tab.inner_text("#toughness-value") == "20 J/m²"
    tab.fill("#toughness", "37")
    tab.fill("#thickness", "0.3")
    assert tab.inner_text("#toughness-value") == "30 J/m²"
    tab.check("#by-hand")
    tab.click("#begin")
    tab.wait_for_function("typeof hand !== 'undefined' && hand !== null && hand.isClosed")
    assert tab.inner_text("h1") == "grid2: led by hand"
    tab.click("summary")
    assert tab.inner_text("#toughness-value") == "30 J/m²"
    assert tab.inner_text("#thickness-value") == "0.3 mm"
    assert tab.inner_text("#swap") == "watch the script"


@pytest.mark.browser
def test_what_cannot_begin_says_why(scripted):
    tab = scripted
    tab.evaluate("""run.say({ type: "begin", scene: "nowhere" })""")
    tab.wait_for_function("""element("notice").textContent.includes("nowhere")""")
    assert tab.is_visible("#notice")
