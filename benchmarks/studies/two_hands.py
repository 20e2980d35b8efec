"""Whether the scenes of two hands end as they should wherever the hands start.

In each run each hand does what it does at a place of its own, moved as a whole by up to 3 mm in a
random direction.
"""

from typing import TYPE_CHECKING, Annotated, Literal

import numpy as np
from cyclopts import Parameter

from benchmarks.timing import Rounds, TurnWatch
from scalpel_sim import Simulation, prepare
from scalpel_sim.scene.read import scene_in, shipped_scene, with_settings
from scalpel_sim.strokes.asked import asked_area
from scalpel_sim.validate.speed.measurements import BenchmarkResult
from scalpel_sim.validate.speed.watch import SILENT
from tissue import Piece, pieces_of

if TYPE_CHECKING:
    from rich.console import Console

_CLOSED = 0.005
"""Largest residual of an account that closes, as a share of the work of all hands."""

_LEAST_OPENED = 0.9
"""Share of the area that an incision is asked to cut which it opens at least."""

_REST = 0.3
"""How long a scene continues after all hands are done [s]."""


Settings = Annotated[tuple[str, ...], Parameter(name="--set", negative="")]


def two_hands(
    scene: Literal["retract", "excise", "taut_incision"],
    /,
    *,
    runs: Rounds = 20,
    watch: TurnWatch = SILENT,
    seed: int = 0,
    settings: Settings = (),
) -> BenchmarkResult:
    """Start the hands of a scene at random places: count how many runs end as they should.

    A line for each run shows how it ended, what is not as it should be, and by how much the account
    of the energy is off, as a share of the work of all hands.

    Args:
        scene: retract, excise or taut_incision.
        runs: Number of runs.
        watch: Receives the progress.
        seed: Of the random numbers.
        settings: A key of the scene file, such as material.toughness=50.
    """
    from tests.scalpel_sim.moved_scenes import moved

    chosen = scene_in(with_settings(shipped_scene(scene), ["solver.audit=true", *settings]))
    random = np.random.default_rng(seed)
    lines: list[str] = []
    n_right = n_closed = 0
    watch.begin(runs)
    for i in range(1, runs + 1):
        simulation = prepare(moved(chosen, random))
        asked = asked_area(simulation.stroke, simulation.link.snapshot()) or 0.0
        simulation.run(simulation.duration + _REST)
        energies = simulation.result.energies
        assert energies is not None
        work = energies.work_of_blade + abs(energies.work_of_loads)
        off = energies.residual / work
        wrong = what_is_wrong(scene, simulation, asked)
        n_right += not wrong
        n_closed += abs(off) <= _CLOSED
        mark = f"NOT as it should ({'; '.join(wrong)})" if wrong else "as it should"
        lines.append(
            f"{i:3}  ends {mark}, pieces {simulation.link.n_pieces()}, residual {1e2 * off:.2f} % "
            f"of {1e3 * work:.3g} mJ, touched {dict(simulation.touching.frames)}"
        )
        watch.tick(f"run {i}")
    lines.append(f"{n_right} of {runs} end as they should, {n_closed} accounts close")

    def show(console: "Console") -> None:
        for line in lines:
            console.print(line, highlight=False)

    return BenchmarkResult([], [], show, is_right=n_right == n_closed == runs)


def what_is_wrong(name: str, simulation: Simulation, asked: float) -> list[str]:
    """Return what is not as it should be at the end of a scene; `asked`: what to cut [m2]."""
    pieces = pieces_of(simulation.link.snapshot())
    are_held = [piece.is_held for piece in pieces]
    (left,) = simulation.graspers
    most = int(simulation.recording.column("left_points").max())
    wrong = {"the left hand never held anything": most == 0}
    if name != "excise":  # there it puts down what it holds
        wrong[f"the left hand holds {left.n_points} of {most} points"] = left.n_points < most
    if name == "taut_incision":
        wrong |= _wrong_of_incision(simulation, are_held, asked)
    elif are_held != [True, False]:
        wrong[f"{len(pieces)} pieces, {sum(are_held)} of them held, not 2 and 1"] = True
    else:
        wrong |= _wrong_of_piece(name, pieces[1], left.n_points)
    return [what for what, is_so in wrong.items() if is_so]


def _wrong_of_incision(
    simulation: Simulation, are_held: list[bool], asked: float
) -> dict[str, bool]:
    """Return what may be wrong after an incision, and whether it is."""
    opened = simulation.recording.column("cut_area_m2")
    is_cutting = (opened > 0.0) & (opened < opened[-1])
    # The tissue draws the hand to the left, where it is held, if it is taut.
    pull = -simulation.recording.vector("left_force")[is_cutting, 0]
    least = float(pull.min(initial=np.inf))
    cut = f"{1e6 * opened[-1]:.0f} of {1e6 * asked:.0f} mm2 are cut"
    return {
        f"{len(are_held)} pieces, {sum(are_held)} of them held, not one": are_held != [True],
        cut: not opened[-1] > _LEAST_OPENED * asked,
        f"slack during the cut: the hand feels {least:.2f} N": least <= 0.0,
    }


def _wrong_of_piece(name: str, off: Piece, n_points: int) -> dict[str, bool]:
    """Return what may be wrong with the piece that came off, and whether it is."""
    where = f"its centre is at {np.round(1e3 * off.centre, 1).tolist()} mm"
    speed = float(np.linalg.norm(off.velocity))
    moves = f"the piece moves at {1e3 * speed:.0f} mm/s"
    if name == "retract":  # it hangs from the grasper, and swings
        return {f"the piece hangs too low: {where}": off.centre[2] <= 0.03, moves: speed >= 0.15}
    # Its half depth is 9 mm: it is clear of the sheet, which ends at 40 mm, by 1 cm.
    lies = off.centre[1] > 0.06 and abs(off.centre[2] + 0.01) < 0.002
    return {
        f"the lump does not lie behind the sheet: {where}": not lies,
        moves: speed >= 0.01,
        f"the left hand still holds {n_points} points": n_points > 0,
    }
