import json
import math

from scalpel_sim.validate.findings import (
    PUBLISHED,
    REGRESSION,
    THEORY,
    Check,
    Findings,
    KnownDeviation,
    Reference,
    ValidationScene,
)
from scalpel_sim.validate.report import (
    SceneRun,
    bounds_text,
    count_verdicts,
    validation_as_json,
    validation_page,
    value_text,
    verdict_sentence,
)

CHECKS = [
    Check("|a|: good", 1.0, 0.9, 1.1, basis=THEORY, unit="N"),
    Check("bad", math.nan, 0.9, 1.1, basis=REGRESSION),
    Check("odd", 2.0, 0.9, 1.1, basis=PUBLISHED, known=KnownDeviation(2.0, "it is a Tuesday")),
]
SCENE = ValidationScene(
    "small",
    "A small scene",
    "It is about nothing",
    lambda quick: Findings(CHECKS),
    [Reference("Someone 1999", "about 1"), Reference("Nobody", "about 2", is_confirmed=False)],
)
RUNS = [SceneRun(SCENE, Findings(CHECKS, notes=["a note"]), 1.25)]


def test_checks_are_counted_by_verdict():
    assert count_verdicts(RUNS) == (1, 1, 1)
    assert verdict_sentence(count_verdicts(RUNS)) == (
        "1 of 3 checks are within their bounds, 1 known, 1 failed."
    )


def test_the_json_is_valid_and_complete():
    content = json.loads(validation_as_json(RUNS, quick=True, versions={"numpy": "2"}))
    assert content["passed"] is False
    assert content["counts"] == {"passed": 1, "known": 1, "failed": 1}
    lines = content["scenes"][0]["lines"]
    assert [line["verdict"] for line in lines] == ["pass", "FAIL", "known"]
    assert lines[1]["figure"] is None  # not a number, which JSON cannot express
    assert [line["basis"] for line in lines] == ["theory", "regression", "published"]
    assert lines[2]["why"] == "it is a Tuesday" and lines[0]["why"] == ""


def test_the_page_has_every_check_reason_picture_and_source():
    page = validation_page(RUNS, {"small": ["small.png"]}, quick=False)
    assert "| \\|a\\|: good | 1 N | 0.9 to 1.1 | theory | pass |" in page
    assert "| bad | nan | 0.9 to 1.1 | regression | FAIL |" in page
    assert "theory: 1 of 1 pass; published: 0 of 1 pass; regression: 0 of 1 pass." in page
    assert "Known: it is a Tuesday." in page and "a note." in page
    assert "![A small scene](small.png)" in page
    assert "- Someone 1999: about 1\n" in page
    assert "- Nobody: about 2 (not looked up: an estimate)" in page


def test_bounds_read_as_words():
    assert bounds_text(Check("", 0.0, 0.0, 0.0, basis=THEORY)) == "0"
    assert bounds_text(Check("", 0.0, 0.0, 1e-9, basis=THEORY, unit="N")) == "at most 1e-09"
    assert bounds_text(Check("", 0.0, -0.005, 0.005, basis=THEORY)) == "± 0.005"
    assert bounds_text(Check("", 0.0, -1.0, math.inf, basis=THEORY)) == "at least -1"
    assert value_text(Check("", 0.123456, 0.0, 1.0, basis=THEORY, unit="N m")) == "0.1235 N m"
