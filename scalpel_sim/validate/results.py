"""All that a validation found, counted, and as JSON."""

import json
import math
from collections.abc import Sequence
from typing import Any, NamedTuple

from scalpel_sim.validate.findings import FAIL, KNOWN, PASS, Findings, Line, Scene

_FORMAT = "scalpel-sim validation 1"
"""First entry of the file; the number changes where readers of older files would stumble."""


class Done(NamedTuple):
    """A scene, and what it found."""

    scene: Scene
    findings: Findings
    seconds: float
    """That it took on this machine."""


class Counts(NamedTuple):
    """Lines by verdict."""

    passed: int
    known: int
    failed: int


def counts(done: Sequence[Done]) -> Counts:
    """Return how many lines of all scenes passed, are known to be out of bounds, and failed."""
    verdicts = [line.verdict for each in done for line in each.findings.lines]
    return Counts(*(verdicts.count(verdict) for verdict in (PASS, KNOWN, FAIL)))


def as_json(done: Sequence[Done], *, quick: bool, versions: dict[str, str]) -> str:
    """Return what was found as JSON text."""
    content = {
        "format": _FORMAT,
        "quick": quick,
        "versions": versions,
        "passed": counts(done).failed == 0,
        "counts": counts(done)._asdict(),
        "scenes": [_scene(each) for each in done],
    }
    return json.dumps(content, indent=2, ensure_ascii=False, allow_nan=False)


def _scene(done: Done) -> dict[str, Any]:
    scene = done.scene
    return {
        "name": scene.name,
        "title": scene.title,
        "about": scene.about,
        "seconds": round(done.seconds, 1),
        "lines": [_line(line) for line in done.findings.lines],
        "notes": list(done.findings.notes),
        "sources": [source._asdict() for source in scene.sources],
    }


def _line(line: Line) -> dict[str, Any]:
    """Return a line; what is no number becomes null, which JSON has."""
    return {
        "name": line.name,
        "figure": _finite(line.figure),
        "unit": line.unit,
        "low": _finite(line.low),
        "high": _finite(line.high),
        "verdict": line.verdict,
        "why": line.known.why if line.known and line.verdict == KNOWN else "",
    }


def _finite(number: float) -> float | None:
    return number if math.isfinite(number) else None
