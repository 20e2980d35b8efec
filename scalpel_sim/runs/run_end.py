"""The end of a run: all that was done goes to its folder, whatever ended it."""

import logging
from types import TracebackType
from typing import Any, NamedTuple, Self

from bridge import LinkError, TissueDescription
from scalpel_sim.errors import RunError, one_line
from scalpel_sim.hands.teleoperation import Teleoperation
from scalpel_sim.output.export import export_surface
from scalpel_sim.output.run_outcome import outcome_of
from scalpel_sim.output.run_warnings import RunWarning, warnings_of
from scalpel_sim.output.summary import RunFacts, Summary, summarise
from scalpel_sim.runs.file_names import FINAL, FORCES, PLOT, REPLAY, SUMMARY
from scalpel_sim.runs.run_folder import Outputs
from scalpel_sim.simulation import Simulation
from scalpel_sim.viewer.pictures import add_to
from scalpel_sim.viewer.replay import ReplayWriter
from tissue import Snapshot, pieces_of

_log = logging.getLogger(__name__)

_LED = "what the hands did"


class RunStart(NamedTuple):
    """Facts of a run before its first frame: later the link may be lost."""

    body: TissueDescription
    title: str
    """Heading of the plots."""
    first: Snapshot
    """The body as it lies then."""
    asked: float | None
    """The area that the stroke is to cut [m2]; None where that is not known."""


class EndedRun(NamedTuple):
    """A run whose last frame is done."""

    simulation: Simulation
    outputs: Outputs
    replay: ReplayWriter
    hand: Teleoperation | None
    """Teleoperation of the blade; None: a script led it."""
    start: RunStart
    settings: dict[str, Any]
    """Settings to keep in the summary."""
    status: str
    """`complete`, or what ended the run before its time."""
    failure: Exception | None
    """The error that ended it, or None."""


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
        self._name = ""

    def of(self, name: str) -> Self:
        """Return the attempt to write what has this name."""
        self._name = name
        return self

    def __enter__(self) -> None:
        pass

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> bool:
        if not isinstance(error, Exception):
            return False
        self.errors.append(error)
        self.unwritten.append(self._name)
        if not (isinstance(error, LinkError) and isinstance(self._failure, LinkError)):
            _log.warning("%s", _about(self._name, error))
        return True


def write_end(run: EndedRun) -> tuple[Summary, Attempts]:
    """Write the last files of a run, each of which may fail; return what was tried.

    The body comes first, and what can be made again from the other files last.
    """
    simulation, outputs = run.simulation, run.outputs
    attempts = Attempts(run.failure)
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
    summary = summarise(simulation.recording, _facts(run, attempts))
    with attempts.of(SUMMARY):
        outputs.write_summary(summary)
    for warning in summary.warnings:
        _log.warning("%s", warning["message"])
    with attempts.of(PLOT):
        outputs.start_plots(run.start.title)  # by another process, while this one writes the replay
    with attempts.of("the last picture"):
        add_to(run.replay, simulation)
    with attempts.of(REPLAY):
        outputs.write_replay(run.replay)
    for path in outputs.exports:
        with attempts.of(str(path)):
            export_surface(simulation.link.surface(), path)
    with attempts.of(PLOT):
        outputs.finish_plots()
    return summary, attempts


def write_driven(outputs: Outputs, hand: Teleoperation) -> None:
    """Write what the hand has done since the last call.

    Raises:
        RunError: the system refuses; what was done is kept for the next attempt.
    """
    rows = hand.blade.take_rows()
    grasps = [(grasper.name, grasper.take_rows()) for grasper in hand.graspers]
    attempts = Attempts()
    with attempts.of(_LED):
        outputs.write_stroke(rows)
    for name, done in grasps:
        with attempts.of(_LED):
            outputs.write_grasp(name, done)
    if attempts.errors:
        raise attempts.errors[0]


def _facts(run: EndedRun, attempts: Attempts) -> RunFacts:
    """Write the final mesh, and return the facts of the run."""
    simulation, link, bridge = run.simulation, run.simulation.link, run.simulation.bridge
    last = pieces = quality = None
    with attempts.of(FINAL):
        last = link.snapshot()
        run.outputs.write_mesh(FINAL, last)
        pieces = pieces_of(last)
    if FINAL not in attempts.unwritten:
        with attempts.of("the quality of the cut"):
            quality = link.cut_report()
    warnings: list[RunWarning] = []
    if last is not None and quality is not None:
        with attempts.of("the warnings"):
            known = run.settings, run.start.body, run.start.first
            warnings = warnings_of(outcome_of(simulation, *known, last, quality.node_size))
    return RunFacts(
        scene=run.start.body.scene,
        status=run.status,
        dt=simulation.dt,
        wall_seconds=simulation.wall_seconds,
        tetrahedra_initial=run.start.body.n_tetrahedra,
        tetrahedra_final=(bridge.result or run.start.body).n_tetrahedra,
        pieces=pieces,
        quality=quality,
        asked_area=run.start.asked,
        counters=bridge.counters.as_numbers(),
        touched=simulation.touching.frames,
        settings=run.settings,
        held_points=[load.n_points for load in bridge.frame_loads],
        warnings=[warning.as_numbers() for warning in warnings],
    )


def _about(name: str, error: Exception) -> str:
    """Return the line about a file that could not be written."""
    if isinstance(error, RunError):  # it names its file
        return str(error)
    return f"{name}: cannot be written ({one_line(error)})"
