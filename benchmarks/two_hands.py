"""Whether the scenes of two hands end as they should wherever the hands start.

Usage: PYTHONPATH=. python benchmarks/two_hands.py SCENE [--runs N] [--seed N] [--set KEY=VALUE]

SCENE is retract, excise or taut_incision. In each run each hand does what it does at a place of its
own, moved as a whole by up to 3 mm in a random direction. A row shows how it ended, and by how much
the account of the energy is off, as a share of the work of all hands. The last line counts.
"""

import argparse
import sys

import numpy as np
from rich.console import Console

from scalpel_sim import Simulation, prepare
from scalpel_sim.scene_file.build import scene_in
from scalpel_sim.scene_file.layers import with_settings
from scalpel_sim.scene_file.reading import shipped_scene
from scalpel_sim.strokes.asked_area import asked_area
from tests.scalpel_sim.moved_scenes import moved
from tissue import pieces_of

CLOSED = 0.005
"""Largest residual of an account that closes, as a share of the work of all hands."""

LEAST_OPENED = 0.9
"""Share of the area that an incision is asked to cut which it opens at least."""

REST = 0.3
"""How long a scene goes on after all hands are done [s]."""

SCENES = ("retract", "excise", "taut_incision")
"""The scenes."""


def ends_right(name: str, simulation: Simulation, asked: float) -> bool:
    """Return whether a scene ended as it should; `asked`: what its stroke is to cut [m2]."""
    pieces = pieces_of(simulation.link.snapshot())
    held = [piece.is_held for piece in pieces]
    (left,) = simulation.graspers
    most = simulation.recording.column("left_points").max()
    if name == "taut_incision":
        opened = float(simulation.recording.column("cut_area_m2")[-1])
        return held == [True] and most > 0 and opened > LEAST_OPENED * asked
    if held != [True, False]:
        return False
    off = pieces[1]
    if name == "retract":  # it hangs from the grasper, and swings
        hangs = left.n_points == most > 0
        return bool(hangs and off.centre[2] > 0.03 and np.linalg.norm(off.velocity) < 0.15)
    # Its half depth is 9 mm: it is clear of the sheet, which ends at 40 mm, by 1 cm.
    lies = off.centre[1] > 0.06 and abs(off.centre[2] + 0.01) < 0.002
    return bool(lies and np.linalg.norm(off.velocity) < 0.01 and left.n_points == 0)


def main() -> int:
    """Do the runs and print how they ended; return 1 where one did not end right."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scene", choices=SCENES)
    parser.add_argument("--runs", type=int, default=20)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--set", action="append", default=["solver.audit=true"])
    options = parser.parse_args()
    console = Console()
    scene = scene_in(with_settings(shipped_scene(options.scene), options.set))
    random = np.random.default_rng(options.seed)
    n_right = n_closed = 0
    for i in range(1, options.runs + 1):
        simulation = prepare(moved(scene, random))
        asked = asked_area(simulation.stroke, simulation.link.snapshot()) or 0.0
        simulation.run(simulation.duration + REST)
        energies = simulation.result.energies
        assert energies is not None
        work = energies.work_of_blade + abs(energies.work_of_loads)
        off = energies.residual / work
        is_right = ends_right(options.scene, simulation, asked)
        n_right += is_right
        n_closed += abs(off) <= CLOSED
        mark = "as it should" if is_right else "NOT as it should"
        console.print(
            f"{i:3}  ends {mark}, pieces {simulation.link.n_pieces()}, residual {1e2 * off:.2f} % "
            f"of {1e3 * work:.3g} mJ, touched {dict(simulation.touching.frames)}"
        )
    console.print(f"{n_right} of {options.runs} end as they should, {n_closed} accounts close")
    return 0 if n_right == n_closed == options.runs else 1


if __name__ == "__main__":
    sys.exit(main())
