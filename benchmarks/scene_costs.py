"""The cost of each shipped scene in frames of a reference, on which `scalpel-sim doctor` rests."""

from collections.abc import Mapping
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from benchmarks.timing import Rounds, TurnWatch
from scalpel_sim.preparation.prepare import prepare
from scalpel_sim.runs.options import Flag
from scalpel_sim.runs.run import run_time
from scalpel_sim.scene.read import SCENES
from scalpel_sim.validate.speed.expected import (
    COSTS_FILE,
    FIRST_FRAME,
    MILLISECOND,
    N_FRAMES,
    REFERENCE_SCENE,
    ReferenceFrames,
    as_run,
    processor_time,
    scene_costs,
)
from scalpel_sim.validate.speed.machine import clock_under_load, describe_machine, machine_line
from scalpel_sim.validate.speed.measurements import CPU, LOWER, BenchmarkResult
from scalpel_sim.validate.speed.scenes import checked_scene_names
from scalpel_sim.validate.speed.tables import Rows, compact_table, print_notes, three_digits
from scalpel_sim.validate.speed.watch import SILENT
from scalpel_sim.viewer.pictures import into_replay
from scalpel_sim.viewer.replay import ReplayWriter
from tissue.support import whole_file

if TYPE_CHECKING:
    from rich.console import Console

MOST_DRIFT = 0.1
"""A cost that differs from the stored one by more is marked: half of the error that `doctor`
allows itself, which leaves the other half to the differences between processors."""

_ABOUT = (
    "Cost: processor time of a simulated millisecond, as `run` does the scene, over that of the "
    f"reference, a frame of {REFERENCE_SCENE} (frames {FIRST_FRAME} to {FIRST_FRAME + N_FRAMES}), "
    "which is measured before and after each scene. Stored: what `scalpel-sim doctor` uses; "
    f"--write stores anew. Off: by more than {MOST_DRIFT:.0%}."
)

_HEADER = """\
# What a simulated millisecond of each scene costs, in frames of the organ's cut: the rule of
# `scalpel-sim doctor` (expected.py). Written by `python -m benchmarks scene-costs --write`.
"""


def measure_scene_costs(
    *scenes: str, runs: Rounds = 5, watch: TurnWatch = SILENT, write: Flag = False
) -> BenchmarkResult:
    """Compare what each scene costs with what `scalpel-sim doctor` takes it to cost.

    The exit code is 1 where a cost is off, unless it is stored anew. For example:

    ```console
    python -m benchmarks scene-costs --runs 3 --write
    ```

    Args:
        scenes: Scenes [default: all that are shipped].
        runs: Number of rounds.
        watch: Receives the progress.
        write: Store the costs for `doctor`.
    """
    names = checked_scene_names(scenes)
    reference = ReferenceFrames()
    watch.begin(runs * len(names))
    costs: dict[str, list[float]] = {name: [] for name in names}
    references: list[float] = []
    for _ in range(runs):
        for name in names:
            before = reference.seconds()
            cost = cost_of(name)
            references.append(0.5 * (before + reference.seconds()))
            costs[name].append(cost / references[-1])
            watch.tick(name)
    rows = Rows("scene-costs", CPU)
    rows.times("reference frame", None, [np.array(references)], "ms")
    for name, values in costs.items():
        rows.values(name, None, values, "frames", quantity="cost", better=LOWER, clock=CPU.name)
    stored = scene_costs()
    found = {name: float(np.median(values)) for name, values in costs.items()}
    if write:
        _store(stored | found)
    show = partial(_print, found, stored, 1e3 * float(np.median(references)))
    is_right = write or not any(is_off(cost, stored.get(name)) for name, cost in found.items())
    return BenchmarkResult(rows.measured, [], show, is_right)


def cost_of(name: str) -> float:
    """Return the mean processor time of a simulated millisecond of a scene, done as by `run` [s].

    Pictures for the replay are included, files are not.
    """
    simulation = prepare(as_run(SCENES[name]))
    replay = ReplayWriter(simulation.arm.model, title=name, frame=simulation.frame)
    simulation.pictures.append(into_replay(replay))
    n_frames = round(run_time(simulation, SCENES[name].seconds) / simulation.dt)
    processor_time(simulation, 1)  # what is loaded in it is not loaded again
    spent = processor_time(simulation, n_frames - 1)
    return spent * MILLISECOND / ((n_frames - 1) * simulation.dt)


def is_off(cost: float, stored: float | None) -> bool:
    """Return whether a cost differs by too much from the stored one, if there is one."""
    return stored is None or abs(cost / stored - 1.0) > MOST_DRIFT


def _store(costs: Mapping[str, float]) -> None:
    """Write the costs of the shipped scenes, in their order."""
    machine = machine_line(describe_machine() | {"clock_hz": clock_under_load()})
    lines = [f"{name} = {costs[name]:.3g}" for name in SCENES if name in costs]
    with whole_file(COSTS_FILE) as unfinished:
        text = f'{_HEADER}measured_on = "{machine}"\n\n[costs]\n' + "\n".join(lines) + "\n"
        unfinished.write_text(text, encoding="utf-8")


def _print(
    found: Mapping[str, float],
    stored: Mapping[str, float],
    reference: float,
    console: "Console",
) -> None:
    """Print a line for each scene."""
    table = compact_table("costs of the scenes", ("scene",), ("cost", "stored", "change"), ("",))
    for name, cost in found.items():
        before = stored.get(name)
        change = "" if before is None else f"{100.0 * (cost / before - 1.0):+.0f} %"
        known = "none" if before is None else three_digits(before)
        table.add_row(name, three_digits(cost), known, change, "off" * is_off(cost, before))
    console.print(table)
    console.print(f"Reference frame: {reference:.3f} ms of processor time.")
    print_notes(_ABOUT, (), console)
