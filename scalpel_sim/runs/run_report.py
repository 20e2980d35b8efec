"""From a run that has ended to its report: what was to be done, how well, by whom and when."""

import math
from collections.abc import Iterator, Sequence
from datetime import datetime
from itertools import pairwise

from scalpel_sim.hands.teleoperation import LiveHand, Teleoperation
from scalpel_sim.output.report import headline
from scalpel_sim.output.report_page import ForceCurve, ReportPicture, RunReport
from scalpel_sim.output.run_warnings import RunWarning
from scalpel_sim.output.summary import Summary
from scalpel_sim.recording.recording import Recording
from scalpel_sim.runs.file_names import SCENE
from scalpel_sim.runs.prepared_run import PreparedRun
from scalpel_sim.scene.task_table import TaskTable
from scalpel_sim.scoring.judged_terms import JudgedTerm, judged_terms
from scalpel_sim.strokes.kind import StrokeTable
from scalpel_sim.strokes.kinds import STROKES

_MM_PER_M, _KPA_PER_PA = 1e3, 1e-3

_MEANINGS = {
    "cut area": "Area that was opened, one side of the cut, on the body at rest.",
    "pieces": "Parts of the body that hang together at the end.",
    "force, mean": "Force of the tissue on the blade, over the time in which there was any.",
    "force, peak": "Largest force of the tissue on the blade at any instant.",
    "work of the blade": "Energy that the blade gave to the tissue: to part, bend and rub it.",
}
"""Meanings of the figures of the headline, for a person who has read nothing else."""


def report_of(
    prepared: PreparedRun,
    summary: Summary,
    warnings: Sequence[RunWarning],
    hand: Teleoperation | None,
    pictures: Sequence[ReportPicture] = (),
) -> RunReport:
    """Return the report of a run.

    Args:
        prepared: The run, which has ended.
        summary: Its figures.
        warnings: What it did not do as requested.
        hand: Hand that led the blade; None: a script did.
        pictures: Pictures of it.
    """
    simulation = prepared.simulation
    scene = prepared.scene
    limits = [] if hand else [row.force_limit for row in scene.strokes if row.force_limit]
    if scene.task is not None and scene.task.success.force is not None:
        limits.append(scene.task.success.force)
    return RunReport(
        title=simulation.title,
        by=f"{_who(hand)}, {datetime.now().astimezone():%d %B %Y, %H:%M %Z}",
        asked=list(_asked(prepared, hand)),
        criteria=_criteria(summary),
        pictures=pictures,
        force=_force(simulation.recording, min(limits, default=None)),
        warnings=[each.message for each in warnings],
        facts=list(_facts(prepared, summary)),
    )


def _criteria(summary: Summary) -> list[JudgedTerm]:
    """Return the terms of the score, and of a run without one the headline."""
    if summary.score is not None:
        return judged_terms(summary.score)
    return [JudgedTerm(label, _MEANINGS[label], figure) for label, figure in headline(summary)]


def _who(hand: Teleoperation | None) -> str:
    """Return who led the blade."""
    if hand is None:
        return "By a script, which led the arm"
    return "By a hand in the live page" if isinstance(hand, LiveHand) else "By a hand with a device"


def _asked(prepared: PreparedRun, hand: Teleoperation | None) -> Iterator[str]:
    """Yield what was to be done, in sentences."""
    task = prepared.scene.task
    if task is not None:
        yield from _task_sentences(task)
        if task.line is not None or task.surface is not None:
            return
    if hand is not None and task is None:
        yield "The blade was led by hand, and nothing was planned: this says what was done."
        return
    for row in prepared.scene.strokes:
        yield _sentence(row)


def _task_sentences(task: TaskTable) -> Iterator[str]:
    """Yield what a task asks for."""
    tolerance = f"What lies within {_MM_PER_M * task.tolerance:g} mm of the plan counts as on it."
    if task.line is not None and task.depth is not None:
        corners = [(*point, 0.0)[:3] for point in task.line]
        length = f"{_MM_PER_M * _length(corners):.0f} mm long, {_MM_PER_M * task.depth:.1f} mm deep"
        yield f"{task.kind.capitalize()} along a line on the skin, {length}. {tolerance}"
    elif task.surface is not None:
        yield f"{task.kind.capitalize()} along the surface {task.surface}. {tolerance}"
    else:
        yield f"{task.kind.capitalize()} as the script has planned it. {tolerance}"
    if task.target is not None:
        yield f"The target is the part \u201c{task.target}\u201d."
    for row in task.spare:
        margin = f", by {_MM_PER_M * row.margin:g} mm at least" if row.margin else ""
        yield f"To be spared: the part \u201c{row.label}\u201d{margin}."
    if task.seconds is not None:
        yield f"It was to be done within {task.seconds:g} s."


def _sentence(row: StrokeTable) -> str:
    """Return what a stroke was to do."""
    about = STROKES[row.kind].keys.about.split(" ([")[0]
    depth = "" if row.depth is None else f", {_MM_PER_M * row.depth:.1f} mm deep"
    length = ""
    if row.kind == "traced":
        about = "a cut along a line on the skin"
        length = f", {_MM_PER_M * _length(row.points or ()):.0f} mm long"
    return f"Stroke \u201c{row.kind}\u201d: {about}{length}{depth}."


def _length(points: Sequence[Sequence[float]]) -> float:
    """Return the length of a line between points [m]."""
    return sum(math.dist(a, b) for a, b in pairwise(points))


def _force(recording: Recording, limit: float | None) -> ForceCurve:
    """Return the force on the blade over time."""
    return ForceCurve(recording.column("time_s"), recording.sizes("force"), limit)


def _facts(prepared: PreparedRun, summary: Summary) -> Iterator[tuple[str, str]]:
    """Yield how the run was made, and how to repeat it."""
    simulation, scene = prepared.simulation, prepared.scene
    if prepared.is_here:
        material = scene.material
        yield (
            "tissue",
            f"{scene.name}: {summary.tetrahedra_initial:,} tetrahedra, Young's modulus "
            f"{_KPA_PER_PA * material.young_modulus:.3g} kPa, toughness "
            f"{material.toughness:.3g} J/m\u00b2",
        )
    yield "arm", simulation.arm.name
    yield "simulated time", f"{summary.simulated_seconds:.2f} s ({summary.status})"
    yield "files", str(prepared.folder.resolve())
    if prepared.is_here and (prepared.folder / SCENE).is_file():
        yield "do it again", f"scalpel-sim run {prepared.folder / SCENE}: the same, to the bit"
    yield "versions", ", ".join(f"{name} {each}" for name, each in summary.versions.items())
