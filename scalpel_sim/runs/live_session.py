"""Runs that are shown live in one page, one after the other, as the person there requests."""

import logging
import sys
import time
from collections import deque
from collections.abc import Callable
from contextlib import AbstractContextManager, ExitStack
from pathlib import Path
from typing import NamedTuple, Self

from msgspec.structs import replace

from bridge import LinkError
from scalpel_sim.errors import RunError
from scalpel_sim.hands.commands import Begin, Choose, Command, CutLines, End, Engage, Jaws, Reset
from scalpel_sim.hands.run_controls import History, Pace, RunControls
from scalpel_sim.hands.run_results import RunResults
from scalpel_sim.hands.teleoperation import LiveHand
from scalpel_sim.output.report import headline
from scalpel_sim.output.summary import Summary
from scalpel_sim.runs.console import print_report, say, wait_until
from scalpel_sim.runs.device_run import DeviceRun, device_run, perform_device
from scalpel_sim.runs.file_names import REPLAY, REPORT
from scalpel_sim.runs.options import DeviceOptions, PageOptions
from scalpel_sim.runs.prepared_run import PreparedRun
from scalpel_sim.runs.run import perform
from scalpel_sim.runs.stop_signals import StopSignals
from scalpel_sim.scene.checks import LONGEST_RUN
from scalpel_sim.scene.read import SHIPPED_SCENES, TASK_SCENES
from scalpel_sim.viewer.looks import look_of_scene
from scalpel_sim.viewer.messages import Choices, PageControls
from scalpel_sim.viewer.pictures import show_run
from scalpel_sim.viewer.viewer import Viewer
from tissue import MATERIALS

_log = logging.getLogger("scalpel_sim")

_SECONDS_PER_WAIT = 0.02
"""Time between two checks whether somebody has taken hold of the blade [s]."""

SECONDS_PER_CHECK = 0.2
"""Time between two checks whether the page of a run that has ended is still wanted [s]."""

_BEGIN = Engage | Choose | Jaws | End | Begin | CutLines
"""Commands with which a run begins."""

PrepareRun = Callable[[Begin], AbstractContextManager[PreparedRun]]
"""Prepares the run that a page requests; its link is closed when that is left."""


class _LiveRun(NamedTuple):
    """A run that the page shows."""

    asked: Begin
    prepared: PreparedRun
    device: DeviceRun | None
    """Device that leads it; None: the page or the script does."""
    controls: RunControls
    show: Callable[[], None]
    """Shows it as it is now."""


