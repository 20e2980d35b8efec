"""A visitor stops the time of a run in the live page, slows it down, and goes back."""

import json
from pathlib import Path

import numpy as np
import pytest

from scalpel_sim.hands.commands import LONGEST_SILENCE
from scalpel_sim.runs.file_names import REPLAY, REPORT, SUMMARY
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
        tab.close()
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
def test_the_force_of_each_frame_reaches_the_plot_also_where_pictures_are_few(scripted):
    tab = scripted
    tab.wait_for_function(f"{TIME} > 0.2")
    times = tab.evaluate("forcePlot.rows.map(([time]) => time)")
    assert len(times) > 100
    assert np.allclose(np.diff(times), 1e-3, rtol=0.0, atol=1e-9)


@pytest.mark.browser
def test_a_page_says_that_it_loads_until_the_tissue_is_drawn(scripted):
    document = scripted.evaluate("fetch('/').then((answer) => answer.text())")
    assert '<p id="loading" role="status">' in document
    scripted.wait_for_function("sceneView.tissue.size > 0")
    scripted.wait_for_selector("#loading", state="hidden")


@pytest.mark.browser
def test_a_run_that_has_ended_shows_its_results_gives_its_replay_and_is_done_again(
    tmp_path, browser
):
    with LiveView("grid2", tmp_path / "out", "--seconds", "0.2") as view:
        tab = new_tab(browser)
        tab.set_viewport_size({"width": 700, "height": 600})
        tab.goto(view.url)
        tab.wait_for_selector("#results")
        labels, values = (
            tab.locator(f"#figures {each}").all_inner_texts() for each in ("dt", "dd")
        )
        figures = dict(zip(labels, values, strict=True))
        summary = json.loads((view.folder / SUMMARY).read_text())
        assert figures["force, peak"] == f"{summary['force_peak_n']:.2f} N"
        assert figures["pieces"] == str(summary["pieces"])
        assert tab.inner_text("#folder") == str(view.folder)
        with tab.expect_download() as download:
            tab.click("#save-replay")
        assert download.value.suggested_filename == "grid2-straight-stroke-replay.html"
        assert Path(download.value.path()).read_bytes() == (view.folder / REPLAY).read_bytes()
        with tab.expect_download() as download:
            tab.click("#save-report")
        assert download.value.suggested_filename == "grid2-straight-stroke-report.html"
        assert Path(download.value.path()).read_bytes() == (view.folder / REPORT).read_bytes()
        assert tab.evaluate("fetch('/report?token=no').then((answer) => answer.status)") == 403
        with tab.expect_popup() as opened:
            tab.click("#open-replay")
        opened.value.wait_for_function("typeof player !== 'undefined' && player.shown >= 0")
        opened.value.close()
        policy = (
            "fetch(`/replay${run.query}`).then((a) => a.headers.get('Content-Security-Policy'))"
        )
        assert "sandbox allow-scripts" in tab.evaluate(policy), "it is of no origin: it cannot lead"
        assert tab.evaluate("fetch('/replay?token=no').then((answer) => answer.status)") == 403
        assert tab.inner_text("#offers button >> nth=0") == "lead the blade yourself"
        assert tab.inner_text("#reset") == "again"
        tab.click("#reset")
        tab.wait_for_function("element('folder').textContent.endsWith('out-2')")
        tab.close()
        assert tab.failures == []


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
def test_a_stroke_in_which_the_page_hangs_is_one_and_is_undone_in_the_page(tmp_path, browser):
    with DrivenView("grid2", tmp_path / "led") as view:
        tab = new_tab(browser)
        tab.goto(view.url)
        tab.wait_for_function("hand.isClosed")
        assert tab.is_disabled("#undo")
        drag(tab, 60, 0)
        until_it_rests(tab)
        between = tip(tab)
        drag(tab, 0, 60, hangs=1.5 * LONGEST_SILENCE)
        until_it_rests(tab)
        assert not np.allclose(tip(tab), between, atol=1e-4)
        assert tab.evaluate("run.state.strokes") == 2
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
