"""The end of a run: all that was done goes to its folder, whatever ended it."""

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from bridge import LinkError, TissueDescription
from scalpel_sim.errors import RunError, one_line
from scalpel_sim.hands.teleoperation import Teleoperation
from scalpel_sim.output.export import export_surface
from scalpel_sim.output.run_outcome import COMPLETE, RunOutcome, outcome_of
from scalpel_sim.output.run_warnings import RunWarning, warnings_of
from scalpel_sim.output.summary import Summary, summarise
from scalpel_sim.runs.file_names import (
    FINAL,
    FORCES,
    PLOT,
    REPLAY,
    REPORT,
    STROKE,
    SUMMARY,
    grasp_file,
)
from scalpel_sim.runs.prepared_run import PreparedRun
from scalpel_sim.runs.run_folder import Outputs
from scalpel_sim.runs.run_pictures import pictures_of
from scalpel_sim.runs.run_report import report_of
from scalpel_sim.saved_run.recorder import RunRecorder
from scalpel_sim.strokes.grasp_motion import GRASP_COLUMNS
from scalpel_sim.strokes.stroke import LED_COLUMNS
from scalpel_sim.viewer.looks import look_of_scene
from scalpel_sim.viewer.pictures import add_to
from scalpel_sim.viewer.replay import ReplayWriter
from scalpel_sim.viewer.textures import even_colours
from tissue import Deformation, Snapshot

_log = logging.getLogger(__name__)

_LED = "what the hands did"


class Attempts:
    """Attempts to write files, one a `with`: a failed one is logged, and the next is made.

    Args:
        failure: What ended the run, if it was an error: it is not logged again for each file.
    """

    def __init__(self, failure: Exception | None = None) -> None:
        self.errors: list[Exception] = []
        self.unwritten: list[str] = []
        """Names of what could not be written."""
        self._failure = failure

    @contextmanager
    def of(self, name: str) -> Iterator[None]:
        """Try to write what has this name."""
        try:
            yield
        except Exception as error:
            self.errors.append(error)
            self.unwritten.append(name)
            if not (isinstance(error, LinkError) and isinstance(self._failure, LinkError)):
                # A RunError names its file.
                is_named = isinstance(error, RunError)
                _log.warning(
                    "%s", error if is_named else f"{name}: cannot be written ({one_line(error)})"
                )


@dataclass
class OpenRun:
    """A run between its first and its last file."""

    prepared: PreparedRun
    outputs: Outputs
    replay: ReplayWriter
    settings: dict[str, Any]
    """Settings for the summary."""
    hand: Teleoperation | None
    """Teleoperation of the blade; None: a script leads it."""

    def __post_init__(self) -> None:
        self.simulation = self.prepared.simulation
        link = self.simulation.link  # later it may be lost
        self.body: TissueDescription = link.describe()
        self.title = self.simulation.title
        """Heading of the plots."""
        self.first: Snapshot = link.snapshot()
        """The body before the first frame."""
        self.first_deformation: Deformation = link.deformation()
        """Its stress and strain then."""
        self.recorder: RunRecorder | None = None
        """Records it, if that is requested."""
        self.status = COMPLETE
        """`complete`, or what ended the run before its time."""
        self.failure: Exception | None = None
        """Error that ended the frames."""
        self.attempts = Attempts()
        """Attempts to write the last files."""

    def begin_recording(self, seconds: float | None) -> None:
        """Begin to record the run, if that is requested, at its start or where it continues.

        Args:
            seconds: How long it is to last [s]; None: as long as a hand leads.

        Raises:
            RunError: the system refuses.
        """
        prepared = self.prepared
        if prepared.record is not None:
            self.recorder = RunRecorder(
                prepared.simulation,
                prepared.record,
                seconds=seconds,
                continues=self.outputs.resumption is not None,
            )


def write_end(run: OpenRun) -> Summary:
    """Write the last files of a run, each of which may fail.

    The body comes first, and what can be made again from the other files last.
    """
    simulation, outputs = run.simulation, run.outputs
    run.attempts = attempts = Attempts(run.failure)
    with attempts.of("the space that was kept"):
        outputs.free_reserve()
    with attempts.of(FORCES):
        outputs.write_forces(simulation.recording, all_rows=True)
    if run.hand is not None:
        run.hand.finish(simulation.time)
        with attempts.of(_LED):
            write_driven(outputs, run.hand)
    with attempts.of(FORCES):
        outputs.write_pending()
    if run.recorder is not None:
        with attempts.of(str(run.recorder.path)):
            run.recorder.close()
    outcome, warnings = _outcome(run), list[RunWarning]()
    if outcome.last is not None and outcome.report is not None:
        with attempts.of("the warnings"):
            warnings = warnings_of(outcome)
    summary = summarise(outcome, warnings)
    with attempts.of(SUMMARY):
        outputs.write_summary(summary)
    for warning in warnings:
        _log.warning("%s", warning.message)
    with attempts.of(PLOT):
        outputs.start_plots(run.title)  # by another process, while this one writes the replay
    with attempts.of("the last picture"):
        add_to(run.replay, simulation)
    with attempts.of(REPLAY):
        outputs.write_replay(run.replay)
    with attempts.of(REPORT):
        pictures = [] if run.prepared.scene.task is None else pictures_of(simulation)
        outputs.write_report(report_of(run.prepared, summary, warnings, run.hand, pictures))
    for path in run.prepared.exports:
        with attempts.of(str(path)):
            colours = even_colours(look_of_scene(run.prepared.scene))
            export_surface(simulation.link.surface(), path, colours)
    with attempts.of(PLOT):
        outputs.finish_plots()
    return summary


def write_driven(outputs: Outputs, hand: Teleoperation) -> None:
    """Write what the hand has done since the last call.

    Raises:
        RunError: the system refuses; what was done is kept for the next attempt.
    """
    rows = hand.blade.take_rows()
    grasps = [(grasper.name, grasper.take_rows()) for grasper in hand.graspers]
    attempts = Attempts()
    with attempts.of(_LED):
        outputs.write_driven(STROKE, LED_COLUMNS, rows)
    for name, done in grasps:
        with attempts.of(_LED):
            outputs.write_driven(grasp_file(name), GRASP_COLUMNS, done)
    if attempts.errors:
        raise attempts.errors[0]


def _outcome(run: OpenRun) -> RunOutcome:
    """Write the final mesh, and return the outcome of the run."""
    last = report = None
    with run.attempts.of(FINAL):
        link = run.simulation.link
        last = link.snapshot()
        run.outputs.write_mesh(FINAL, last, link.deformation(), link.label_names)
    if FINAL not in run.attempts.unwritten:
        with run.attempts.of("the quality of the cut"):
            report = run.simulation.link.cut_report()
    return outcome_of(run.simulation, run.settings, run.body, run.first, last, report, run.status)
