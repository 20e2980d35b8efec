"""The report of a run: what was asked for, what was measured, and what is met, on one page."""

import re
from xml.etree import ElementTree

import numpy as np
import pytest

from scalpel_sim.output.report_page import (
    ForceCurve,
    ReportPicture,
    RunReport,
    report_html,
)
from scalpel_sim.scoring.judged_terms import JudgedTerm
from tests.support.browser import local_file

TIMES = np.linspace(0.0, 2.0, 2001)
FORCES = 0.4 * np.sin(np.pi * TIMES / 2.0) ** 2
PNG = bytes.fromhex("89504e470d0a1a0a")


def report(*criteria, **changes):
    usual = RunReport(
        title="organ: <traced> stroke",
        by="By a script, 30 November 2026",
        asked=["A cut along a line of 26 mm, 6 mm deep."],
        criteria=criteria or [JudgedTerm("cut area", "What was opened.", "151 mm²")],
        pictures=[ReportPicture(PNG, "The body after the cut.")],
        force=ForceCurve(TIMES, FORCES, 0.5),
        warnings=["the cut is unfinished & short"],
        facts=[("arm", "touch")],
    )
    return report_html(usual._replace(**changes))


def judged(name, is_met):
    return JudgedTerm(name, "What it is.", "0.91", "0.95 or more", is_met)


def drawn_forces(page):
    """The corners of the curve, as times [s] and forces [N]."""
    (points,) = re.findall(r'class="curve" points="([^"]*)"', page)
    corners = np.array([pair.split(",") for pair in points.split()], float)
    svg = ElementTree.fromstring(re.search(r"<svg.*?</svg>", page, re.DOTALL).group())
    (axis,) = (each.get("d") for each in svg.iter() if each.get("class") == "axis")
    left, above, floor, right = map(float, re.findall(r"[\d.]+", axis))
    top = 1.15 * 0.5
    return 2.0 * (corners[:, 0] - left) / (right - left), top * (floor - corners[:, 1]) / (
        floor - above
    )


def test_a_run_passes_where_all_that_was_asked_for_is_met():
    page = report(judged("covered", True), judged("spared", True))
    assert "<strong>Passed.</strong>" in page and "2 of 2 criteria are met" in page


def test_a_run_that_misses_something_says_what():
    page = report(judged("Covered", True), judged("Off the plan", False))
    assert "<strong>Not passed.</strong>" in page
    assert "1 of 2 criteria are met; missed: off the plan" in page
    assert page.count("\u2713 yes") == 1 and page.count("\u2717 no") == 1


def test_a_run_that_was_to_meet_nothing_is_not_judged():
    page = report()
    assert "assed." not in page and "What was measured" in page and "asked for" not in page


def test_the_curve_is_that_of_the_forces_and_keeps_the_peak():
    spike = FORCES.copy()
    spike[777] = 0.49
    times, forces = drawn_forces(report(force=ForceCurve(TIMES, spike, 0.5)))
    assert forces.max() == pytest.approx(0.49, abs=2e-3)
    assert times[forces.argmax()] == pytest.approx(TIMES[777], abs=2e-3)
    np.testing.assert_allclose(
        forces[forces < 0.48], 0.4 * np.sin(np.pi * times[forces < 0.48] / 2.0) ** 2, atol=3e-3
    )


def test_texts_are_texts_and_nothing_is_loaded():
    page = report()
    assert "organ: &lt;traced&gt; stroke" in page and "unfinished &amp; short" in page
    assert "<script" not in page and not re.search(r'(src|href)="(?!data:)', page)
    assert "default-src 'none'" in page


def test_what_is_empty_has_no_heading():
    page = report(warnings=[], pictures=[], force=ForceCurve(np.zeros(0), np.zeros(0)))
    assert "did not go as planned" not in page and "looked like" not in page
    assert "No frame was simulated" in page


@pytest.mark.browser
def test_the_page_needs_no_sideways_scrolling_in_a_narrow_window(tmp_path, tab):
    path = tmp_path / "report.html"
    path.write_text(report(judged("Covered", True), judged("Off the plan", False)), "utf-8")
    for width in (390, 1400):
        tab.set_viewport_size({"width": width, "height": 800})
        tab.goto(local_file(path))
        assert tab.evaluate("document.documentElement.scrollWidth") <= width
