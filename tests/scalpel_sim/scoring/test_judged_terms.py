"""Terms of a score as a person reads them."""

import pytest

from scalpel_sim.scoring.judged_terms import judged_terms

SCORE = {
    "terms": {
        "cut_area": 151e-6,
        "covered": 0.794,
        "off_plan": 28.6e-6,
        "path_error": 0.7e-3,
        "force": 0.138,
        "time": 3.2,
        "spared": 1.0,
    },
    "asked": {"covered": 0.9, "force": 0.5, "spared": 1.0, "removed": 0.95},
    "failed": ["covered"],
    "unknown": ["removed"],
    "tolerance_m": 1e-3,
}


def told(score=SCORE, **how):
    return {term.name: term for term in judged_terms(score, **how)}


def test_what_was_asked_for_comes_first_and_says_whether_it_is_met():
    terms = judged_terms(SCORE)
    assert [term.is_met for term in terms] == [False, True, True, False, None, None, None]
    covered = told()["Planned cut that is open"]
    assert (covered.figure, covered.wanted, covered.is_met) == ("79%", "90% or more", False)
    assert "within 1 mm" in covered.meaning
    force = told()["Largest force"]
    assert (force.figure, force.wanted, force.is_met) == ("0.14 N", "0.50 N or less", True)


def test_a_term_that_was_asked_for_and_is_not_known_is_missed():
    removed = told()["Target cut out"]
    assert (removed.figure, removed.is_met) == ("not known", False)


@pytest.mark.parametrize("name", ["Time"])
def test_a_page_leaves_out_what_it_shows_already(name):
    assert name in told() and name not in told(briefly=True)
    assert "Largest force" in told(briefly=True), "it was asked for"


def test_figures_are_in_units_that_people_read():
    assert told()["Cut beside the plan"].figure == "29 mm\u00b2"
    assert told()["Distance from the plan"].figure == "0.70 mm"
    assert told()["Spared what was to be spared"].figure == "yes"
