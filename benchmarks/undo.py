"""Times the undo of a cut: state, files, and the surface of the picture that shows it.

Usage: PYTHONPATH=. python benchmarks/undo.py [SCENE], on an idle machine
"""

import sys
import tempfile
import time
from pathlib import Path
from statistics import median

from scalpel_sim import SCENES, prepare
from scalpel_sim.hands.commands import Engage, Move, Release, Undo
from scalpel_sim.hands.run_controls import History, Pace, RunControls
from scalpel_sim.hands.teleoperation import LiveHand
from scalpel_sim.output.plot_process import Plotter
from scalpel_sim.runs.run_folder import Outputs

N_TIMES = 10
WAY = 0.035
"""How far the hand draws the blade in each stroke [m]."""
MILLISECONDS = 1e3


def main() -> None:
    """Print the times."""
    name = sys.argv[1] if len(sys.argv) > 1 else "organ"
    scene = SCENES[name]
    simulation = prepare(scene, is_led=True)
    hand = LiveHand(simulation)
    hand.take_over(simulation)
    controls = RunControls(Pace(), History(simulation), hand)
    undo, drawn, areas = [], [], []
    with Plotter() as plotter, tempfile.TemporaryDirectory() as folder:
        outputs = Outputs(Path(folder), plotter)
        controls.history.begin(outputs)
        for _ in range(N_TIMES):
            controls.commands += [Engage(), Move([0.0, WAY, 0.0], 0.0)]
            for _ in range(400):
                controls.obey()
                simulation.step()
                outputs.write_forces(simulation.recording)
            areas.append(simulation.result.cut_area)
            controls.commands += [Release(), Undo()]
            start = time.perf_counter()
            controls.obey()
            undo.append(time.perf_counter() - start)
            simulation.link.surface()
            drawn.append(time.perf_counter() - start)
        outputs.close()
    print(f"{name}: undo of a cut of {1e6 * median(areas):.0f} mm2, median and most of {N_TIMES}")
    for what, times in (("state and files", undo), ("with the surface", drawn)):
        print(f"{what:18s}{MILLISECONDS * median(times):8.2f}{MILLISECONDS * max(times):8.2f} ms")


if __name__ == "__main__":
    main()
