"""Rows of methods, options of the relaxation, and messages that refuse impossible ones."""

import re
from dataclasses import replace
from pathlib import Path

import pytest

from tests.support.materials import SPRINGS
from tissue import LAWS, Hierarchical, Material, Verlet
from tissue.integrators.methods import METHODS, Global, checked_relaxation, method_of

DOCUMENT = Path(__file__).parents[3] / "docs" / "integrators.md"


def test_kernels_find_a_method_by_its_place():
    assert [method.number for method in METHODS.values()] == list(range(len(METHODS)))


@pytest.mark.parametrize("name", METHODS)
def test_the_table_of_the_document_has_the_numbers_of_each_method(name):
    row = re.search(rf"^\| `{name}` \|(.*)\|$", DOCUMENT.read_text(), re.MULTILINE)
    method = METHODS[name]
    cells = [cell.strip() for cell in row[1].split("|")]
    damping = "between steps" if method.damps_between_steps else "in every stage"
    numbers = [str(method.order), str(method.evaluations), f"{method.limit:.2f}"]
    assert cells == [*numbers, f"{method.safety:.2f}", f"{method.safety_stiffening:.2f}", damping]


@pytest.mark.parametrize(
    ("choice", "law", "name"),
    [
        (Global(), "springs", "runge_kutta"),
        (Global(), "neo_hookean", "nystroem"),
        (Global(damping="step"), "springs", "nystroem"),
        (Global(damping="stage"), "neo_hookean", "runge_kutta"),
        (Verlet(), "springs", "verlet"),
        (Hierarchical(), "springs", "runge_kutta"),
    ],
)
def test_a_choice_and_a_law_stand_for_one_method(choice, law, name):
    assert method_of(choice, LAWS[law]()) is METHODS[name]


@pytest.mark.parametrize(
    ("name", "settings"),
    [
        ("global", Global()),
        ("verlet", Verlet()),
        ("hierarchical", Hierarchical()),
        ("paper", Hierarchical(updates=64, rings=5, far="frozen")),
    ],
)
def test_a_name_stands_for_the_default_settings(name, settings):
    assert checked_relaxation(name, SPRINGS) == settings


def test_settings_are_used_unchanged():
    chosen = Hierarchical(updates=16, rings=2, far="frozen")
    assert checked_relaxation(chosen, SPRINGS) is chosen


@pytest.mark.parametrize(
    ("choice", "message"),
    [("fast", "no relaxation is called 'fast'. Known: global"), (3, "relaxation is 3")],
)
def test_an_unknown_choice_is_refused(choice, message):
    with pytest.raises(ValueError, match=message):
        checked_relaxation(choice, Material())


@pytest.mark.parametrize(
    "stiffening", [{"law": "exponential", "stiffening": 15.0}, {"law": "yeoh", "yeoh_second": 2.0}]
)
def test_verlet_is_not_for_tissue_that_stiffens(stiffening):
    material = Material(poisson_ratio=0.45, **stiffening)
    with pytest.raises(ValueError, match=r"gains energy under law .* Choose relaxation global"):
        checked_relaxation("verlet", material)
    assert checked_relaxation("global", material) == Global()


@pytest.mark.parametrize(
    "material", [Material(poisson_ratio=0.4), replace(SPRINGS, poisson_ratio=0.4)]
)
def test_the_hierarchy_is_for_springs_alone(material):
    with pytest.raises(ValueError, match="on its springs alone"):
        checked_relaxation("hierarchical", material)
    assert checked_relaxation("verlet", material) == Verlet()


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"updates": 16, "rings": 6}, "must be a multiple of 64"),
        ({"updates": 0}, "updates is 0"),
        ({"rings": -1}, "rings is -1"),
        ({"far": "away"}, "far is 'away'; it must be one of moved, frozen"),
    ],
)
def test_impossible_hierarchical_settings_are_refused(settings, message):
    with pytest.raises(ValueError, match=message):
        Hierarchical(**settings)