class LiveSession:
    """The page, and the runs in it.

    Args:
        prepare: Prepares a run that the page requests, until its link is closed.
        page: Options of the page.
        device: Options of the device that leads, if one does.
    """

    def __init__(self, prepare: PrepareRun, page: PageOptions, device: DeviceOptions) -> None:
        self._prepare, self._page, self._device = prepare, page, device
        self._commands: deque[Command] = deque()
        self._viewer: Viewer | None = None
        self._open = ExitStack()
        """The link of the run that is shown, and the server of its device."""
        self._first = ""
        """Name of the scene of the first run."""
        self._n_runs = 0

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        if self._viewer is not None:
            self._viewer.close()
        self._open.close()

    def perform(self) -> None:
        """Do runs until Ctrl-C, or until the viewer has ended.

        Raises:
            UsageError: the first run makes no sense.
            LinkError: its tissue is elsewhere, and cannot be reached.
            Interrupted: the user or the system ended a run.
            RunError: a run failed.
        """
        run: _LiveRun | None = self._begun(Begin(is_led=self._page.hand != "script"))
        while run is not None:
            summary = self._done(run)
            if summary is not None:
                run.controls.results = results_of(summary, run.prepared.folder)
                print_report(summary, run.prepared)
            run.controls.has_ended = True
            run.show()
            run = self._after(run, summary is not None)

    def _begun(self, asked: Begin) -> _LiveRun:
        """Prepare a run, and show it."""
        with ExitStack() as stack:
            prepared = stack.enter_context(self._prepare(asked))
            if self._n_runs:
                folder, record, end = prepared.folder, prepared.record, f"-{self._n_runs + 1}"
                prepared = prepared._replace(
                    folder=folder.with_name(folder.name + end),
                    record=record and record.with_stem(record.stem + end),
                )
            simulation, device = prepared.simulation, None
            self._commands.clear()
            if self._page.hand == "device":
                device = stack.enter_context(device_run(prepared, self._device, self._commands))
                controls = device.controls
            else:
                hand = live_hand(prepared) if asked.is_led else None
                controls = RunControls(Pace(), History(simulation), hand, self._commands)
            show = show_run(self._shown(prepared, asked), simulation, controls)
            before, self._open = self._open, stack.pop_all()
            before.close()
        return _LiveRun(asked, prepared, device, controls, show)

    def _shown(self, prepared: PreparedRun, asked: Begin) -> Viewer:
        """Return the viewer, in which the run begins."""
        simulation, scene = prepared.simulation, prepared.scene
        choices, is_led_by_device = None, self._page.hand == "device"
        if self._may_choose(prepared):
            self._first = self._first or scene.name
            choices = Choices(
                self._first,
                ["", *(name for name in SHIPPED_SCENES if name != self._first)],
                asked.scene,
                list(MATERIALS),
                asked.material or "",
                scene.material.toughness,
                0.0 if scene.blade is None else scene.blade.thickness,
                asked.is_led,
                asked.lines,
                [name for name in TASK_SCENES if name != self._first],
            )
        is_led, look = asked.is_led and not is_led_by_device, look_of_scene(scene)
        controls = PageControls(self._commands, is_led, choices, look)
        if self._viewer is None:
            self._viewer = Viewer(
                simulation.arm.model,
                title=simulation.title,
                frame=simulation.frame,
                wireframe=self._page.wireframe,
                port=self._page.port,
                views=scene.views,
                controls=controls,
            )
        else:
            self._viewer.begin(
                simulation.arm.model,
                title=simulation.title,
                frame=simulation.frame,
                views=scene.views,
                controls=controls,
            )
        return self._viewer

    def _may_choose(self, prepared: PreparedRun) -> bool:
        """Return whether the page may request another run."""
        return prepared.is_here and self._page.hand != "device"

    def _done(self, run: _LiveRun) -> Summary | None:
        """Do a run; None where another was requested before it began."""
        assert self._viewer is not None
        prepared, viewer, controls = run.prepared, self._viewer, run.controls
        if run.device is not None:
            say(f"live at {viewer.url}")
            summary = perform_device(prepared, run.device, lambda: viewer.is_running)
        elif run.asked.is_led and self._is_given_up(controls):
            return None
        else:
            if not run.asked.is_led and self._n_runs == 0:
                _wait_for_start(viewer.url)
            summary = perform(prepared, controls=controls)
        self._n_runs += 1
        return summary

    def _is_given_up(self, controls: RunControls) -> bool:
        """Wait until a page chooses or takes hold; return whether it requests another run instead.

        Raises:
            Interrupted: the user or the system ended the program before.
            RunError: the viewer has ended, and nobody can lead.
        """
        assert self._viewer is not None
        viewer = self._viewer

        def wait() -> None:
            controls.on_wait()
            time.sleep(_SECONDS_PER_WAIT)

        def has_begun() -> bool:
            return any(isinstance(command, _BEGIN) for command in list(controls.commands))

        wait_until(
            f"open {viewer.url} and lead the blade there",
            has_begun,
            "anybody took hold of the blade",
            wait,
            lambda: viewer.is_running,
        )
        return any(isinstance(command, Begin | CutLines) for command in list(controls.commands))

    def _after(self, run: _LiveRun, has_files: bool) -> _LiveRun | None:
        """Wait until the page requests another run, and begin it; None: it is not wanted."""
        while (asked := self._asked_next(run, says=has_files)) is not None:
            has_files = False
            run.controls.notice = "preparing the next run"
            run.show()
            try:
                return self._begun(asked)
            except (ValueError, RunError, LinkError) as error:
                run.controls.notice = f"the next run cannot begin: {error}"
                _log.warning("%s", run.controls.notice)
                run.show()
        return None

    def _asked_next(self, run: _LiveRun, *, says: bool) -> Begin | None:
        """Wait for what the page requests next; None on Ctrl-C or where the viewer has ended."""
        assert self._viewer is not None
        with StopSignals() as stop:
            if says:  # from now on Ctrl-C ends it without a traceback
                say(f"{self._viewer.url} stays until Ctrl-C")
            while self._viewer.is_running and stop.reason is None:
                asked, run.controls.next = run.controls.next, None
                if asked is not None:
                    return _as_begin(asked, run.asked)
                while self._commands:
                    command = self._commands.popleft()
                    if isinstance(command, Begin | CutLines):
                        return _as_begin(command, run.asked)
                    if isinstance(command, Reset) and self._may_choose(run.prepared):
                        return run.asked
                run.controls.on_wait()
                time.sleep(SECONDS_PER_CHECK)
        return None


def _as_begin(asked: Begin | CutLines, before: Begin) -> Begin:
    """Return the run that the page requests, which may be that before with other lines."""
    if isinstance(asked, Begin):
        return asked
    return replace(before, lines=asked.lines, is_led=False)


def results_of(summary: Summary, folder: Path) -> RunResults:
    """Return what a run has given, for its page."""
    replay, report = (folder.resolve() / name for name in (REPLAY, REPORT))
    return RunResults(
        headline(summary),
        str(folder.resolve()),
        str(replay) if replay.is_file() else "",
        str(report) if report.is_file() else "",
    )


def _wait_for_start(url: str) -> None:
    """Print where the page is; at a terminal, wait until it has been opened."""
    if sys.stdin is not None and sys.stdin.isatty():
        say(f"open {url}, then press Enter to begin")
        sys.stdin.readline()
    else:
        say(f"live at {url}")


def live_hand(prepared: PreparedRun) -> LiveHand:
    """Return the hand that leads a run."""
    seconds = prepared.scene.seconds
    return LiveHand(prepared.simulation, seconds=LONGEST_RUN if seconds is None else seconds)
