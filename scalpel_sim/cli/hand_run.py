"""Does a run whose blade somebody leads, in the page or by a device."""

from scalpel_sim.cli.run_setup import PreparedRun, RunOptions
from scalpel_sim.hands.run_controls import RunControls
from scalpel_sim.output.plot_process import Plotter
from scalpel_sim.output.run_folder import Outputs
from scalpel_sim.output.summary import Summary
from scalpel_sim.run import REST_AFTER_STROKE, perform
from scalpel_sim.scene_parts.scene import LONGEST_RUN


def perform_by_hand(
    prepared: PreparedRun, options: RunOptions, plotter: Plotter, controls: RunControls
) -> Summary:
    """Do the run until its hand has ended, at most at real time, and write its files.

    Args:
        prepared: The run.
        options: What the command line asks for.
        plotter: Draws the plots.
        controls: They have a hand.

    Raises:
        Interrupted: the user or the system ended the run.
        RunError: the run failed.
    """
    simulation = prepared.simulation
    controls.pace.go_on()
    return perform(
        simulation,
        Outputs(
            prepared.folder,
            plotter,
            simulation.recording.columns,
            options.output.export,
            prepared.checkpoint_seconds,
        ),
        scene=prepared.scene if options.client.connect is None else None,
        views=prepared.scene.views,
        settings=prepared.settings | {"stroke": simulation.stroke.name},
        seconds=LONGEST_RUN + REST_AFTER_STROKE,
        every_frame=lambda now: controls.pace.wait(now.dt),
        controls=controls,
    )
