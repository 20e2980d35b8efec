"""All findings of a validation: their number by verdict, and their JSON."""

import json
import math
from collections.abc import Sequence
from typing import Any, NamedTuple

from scalpel_sim.validate.findings import FAIL, KNOWN, PASS, Check, Findings, ValidationScene

_FORMAT = "scalpel-sim validation 1"
"""First entry of the file; the number changes where readers of older files would fail."""


class SceneRun(NamedTuple):
    """A scene that was run."""

    scene: ValidationScene
    findings: Findings
    seconds: float
    """Wall time of the run on this machine [s]."""


class VerdictCounts(NamedTuple):
    """Number of checks by verdict."""

    passed: int
    known: int
    failed: int


def count_verdicts(runs: Sequence[SceneRun]) -> VerdictCounts:
    """Return how many checks passed, deviate as known, and failed."""
    verdicts = [check.verdict for run in runs for check in run.findings.checks]
    return VerdictCounts(*(verdicts.count(verdict) for verdict in (PASS, KNOWN, FAIL)))


def validation_as_json(runs: Sequence[SceneRun], *, quick: bool, versions: dict[str, str]) -> str:
    """Return all findings as JSON text."""
    content = {
        "format": _FORMAT,
        "quick": quick,
        "versions": versions,
        "passed": count_verdicts(runs).failed == 0,
        "counts": count_verdicts(runs)._asdict(),
        "scenes": [_scene_entry(run) for run in runs],
    }
    return json.dumps(content, indent=2, ensure_ascii=False, allow_nan=False)


def _scene_entry(run: SceneRun) -> dict[str, Any]:
    """Return a scene as JSON has it."""
    scene = run.scene
    return {
        "name": scene.name,
        "title": scene.title,
        "about": scene.about,
        "seconds": round(run.seconds, 1),
        "lines": [_check_entry(check) for check in run.findings.checks],
        "notes": list(run.findings.notes),
        "sources": [reference._asdict() for reference in scene.references],
    }


def _check_entry(check: Check) -> dict[str, Any]:
    """Return a check as JSON has it."""
    return {
        "name": check.name,
        "figure": _finite(check.value),
        "unit": check.unit,
        "low": _finite(check.low),
        "high": _finite(check.high),
        "verdict": check.verdict,
        "basis": check.basis,
        "why": check.known.why if check.known and check.verdict == KNOWN else "",
    }


def _finite(number: float) -> float | None:
    """Return a number, or None where it is not finite: JSON has no such numbers."""
    return number if math.isfinite(number) else None
