"""A run that only has to be started, and how it is done: by its script, or by a hand."""

import gc
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

from scalpel_sim.hands.run_controls import RunControls
from scalpel_sim.output.plot_process import Plotter
from scalpel_sim.output.summary import Summary
from scalpel_sim.runs.console import compiling, progress
from scalpel_sim.runs.options import PrintOptions
from scalpel_sim.runs.resumption import Resumption
from scalpel_sim.runs.run import REST_AFTER_STROKE, perform, run_time
from scalpel_sim.runs.run_folder import Outputs
from scalpel_sim.runs.stop_signals import loading
from scalpel_sim.runs.warm_up import USUAL_SETS, KernelSet, prepare_kernels
from scalpel_sim.scene.checks import LONGEST_RUN
from scalpel_sim.scene.scene import Scene
from scalpel_sim.simulation import Simulation


class PreparedRun(NamedTuple):
    """A run that only has to be started."""

    simulation: Simulation
    scene: Scene
    """What it was made from. Of a tissue elsewhere it says only what the server describes."""
    folder: Path
    settings: dict[str, Any]
    """What the command line and the scene resolved to."""
    checkpoint_seconds: float
    """Simulated time between two checkpoints [s]; 0: there are none."""
    exports: tuple[Path, ...] = ()
    """Files for the body's surface after the run."""
    is_here: bool = True
    """Whether the tissue is in this process."""
    printing: PrintOptions = PrintOptions()
    """What is printed meanwhile."""

    @property
    def written_scene(self) -> Scene | None:
        """The scene to write: a server does not describe how its tissue is held or solved."""
        return self.scene if self.is_here else None

    def outputs(self, plotter: Plotter, resumption: Resumption | None = None) -> Outputs:
        """Return the folder of its files, which is locked.

        Args:
            plotter: Draws the plots.
            resumption: Files of the run, if it continues from there.

        Raises:
            RunError: another run writes there, or the folder cannot be made or written.
        """
        return Outputs(
            self.folder,
            plotter,
            self.simulation.recording.columns,
            self.exports,
            self.checkpoint_seconds,
            resumption,
        )


def perform_script(
    prepared: PreparedRun,
    plotter: Plotter,
    after_frame: Callable[[Simulation], None] = lambda simulation: None,
    controls: RunControls | None = None,
    resumption: Resumption | None = None,
) -> Summary:
    """Do a run whose strokes are in its scene, with a progress bar on a terminal.

    Args:
        prepared: The run.
        plotter: Draws the plots.
        after_frame: Called after each frame.
        controls: Requests of a page.
        resumption: Files of the run, if it continues from there.

    Raises:
        Interrupted: the user or the system ended the run.
        RunError: the run failed.
    """
    seconds = run_time(prepared.simulation, prepared.scene.seconds)
    if resumption is not None and resumption.seconds is not None:
        seconds = resumption.seconds
    with progress(seconds, prepared.printing) as advance:

        def every_frame(simulation: Simulation) -> None:
            advance(simulation)
            after_frame(simulation)

        return perform(
            prepared.simulation,
            prepared.outputs(plotter, resumption),
            scene=prepared.written_scene,
            views=prepared.scene.views,
            settings=prepared.settings,
            seconds=seconds,
            every_frame=every_frame,
            controls=controls,
        )


def perform_by_hand(prepared: PreparedRun, plotter: Plotter, controls: RunControls) -> Summary:
    """Do a run until its hand has ended, at most at real time, and write its files.

    Args:
        prepared: The run.
        plotter: Draws the plots.
        controls: Requests of a page or a device, with a hand.

    Raises:
        Interrupted: the user or the system ended the run.
        RunError: the run failed.
    """
    simulation = prepared.simulation
    controls.pace.go_on()
    return perform(
        simulation,
        prepared.outputs(plotter),
        scene=prepared.written_scene,
        views=prepared.scene.views,
        settings=prepared.settings | {"stroke": simulation.stroke.name},
        seconds=LONGEST_RUN + REST_AFTER_STROKE,
        every_frame=lambda now: controls.pace.wait(now.dt),
        controls=controls,
    )


def load_kernels(options: PrintOptions, scene: Scene | None = None) -> None:
    """Load the kernels, which ends the loading; show the progress where they are compiled first.

    Args:
        options: Whether to show it.
        scene: Whose kernels; None: those of the default scene, with and without an account.
    """
    with compiling(options) as on_progress, loading():
        prepare_kernels(USUAL_SETS if scene is None else [KernelSet.of(scene)], on_progress)
    gc.enable()
