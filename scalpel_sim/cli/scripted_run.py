"""Does a run whose strokes are in its scene, as the commands `run` and `view` ask for it."""

from collections.abc import Callable

from scalpel_sim.cli.console import progress
from scalpel_sim.cli.run_setup import PreparedRun, RunOptions
from scalpel_sim.hands.run_controls import RunControls
from scalpel_sim.output.plot_process import Plotter
from scalpel_sim.output.resumption import Resumption
from scalpel_sim.output.run_folder import Outputs
from scalpel_sim.output.summary import Summary
from scalpel_sim.run import perform, run_time
from scalpel_sim.simulation import Simulation


def perform_script(
    prepared: PreparedRun,
    options: RunOptions,
    plotter: Plotter,
    after_frame: Callable[[Simulation], None] = lambda simulation: None,
    controls: RunControls | None = None,
    resumption: Resumption | None = None,
) -> Summary:
    """Do the run, with a progress bar on a terminal.

    Args:
        prepared: The run.
        options: What the command line asks for.
        plotter: Draws the plots.
        after_frame: Called after each frame.
        controls: What a page asks of the run.
        resumption: What is there of the run, if it goes on from there.
    """
    seconds = run_time(prepared.simulation, prepared.scene.seconds)
    if resumption is not None and resumption.seconds is not None:
        seconds = resumption.seconds
    with progress(seconds, options.printing) as advance:

        def every_frame(simulation: Simulation) -> None:
            advance(simulation)
            after_frame(simulation)

        return perform(
            prepared.simulation,
            Outputs(
                prepared.folder,
                plotter,
                prepared.simulation.recording.columns,
                options.output.export,
                prepared.checkpoint_seconds,
                resumption,
            ),
            # A server does not say how its tissue is held, nor how it is solved.
            scene=prepared.scene if options.client.connect is None else None,
            views=prepared.scene.views,
            settings=prepared.settings,
            seconds=seconds,
            every_frame=every_frame,
            controls=controls,
        )
