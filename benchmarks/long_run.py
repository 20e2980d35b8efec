"""Memory and frame times of a long run that is written to a folder, with checkpoints and without.

Usage: PYTHONPATH=. python benchmarks/long_run.py [SECONDS [SCENE]], on an idle machine

Prints the memory of the process after each tenth of the simulated time, and how long frames took
with all that is done between them. The run is that of the scene, and rests after its stroke.
"""

import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from scalpel_sim import SCENES, Simulation, prepare
from scalpel_sim.output.plot_process import Plotter
from scalpel_sim.runs.checkpoints import CHECKPOINT_SECONDS
from scalpel_sim.runs.run import perform
from scalpel_sim.runs.run_folder import Outputs
from scalpel_sim.scene.scene import changed

N_LOOKS = 10
MILLISECONDS = 1e3
MEGABYTES = 1e-6


def main() -> None:
    """Print the figures."""
    seconds = float(sys.argv[1]) if len(sys.argv) > 1 else 60.0
    name = sys.argv[2] if len(sys.argv) > 2 else "grid2"
    for every in (CHECKPOINT_SECONDS, 0.0):
        memory, times = figures(name, seconds, every)
        print(f"{name}, {seconds:g} s, a checkpoint every {every:g} s (0: none)")
        print("  memory [MB]: " + " ".join(f"{MEGABYTES * each:.1f}" for each in memory))
        shares = np.percentile(times, (50, 99, 99.9, 100))
        print(
            "  frame [ms]: median {:.3f}, 99 % {:.3f}, 99.9 % {:.3f}, longest {:.1f}, mean "
            "{:.3f}".format(*(MILLISECONDS * shares), MILLISECONDS * times.mean())
        )


def figures(name: str, seconds: float, every: float) -> tuple[list[float], np.ndarray]:
    """Return the memory of the process at times [bytes], and the times between frames [s]."""
    scene = changed(SCENES[name], seconds=seconds)
    simulation = prepare(scene)
    n_frames = round(seconds / simulation.dt)
    clock, memory = np.zeros(n_frames), []

    def after_frame(now: Simulation) -> None:
        n = len(now.recording)
        clock[n - 1] = time.perf_counter()
        if n % (n_frames // N_LOOKS) == 0:
            memory.append(resident_memory())

    with tempfile.TemporaryDirectory() as folder, Plotter() as plotter:
        columns = simulation.recording.columns
        outputs = Outputs(Path(folder), plotter, columns, checkpoint_seconds=every)
        perform(
            simulation, outputs, scene=scene, settings={}, seconds=seconds, every_frame=after_frame
        )
    return memory, np.diff(clock)


def resident_memory() -> float:
    """Return the memory of this process that is in use [bytes], Linux."""
    return 1024.0 * next(
        float(line.split()[1])
        for line in Path("/proc/self/status").read_text().splitlines()
        if line.startswith("VmRSS")
    )


if __name__ == "__main__":
    main()
