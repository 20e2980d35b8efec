"""What a scene of the validation finds: figures with their bounds, curves, and the sources."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

from tissue import FloatArray

PASS, FAIL, KNOWN = "pass", "FAIL", "known"
"""Verdicts. `known` is a figure out of its bounds by no more than what is known and explained."""


class Source(NamedTuple):
    """Who says so."""

    citation: str
    says: str
    """The figure, and how it was measured."""
    is_confirmed: bool = True
    """Whether the text was looked up and says so. If not, take it for an estimate."""


class Known(NamedTuple):
    """A figure that is known to be out of its bounds."""

    low: float
    high: float
    """Where it is instead. Outside of that the line fails."""
    why: str


class Line(NamedTuple):
    """One figure, and where it must lie."""

    name: str
    """What was measured, and how."""
    figure: float
    low: float
    high: float
    unit: str = ""
    known: Known | None = None

    @property
    def verdict(self) -> str:
        """`PASS`, `FAIL` or `KNOWN`. What is no number fails."""
        if self.low <= self.figure <= self.high:
            return PASS
        if self.known and self.known.low <= self.figure <= self.known.high:
            return KNOWN
        return FAIL


class Curve(NamedTuple):
    """A line of a plot."""

    label: str
    x: FloatArray
    y: FloatArray
    is_theory: bool = False
    """Drawn dashed, in the colour of the curve before."""


class Band(NamedTuple):
    """A range of y that was published, drawn as a stripe."""

    label: str
    low: float
    high: float


class Plot(NamedTuple):
    """A picture of curves."""

    title: str
    x: str
    """What the axis shows, with its unit."""
    y: str
    curves: Sequence[Curve]
    bands: Sequence[Band] = ()


class Findings(NamedTuple):
    """What a scene found."""

    lines: list[Line]
    plots: Sequence[Plot] = ()
    notes: Sequence[str] = ()
    """What to know besides, one sentence or two each."""


class Scene(NamedTuple):
    """Something that the engine must get right."""

    name: str
    """One word, for `--only`."""
    title: str
    about: str
    """What is done, what is compared with what, and what it means for a user."""
    measure: Callable[[bool], Findings]
    """Does it; the argument says whether to be quick."""
    sources: Sequence[Source] = ()


def within(share: float, of: float = 1.0) -> tuple[float, float]:
    """Return the bounds of what may be off by that share of `of`."""
    return of * (1.0 - share), of * (1.0 + share)
