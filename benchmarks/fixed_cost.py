"""The fixed cost of a frame, part by part: what is left where the body costs next to nothing.

Usage: PYTHONPATH=. python benchmarks/fixed_cost.py [--frames N] [--audit] [--contact penalty]

A scalpel cuts a block of 48 tetrahedra. Frames in which the blade holds tissue and cuts no mesh are
counted. First whole frames are timed, then the parts by stopwatches around them: each part without
the parts listed that it calls. A stopwatch costs some 0.2 us, which a profiler does not: that takes
several times as long for each call of Python, and nothing longer for a kernel.
"""

import argparse
import importlib
from collections import defaultdict
from collections.abc import Callable
from statistics import median
from time import perf_counter_ns
from typing import Any

from scalpel_sim import SCENES
from scalpel_sim.preparation.prepare import prepare
from scalpel_sim.scene.scene import changed
from scalpel_sim.simulation import Simulation, no_garbage_collection
from tissue import BladeShape

PARTS = (
    "scalpel_sim.simulation:Simulation.step",
    "scalpel_sim.simulation:Simulation._record",
    "scalpel_sim.arm.arm:Arm.step1",
    "scalpel_sim.arm.arm:Arm.step2",
    "scalpel_sim.arm.arm:Arm.check",
    "scalpel_sim.instruments.stroke_follower:StrokeFollower.lead",
    "scalpel_sim.arm.blade:Blade.segment",
    "scalpel_sim.arm.blade:Blade.apply",
    "scalpel_sim.arm.collision_monitor:CollisionMonitor.check",
    "bridge.bridge:Bridge.step",
    "tissue.tissue:Tissue.step",
    "tissue.stepping.stages:StepStages.advance",
    "tissue.stepping.stages:edge_of",
    "tissue.stepping.stages:StepStages._begin_step",
    "tissue.stepping.stages:StepStages._relax",
    "tissue.integrators.global_stepper:GlobalStepper.relax",
    "tissue.stepping.stages:StepStages._detect",
    "tissue.cutting.incision:Incision.detect",
    "tissue.stepping.stages:StepStages._result",
    "tissue.stepping.energy_audit:Audit.energies",
)
"""Modules, and functions or methods in them."""


class Watches:
    """Times the parts of a frame, each without the parts inside it."""

    def __init__(self) -> None:
        self.spent: defaultdict[str, int] = defaultdict(int)
        """Time of each part in this frame so far [ns]."""
        self._inner = [0]

    def around(self, name: str, function: Callable[..., Any]) -> Callable[..., Any]:
        """Return the function, timed."""

        def timed(*arguments: Any, **keywords: Any) -> Any:
            self._inner.append(0)
            begin = perf_counter_ns()
            try:
                return function(*arguments, **keywords)
            finally:
                spent = perf_counter_ns() - begin
                self.spent[name] += spent - self._inner.pop()
                self._inner[-1] += spent

        return timed

    def attach(self) -> None:
        """Time all `PARTS`, where they still exist."""
        for part in PARTS:
            module, name = part.split(":")
            owner: Any = importlib.import_module(module)
            *path, last = name.split(".")
            for step in path:
                owner = getattr(owner, step)
            if hasattr(owner, last):
                setattr(owner, last, self.around(name, getattr(owner, last)))


def is_steady(before: Any, now: Any) -> bool:
    """Return whether the blade holds tissue and the mesh has not changed."""
    return now.anchored_length > 0.0 and now.n_tetrahedra == before.n_tetrahedra


def timed_frames(simulation: Simulation, n: int, watches: Watches) -> list[dict[str, int]]:
    """Return the times [ns] of the next steady frames, at most `n`, by part and in all."""
    rows: list[dict[str, int]] = []
    end = simulation.stroke.duration
    while len(rows) < n and simulation.time < end:
        before = simulation.result
        watches.spent.clear()
        begin = perf_counter_ns()
        simulation.step()
        whole = perf_counter_ns() - begin
        if is_steady(before, simulation.result):
            rows.append({**watches.spent, "whole frame": whole})
    return rows


def main() -> None:
    """Time and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--frames", type=int, default=2000)
    parser.add_argument("--audit", action="store_true")
    options = parser.parse_args()
    scene = changed(
        SCENES["grid2"],
        material=SCENES["organ"].material,
        blade=BladeShape(),
        audit=options.audit,
        speed=0.02,
    )
    watches = Watches()
    for title in ("without stopwatches", "with stopwatches"):
        simulation = prepare(scene)
        with no_garbage_collection():
            for _ in range(20):
                simulation.step()
            rows = timed_frames(simulation, options.frames, watches)
        print(f"{title}: {len(rows)} frames of {simulation.result.n_tetrahedra} tetrahedra")
        for name in rows[-1]:
            times = [row.get(name, 0) * 1e-3 for row in rows]
            low = sorted(times)[len(times) // 10]
            print(f"{median(times):8.1f} us (fastest tenth {low:6.1f})  {name}")
        watches.attach()


if __name__ == "__main__":
    main()
