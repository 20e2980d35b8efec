"""Does a run whose blade a visitor leads in the live page, as the command `view` asks for it."""

import time

from scalpel_sim.cli.console import say
from scalpel_sim.cli.hand_run import perform_by_hand
from scalpel_sim.cli.run_setup import PreparedRun, RunOptions
from scalpel_sim.errors import Interrupted, RunError
from scalpel_sim.hands.commands import Begin, Choose, End, Engage, Jaws
from scalpel_sim.hands.live_hand import LiveHand
from scalpel_sim.hands.run_controls import RunControls
from scalpel_sim.output.plot_process import Plotter
from scalpel_sim.output.summary import Summary
from scalpel_sim.scene_parts.scene import LONGEST_RUN
from scalpel_sim.stop_signals import StopSignals
from scalpel_sim.viewer.viewer import Viewer

SECONDS_PER_LOOK = 0.02
"""How often it is looked whether somebody has taken hold of the blade [s]."""

_BEGIN = Engage | Choose | Jaws | End | Begin
"""Commands with which a run begins."""


def live_hand(prepared: PreparedRun) -> LiveHand:
    """Return the hand that leads a run."""
    seconds = prepared.scene.seconds
    return LiveHand(prepared.simulation, seconds=LONGEST_RUN if seconds is None else seconds)


def perform_led(
    prepared: PreparedRun,
    options: RunOptions,
    plotter: Plotter,
    viewer: Viewer,
    controls: RunControls,
) -> Summary | None:
    """Do the run from when somebody takes hold of the blade until they end it.

    Where they ask for another run before, there is none.

    Args:
        prepared: The run.
        options: What the command line asks for.
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
    return perform_by_hand(prepared, options, plotter, controls)


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
