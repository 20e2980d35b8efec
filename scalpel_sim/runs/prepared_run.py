"""A run that only has to be started."""

import gc
from pathlib import Path
from typing import Any, NamedTuple

from scalpel_sim.output.plot_process import Plotter
from scalpel_sim.runs.console import compiling
from scalpel_sim.runs.options import PrintOptions
from scalpel_sim.runs.stop_signals import loading
from scalpel_sim.runs.warm_up import USUAL_SETS, KernelSet, prepare_kernels
from scalpel_sim.scene.scene import Scene
from scalpel_sim.simulation import Simulation


class PreparedRun(NamedTuple):
    """A run that only has to be started: see `run.perform`."""

    simulation: Simulation
    """At its start."""
    scene: Scene
    """Scene that it was made from. Of a tissue elsewhere it says only what the server describes."""
    folder: Path
    """Folder of its files."""
    settings: dict[str, Any]
    """Settings from command line and scene, for the summary."""
    plotter: Plotter
    """Draws its plots."""
    checkpoint_seconds: float = 0.0
    """Simulated time between two checkpoints [s]; 0: there are none."""
    exports: tuple[Path, ...] = ()
    """Files for the body's surface after the run."""
    record: Path | None = None
    """File that the run is recorded to; None: there is none."""
    is_here: bool = True
    """Whether the tissue is in this process."""
    printing: PrintOptions = PrintOptions()
    """Printing meanwhile."""


def load_kernels(options: PrintOptions, scene: Scene | None = None) -> None:
    """Load the kernels, which ends the loading; show the progress where they are compiled first.

    Args:
        options: Whether to show it.
        scene: Whose kernels; None: those of the default scene, with and without an account.
    """
    with compiling(options) as on_progress, loading():
        prepare_kernels(USUAL_SETS if scene is None else [KernelSet.of(scene)], on_progress)
    gc.enable()
