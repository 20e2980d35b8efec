import json
import math

from scalpel_sim.validate.findings import Findings, Known, Line, Scene, Source
from scalpel_sim.validate.report import as_markdown, asked, figure, summary
from scalpel_sim.validate.results import Done, as_json, counts

LINES = [
    Line("|a|: good", 1.0, 0.9, 1.1, "N"),
    Line("bad", math.nan, 0.9, 1.1),
    Line("odd", 2.0, 0.9, 1.1, known=Known(1.5, 2.5, "it is a Tuesday")),
]
SCENE = Scene(
    "small",
    "A small scene",
    "It is about nothing",
    lambda quick: Findings(LINES),
    [Source("Someone 1999", "about 1"), Source("Nobody", "about 2", is_confirmed=False)],
)
DONE = [Done(SCENE, Findings(LINES, notes=["a note"]), 1.25)]


def test_lines_are_counted_by_verdict():
    assert counts(DONE) == (1, 1, 1)
    assert summary(counts(DONE)) == (
        "1 of 3 lines within their bounds, 1 known to be out of them and explained, 1 failed."
    )


def test_the_json_says_all_and_is_json():
    content = json.loads(as_json(DONE, quick=True, versions={"numpy": "2"}))
    assert content["passed"] is False
    assert content["counts"] == {"passed": 1, "known": 1, "failed": 1}
    lines = content["scenes"][0]["lines"]
    assert [line["verdict"] for line in lines] == ["pass", "FAIL", "known"]
    assert lines[1]["figure"] is None  # no number: JSON has no word for it
    assert lines[2]["why"] == "it is a Tuesday" and lines[0]["why"] == ""


def test_the_page_has_every_line_reason_picture_and_source():
    page = as_markdown(DONE, {"small": ["small.png"]}, quick=False)
    assert "| \\|a\\|: good | 1 N | 0.9 to 1.1 | pass |" in page
    assert "| bad | nan | 0.9 to 1.1 | FAIL |" in page
    assert "Known: it is a Tuesday." in page and "a note." in page
    assert "![A small scene](small.png)" in page
    assert "- Someone 1999: about 1\n" in page
    assert "- Nobody: about 2 (not looked up" in page


def test_bounds_read_as_what_is_asked():
    assert asked(Line("", 0.0, 0.0, 0.0)) == "0"
    assert asked(Line("", 0.0, 0.0, 1e-9, "N")) == "at most 1e-09"
    assert asked(Line("", 0.0, -0.005, 0.005)) == "± 0.005"
    assert asked(Line("", 0.0, -1.0, math.inf)) == "at least -1"
    assert figure(Line("", 0.123456, 0.0, 1.0, "N m")) == "0.1235 N m"
