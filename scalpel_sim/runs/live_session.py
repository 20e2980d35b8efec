"""Runs that are shown live in one page, one after the other, as the person there asks."""

import logging
import sys
import time
from collections import deque
from collections.abc import Callable
from contextlib import AbstractContextManager, ExitStack
from typing import NamedTuple, Self

from bridge import LinkError
from scalpel_sim.errors import Interrupted, RunError
from scalpel_sim.hands.commands import Begin, Choose, Command, End, Engage, Jaws
from scalpel_sim.hands.run_controls import History, Pace, RunControls
from scalpel_sim.hands.teleoperation import LiveHand
from scalpel_sim.output.plot_process import Plotter
from scalpel_sim.output.summary import Summary
from scalpel_sim.runs.console import SECONDS_PER_CHECK, print_report, say
from scalpel_sim.runs.options import PageOptions
from scalpel_sim.runs.prepared_run import PreparedRun, perform_by_hand, perform_script
from scalpel_sim.runs.stop_signals import StopSignals
from scalpel_sim.scene.checks import LONGEST_RUN
from scalpel_sim.scene.read import SCENES
from scalpel_sim.viewer.messages import Choices, PageControls
from scalpel_sim.viewer.pictures import show_run
from scalpel_sim.viewer.viewer import Viewer
from tissue import MATERIALS

_log = logging.getLogger("scalpel_sim")


PrepareRun = Callable[[Begin], AbstractContextManager[PreparedRun]]
"""Prepares the run that a page asks for; its link is closed when that is left."""


class _LiveRun(NamedTuple):
    """A run that the page shows."""

    asked: Begin
    prepared: PreparedRun
    controls: RunControls
    show: Callable[[], None]
    """Shows it as it is now."""


class LiveSession:
    """The page, and the runs in it.

    Args:
        prepare: Prepares a run that the page asks for, until its link is closed.
        page: Options of the page.
        plotter: Draws the plots of the first run. It is closed here.
    """

    def __init__(self, prepare: PrepareRun, page: PageOptions, plotter: Plotter) -> None:
        self._prepare, self._page, self._plotter = prepare, page, plotter
        self._commands: deque[Command] = deque()
        self._viewer: Viewer | None = None
        self._open = ExitStack()
        """The link of the run that is shown."""
        self._first = ""
        """Name of the scene of the first run."""
        self._n_runs = 0

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        if self._viewer is not None:
            self._viewer.close()
        self._open.close()
        self._plotter.close()

    def perform(self) -> None:
        """Do runs until Ctrl-C, or until the viewer has ended.

        Raises:
            UsageError: the first run makes no sense.
            LinkError: its tissue is elsewhere, and cannot be reached.
            Interrupted: the user or the system ended a run.
            RunError: a run failed.
        """
        run: _LiveRun | None = self._begun(Begin(is_led=self._page.hand == "live"))
        while run is not None:
            summary = self._done(run)
            run.show()
            if summary is not None and self._viewer is not None:
                done = run.prepared
                print_report(summary, done.folder, done.exports, done.printing)
            run = self._after(run, summary is not None)

    def _begun(self, asked: Begin) -> _LiveRun:
        """Prepare a run, and show it."""
        with ExitStack() as stack:
            prepared = stack.enter_context(self._prepare(asked))
            if self._n_runs:
                self._plotter.close()  # it has drawn the plots of one run
                self._plotter = Plotter()
                folder = prepared.folder
                prepared = prepared._replace(
                    folder=folder.with_name(f"{folder.name}-{self._n_runs + 1}")
                )
            simulation = prepared.simulation
            hand = live_hand(prepared) if asked.is_led else None
            self._commands.clear()
            controls = RunControls(Pace(), History(simulation), hand, self._commands)
            show = show_run(self._shown(prepared, asked), simulation, controls)
            before, self._open = self._open, stack.pop_all()
            before.close()
        return _LiveRun(asked, prepared, controls, show)

    def _shown(self, prepared: PreparedRun, asked: Begin) -> Viewer:
        """Return the viewer, in which the run begins."""
        simulation, scene = prepared.simulation, prepared.scene
        choices = None
        if prepared.is_here:
            self._first = self._first or scene.name
            choices = Choices(
                self._first,
                ["", *(name for name in SCENES if name != self._first)],
                asked.scene,
                list(MATERIALS),
                asked.material or "",
                scene.material.toughness,
                0.0 if scene.blade is None else scene.blade.thickness,
                asked.is_led,
            )
        controls = PageControls(self._commands, asked.is_led, choices)
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

    def _done(self, run: _LiveRun) -> Summary | None:
        """Do a run; None where another was asked for before it began."""
        assert self._viewer is not None
        prepared, controls = run.prepared, run.controls
        if run.asked.is_led:
            summary = perform_live(prepared, self._plotter, self._viewer, controls)
        else:
            if self._n_runs == 0:
                _wait_for_start(self._viewer.url)
            controls.pace.go_on()
            summary = perform_script(
                prepared,
                self._plotter,
                lambda now: controls.pace.wait(now.dt),
                controls,
            )
        self._n_runs += summary is not None
        return summary

    def _after(self, run: _LiveRun, has_files: bool) -> _LiveRun | None:
        """Wait until the page asks for another run, and begin it; None: it is not wanted."""
        run.controls.has_ended = True
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
        """Wait for what the page asks for next; None on Ctrl-C or where the viewer has ended."""
        assert self._viewer is not None
        with StopSignals() as stop:
            if says:  # from now on Ctrl-C ends it without a traceback
                say(f"{self._viewer.url} stays until Ctrl-C")
            while self._viewer.is_running and stop.reason is None:
                asked, run.controls.next = run.controls.next, None
                if asked is not None:
                    return asked
                while self._commands:
                    command = self._commands.popleft()
                    if isinstance(command, Begin):
                        return command
                run.controls.on_wait()
                time.sleep(SECONDS_PER_CHECK)
        return None


