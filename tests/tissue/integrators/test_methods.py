"""Options of the relaxation, and the messages that refuse impossible ones."""

from dataclasses import replace

import pytest

from tests.support.materials import SPRINGS
from tissue import Hierarchical, Material, Verlet
from tissue.integrators.methods import Global, checked_relaxation


@pytest.mark.parametrize(
    ("name", "settings"),
    [("global", Global()), ("verlet", Verlet()), ("hierarchical", Hierarchical())],
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
