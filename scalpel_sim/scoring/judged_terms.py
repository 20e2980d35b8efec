"""The terms of a score in words and in units that people read, the same for page and report."""

from collections.abc import Callable, Collection, Iterator, Mapping
from typing import Any, NamedTuple

_MM, _MM2, _MM3, _MJ = 1e3, 1e6, 1e9, 1e3


class JudgedTerm(NamedTuple):
    """A term of a score."""

    name: str
    """Name for a person."""
    meaning: str
    """Meaning of the figure, in a sentence."""
    figure: str
    """Figure with its unit."""
    wanted: str = ""
    """Figure that was asked for; empty: none was."""
    is_met: bool | None = None
    """Whether it is as was asked for; None: nothing was."""


class _Text(NamedTuple):
    """Words for a term."""

    name: str
    meaning: str
    """Has {tolerance} for the distance that counts as on the plan [mm]."""
    figure: Callable[[float], str]
    is_least: bool = False
    """Whether at least so much is asked for; else at most."""


def _share(value: float) -> str:
    return f"{value:.0%}"


def _millimetres(value: float) -> str:
    return f"{_MM * value:.2f} mm"


def _area(value: float) -> str:
    return f"{_MM2 * value:.0f} mm\u00b2"


def _volume(value: float) -> str:
    return f"{_MM3 * value:.0f} mm\u00b3"


def _newtons(value: float) -> str:
    return f"{value:.2f} N"


_TEXTS = {
    "covered": _Text(
        "Planned cut that is open",
        "Share of it that was cut, within {tolerance:g} mm of where it was planned.",
        _share,
        is_least=True,
    ),
    "off_plan": _Text(
        "Cut beside the plan",
        "Area of cut farther than {tolerance:g} mm from the plan: it was to stay whole.",
        _area,
    ),
    "path_error": _Text(
        "Distance from the plan",
        "How far the cut lies from the plan on average (root mean square).",
        _millimetres,
    ),
    "depth_error": _Text(
        "Error of depth",
        "By how much the cut is too deep or too shallow on average, along the line.",
        _millimetres,
    ),
    "spared": _Text(
        "Spared what was to be spared",
        "Whether these parts are whole, and no cut came within their margin.",
        lambda value: "yes" if value else "no",
        is_least=True,
    ),
    "force": _Text("Largest force", "Of the tissue on any instrument, at any instant.", _newtons),
    "strain_above": _Text(
        "Tissue stretched too far",
        "Volume of tissue that was stretched beyond its limit at any time.",
        _volume,
    ),
    "held": _Text(
        "Cut in held tissue",
        "Share of the cut that was made while every grasper held tissue.",
        _share,
        is_least=True,
    ),
    "removed": _Text(
        "Target cut out", "Share of the target that came away.", _share, is_least=True
    ),
    "healthy": _Text("Other tissue cut out", "What came away with the target.", _volume),
    "exposed": _Text("Target in view", "Share of it that the camera sees.", _share, is_least=True),
    "time": _Text("Time", "Simulated time, from the start.", lambda value: f"{value:.2f} s"),
    "path_length": _Text(
        "Way of the instruments",
        "How far all of them have moved in all.",
        lambda value: f"{_MM * value:.0f} mm",
    ),
    "work": _Text(
        "Work of the blade",
        "Energy that the blade gave to the tissue: to part, bend and rub it.",
        lambda value: f"{_MJ * value:.1f} mJ",
    ),
}
"""Terms in the order in which they are told."""

_AT_THE_END = ("force", "time", "path_length", "work")
"""Terms that are told once a run has ended, unless they were asked for."""


def judged_terms(score: Mapping[str, Any], *, briefly: bool = False) -> list[JudgedTerm]:
    """Return the terms of a score that are known, those that were asked for first.

    Args:
        score: As `Score.figures` returns it.
        briefly: Whether to leave out what a page shows already, or nobody reads meanwhile.
    """
    found = list(_told(score, _AT_THE_END if briefly else ()))
    return sorted(found, key=lambda term: term.is_met is None)


def _told(score: Mapping[str, Any], without: Collection[str]) -> Iterator[JudgedTerm]:
    """Yield the terms in the order of `_TEXTS`, some left out that were not asked for."""
    terms, asked, failed = score["terms"], score["asked"], score["failed"]
    for key, text in _TEXTS.items():
        if key not in asked and (key not in terms or key in without):
            continue
        figure = text.figure(terms[key]) if key in terms else "not known"
        meaning = text.meaning.format(tolerance=_MM * score["tolerance_m"])
        if key not in asked:
            yield JudgedTerm(text.name, meaning, figure)
            continue
        bound = text.figure(asked[key])
        if key != "spared":
            bound += " or more" if text.is_least else " or less"
        yield JudgedTerm(text.name, meaning, figure, bound, key in terms and key not in failed)
