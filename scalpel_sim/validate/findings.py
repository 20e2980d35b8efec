"""What a scene of the validation returns: checks with their bounds, plots, and references."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

from tissue import FloatArray

PASS, FAIL, KNOWN = "pass", "FAIL", "known"
"""Verdicts. `known`: the value is out of its bounds by no more than a deviation that is known and
explained."""


THEORY, PUBLISHED, REGRESSION, CASE = "theory", "published", "regression", "case"
"""What a check compares with. `theory`: a formula or a law of conservation that is independent of
how the engine computes the value. `published`: a figure of an experiment. `regression`: what was
put in, as the engine's own law of it says: it shows that the engine does what it is told, and not
that tissue does so. `case`: what the file of a case expects."""

LARGEST_KNOWN = 0.02
"""How far the second bounds of a known deviation may be from what was measured, as a share."""


class Reference(NamedTuple):
    """A publication."""

    citation: str
    says: str
    """The published figure, and how it was measured."""
    is_confirmed: bool = True
    """Whether the text was looked up and says so. If not, the figure is an estimate."""


class KnownDeviation(NamedTuple):
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
    """What was measured, and how."""
    value: float
    low: float
    high: float
    basis: str
    """`THEORY`, `PUBLISHED`, `REGRESSION` or `CASE`: what the bounds come from."""
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
    """What a scene found."""

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
    """What is done, what is compared with what, and what it means for a user."""
    measure: Callable[[bool], Findings]
    """Runs the experiment; the argument says whether to run the short version."""
    references: Sequence[Reference] = ()


def within(share: float, of: float = 1.0) -> tuple[float, float]:
    """Return the bounds that deviate from `of` by a share of it."""
    return of * (1.0 - share), of * (1.0 + share)


def farthest_from_one(shares: Sequence[float]) -> float:
    """Return the share that is farthest from 1: the worst of several results."""
    return max(shares, key=lambda share: abs(share - 1.0))
