"""Findings of a scene of the validation: checks with their bounds, plots, and references."""

import math
import tomllib
from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path
from typing import Any, Literal, NamedTuple

import msgspec

from tissue import FloatArray

PASS, FAIL, KNOWN = "pass", "FAIL", "known"
"""Verdicts. `known`: the value is out of its bounds by no more than a deviation that is known and
explained."""


Basis = Literal["theory", "published", "regression", "case"]
THEORY: Basis = "theory"
PUBLISHED: Basis = "published"
REGRESSION: Basis = "regression"
CASE: Basis = "case"
"""Reference of a check. `theory`: a formula or a law of conservation that is independent of
how the engine computes the value. `published`: a figure of an experiment. `regression`: what was
put in, as the engine's own law of it says: it shows that the engine does what it is told, and not
that tissue does so. `case`: what the file of a case expects."""

_SECTIONS = Path(__file__).with_name("sections.toml")
LARGEST_KNOWN = 0.02
"""Distance of the second bounds of a known deviation from what was measured, at most, as a
share."""


class Reference(msgspec.Struct, frozen=True):
    """A publication."""

    citation: str
    says: str
    """The published figure, and how it was measured."""
    is_confirmed: bool = True
    """Whether the text was looked up and says so. If not, the figure is an estimate."""


class KnownDeviation(msgspec.Struct, frozen=True):
    """A deviation from the bounds that has a physical reason, which is explained.

    What the mesh or a scheme does wrong is no such reason: it fails.
    """

    measured: float
    """The value that was measured. Farther from it than `LARGEST_KNOWN` the check fails."""
    why: str

    def explains(self, value: float) -> bool:
        """Return whether a value is the one that was measured."""
        return abs(value - self.measured) <= LARGEST_KNOWN * abs(self.measured)


class Check(NamedTuple):
    """One value, and the bounds that it must lie in."""

    name: str
    """Quantity that was measured, and the method."""
    value: float
    low: float
    high: float
    basis: Basis
    """Source of the bounds."""
    unit: str = ""
    known: KnownDeviation | None = None

    @property
    def verdict(self) -> str:
        """`PASS`, `FAIL` or `KNOWN`. A value that is not a number fails."""
        if self.low <= self.value <= self.high:
            return PASS
        if self.known and self.known.explains(self.value):
            return KNOWN
        return FAIL


class Line(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A measured line of a section: a quantity, and the bounds of its value."""

    name: str
    """Name of the measured quantity; words in braces are filled in."""
    basis: Basis
    """Source of the bounds."""
    near: float | None = None
    """Largest deviation of the value from 1; None where `low` and `high` are the bounds."""
    low: float = -math.inf
    high: float = math.inf
    unit: str = ""
    known: KnownDeviation | None = None

    def check(
        self,
        case: str,
        value: float,
        *,
        around: float = 0.0,
        high: float | None = None,
        **words: str,
    ) -> Check:
        """Return the check of a value.

        Args:
            case: What was measured: the begin of the name.
            value: The value.
            around: What the bounds lie around, where they are differences.
            high: The upper bound, where another value gives it.
            words: Words of the name.
        """
        most = self.high if high is None else high
        bounds = (self.low + around, most + around) if self.near is None else within(self.near)
        name = f"{case}: {self.name.format(**words)}"
        return Check(name, value, *bounds, basis=self.basis, unit=self.unit, known=self.known)


class Section(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Texts of a scene, and the lines that are measured in it."""

    title: str
    about: str
    """Procedure, comparison, and meaning for a user."""
    lines: dict[str, Line]
    references: list[Reference] = []


class Curve(NamedTuple):
    """A curve of a plot."""

    label: str
    x: FloatArray
    y: FloatArray
    is_theory: bool = False
    """Whether it is drawn dashed, in the colour of the curve before it."""


class Band(NamedTuple):
    """A published range of y, drawn as a stripe."""

    label: str
    low: float
    high: float


class Plot(NamedTuple):
    """A plot of curves."""

    title: str
    x: str
    """Label of the x axis, with its unit."""
    y: str
    """Label of the y axis, with its unit."""
    curves: Sequence[Curve]
    bands: Sequence[Band] = ()


class Findings(NamedTuple):
    """Findings of a scene."""

    checks: list[Check]
    plots: Sequence[Plot] = ()
    notes: Sequence[str] = ()
    """Further facts, one sentence or two each."""


class ValidationScene(NamedTuple):
    """A simulated experiment whose outcome is known from theory or from publications."""

    name: str
    """One word, for `--only`."""
    title: str
    about: str
    """Procedure, comparison, and meaning for a user."""
    measure: Callable[[bool], Findings]
    """Runs the experiment; the argument says whether to run the short version."""
    references: Sequence[Reference] = ()


@cache
def sections() -> dict[str, Section]:
    """Return the sections of `sections.toml` by name, in the order of the report."""
    content = tomllib.loads(_SECTIONS.read_text(encoding="utf-8"))
    return msgspec.convert(_on_one_line(content), dict[str, Section])


def _on_one_line(content: Any) -> Any:
    """Return a table whose texts have no line breaks."""
    if isinstance(content, dict):
        return {key: _on_one_line(value) for key, value in content.items()}
    if isinstance(content, list):
        return [_on_one_line(value) for value in content]
    return " ".join(content.split()) if isinstance(content, str) else content


def lines_of(section: str) -> dict[str, Line]:
    """Return the measured lines of a section by their keys."""
    return sections()[section].lines


def within(share: float, of: float = 1.0) -> tuple[float, float]:
    """Return the bounds that deviate from `of` by a share of it."""
    return of * (1.0 - share), of * (1.0 + share)


def farthest_from_one(shares: Sequence[float]) -> float:
    """Return the share that is farthest from 1: the worst of several results."""
    return max(shares, key=lambda share: abs(share - 1.0))
