"""The command `view`: a run that is shown live in a browser, and may be led there."""

import sys
import time
from collections.abc import Callable

from scalpel_sim.cli.console import log_to_stderr, print_report, say
from scalpel_sim.cli.options import (
    ArmOptions,
    ClientOptions,
    OutputOptions,
    PageOptions,
    PrintOptions,
    SceneName,
    TissueOptions,
)
from scalpel_sim.output.plot_process import Plotter
from scalpel_sim.stop_signals import StopSignals

SECONDS_PER_CHECK = 0.2
"""How often a finished `view` checks whether its page is still wanted [s]."""


def view(
    scene: SceneName = None,
    /,
    *,
    page: PageOptions = PageOptions(),
    tissue: TissueOptions = TissueOptions(),
    arm: ArmOptions = ArmOptions(),
    client: ClientOptions = ClientOptions(),
    output: OutputOptions = OutputOptions(),
    printing: PrintOptions = PrintOptions(),
) -> None:
    """Run at real-time speed, and show the cut live in a browser.

    On a terminal it waits for Enter, so that you can open the page first. Afterwards the page stays
    until Ctrl-C. The motion is advanced by --relaxation verlet, unless you choose another
    or the tissue stiffens.

    For example:

    ```console
    scalpel-sim view
    scalpel-sim view slab --wireframe --port 8080
    scalpel-sim view --hand live
    ```

    Args:
        scene: What to cut.
    """
    with log_to_stderr(printing), Plotter() as plotter:
        from scalpel_sim.cli.led_run import live_hand, perform_led
        from scalpel_sim.cli.run_setup import RunOptions, prepared_run
        from scalpel_sim.cli.scripted_run import perform_script
        from scalpel_sim.hands.history import History
        from scalpel_sim.hands.pace import Pace
        from scalpel_sim.hands.run_controls import RunControls
        from scalpel_sim.viewer.pictures import into_viewer, live_state, show_in
        from scalpel_sim.viewer.viewer import PageControls, Viewer

        options = RunOptions(tissue, arm, client, output, printing)
        is_led = page.hand == "live"
        with prepared_run(scene, options, relaxation="verlet", is_led=is_led) as prepared:
            simulation = prepared.simulation
            hand = live_hand(prepared) if is_led else None
            controls = RunControls(Pace(), History(simulation), hand)
            with Viewer(
                simulation.arm.model,
                title=simulation.title,
                frame=simulation.frame,
                wireframe=page.wireframe,
                port=page.port,
                views=prepared.scene.views,
                controls=PageControls(controls.commands, is_led),
            ) as viewer:

                def show() -> None:
                    show_in(viewer, simulation, live_state(controls))

                def show_if_wanted() -> None:
                    if viewer.lacks_values:
                        show()

                def is_watched() -> bool:
                    show_if_wanted()
                    return viewer.is_running

                show()
                controls.on_change = show
                controls.on_wait = show_if_wanted
                simulation.pictures.append(into_viewer(viewer, lambda: live_state(controls)))
                if is_led:
                    say(f"open {viewer.url} and lead the blade there")
                    summary = perform_led(prepared, options, plotter, viewer, controls)
                else:
                    _wait_for_start(viewer.url)
                    controls.pace.go_on()
                    summary = perform_script(
                        prepared,
                        options,
                        plotter,
                        lambda now: controls.pace.wait(now.dt),
                        controls,
                    )
                show()
                print_report(summary, prepared.folder, output.export, printing)
                _stay_while(is_watched, f"{viewer.url} stays until Ctrl-C")


def _wait_for_start(url: str) -> None:
    """Print where the page is; at a terminal, wait until it has been opened."""
    if sys.stdin is not None and sys.stdin.isatty():
        say(f"open {url}, then press Enter to begin")
        sys.stdin.readline()
    else:
        say(f"live at {url}")


def _stay_while(condition: Callable[[], bool], message: str) -> None:
    """Print a message, and return when the condition fails, or on Ctrl-C."""
    with StopSignals() as stop:
        say(message)  # from now on Ctrl-C ends it without a traceback
        while condition() and stop.reason is None:
            time.sleep(SECONDS_PER_CHECK)