def _wait_for_start(url: str) -> None:
    """Print where the page is; at a terminal, wait until it has been opened."""
    if sys.stdin is not None and sys.stdin.isatty():
        say(f"open {url}, then press Enter to begin")
        sys.stdin.readline()
    else:
        say(f"live at {url}")


SECONDS_PER_LOOK = 0.02
"""How often it is looked whether somebody has taken hold of the blade [s]."""

_BEGIN = Engage | Choose | Jaws | End | Begin
"""Commands with which a run begins."""


def live_hand(prepared: PreparedRun) -> LiveHand:
    """Return the hand that leads a run."""
    seconds = prepared.scene.seconds
    return LiveHand(prepared.simulation, seconds=LONGEST_RUN if seconds is None else seconds)


def perform_live(
    prepared: PreparedRun, plotter: Plotter, viewer: Viewer, controls: RunControls
) -> Summary | None:
    """Do the run from when somebody takes hold of the blade until they end it.

    Where they ask for another run before, there is none.

    Args:
        prepared: The run.
        plotter: Draws the plots.
        viewer: Its page has shown the start.
        controls: Obey the commands of that page; they have a hand.

    Raises:
        Interrupted: the user or the system ended the run.
        RunError: the viewer has ended, and nobody can lead; or the run failed.
    """
    _wait_for_hand(viewer, controls)
    if any(isinstance(command, Begin) for command in list(controls.commands)):
        return None
    return perform_by_hand(prepared, plotter, controls)


def _wait_for_hand(viewer: Viewer, controls: RunControls) -> None:
    """Wait until a page chooses or takes hold, or ends the run before it has begun."""
    with StopSignals() as stop:
        say(f"open {viewer.url} and lead the blade there")
        while not any(isinstance(command, _BEGIN) for command in list(controls.commands)):
            if stop.reason is not None:
                raise Interrupted(f"{stop.reason} before anybody took hold of the blade")
            if not viewer.is_running:
                raise RunError("the viewer has ended before anybody took hold of the blade")
            controls.on_wait()
            time.sleep(SECONDS_PER_LOOK)
