"""The real-time factor of each scene that a machine can expect, from one number measured on it.

The number is the processor time of a frame of the organ's cut. What a simulated millisecond of each
scene costs, in such frames, is in `scene_costs.toml`. It depends little on the processor, since all
scenes do the same work in other shares (docs/performance.md has how little). `python -m benchmarks
scene-costs` measures the costs anew, and says which of them no longer hold.
"""

import math
import tomllib
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from scalpel_sim.preparation.prepare import prepare
from scalpel_sim.scene.checks import moves_together
from scalpel_sim.scene.read import SCENES
from scalpel_sim.scene.scene import Scene, changed
from scalpel_sim.simulation import Simulation, no_garbage_collection
from scalpel_sim.validate.speed.measurements import CPU
from tissue import MeshMeasures

COSTS_FILE = Path(__file__).parent / "scene_costs.toml"
"""Costs of the scenes; `python -m benchmarks scene-costs --write` writes it."""

REFERENCE_SCENE = "organ"
FIRST_FRAME = 300
"""Number of frames before those that count: the edge then is in the tissue."""
N_FRAMES = 100
N_REPEATS = 5
"""Number of times that the same frames are done again; the median counts."""

MILLISECOND = 1e-3

COST_OF_FRAME = 0.25
COST_OF_STEPS = 1.9e-4
"""Costs of a simulated millisecond of a cut, in frames of the reference: of any, and of each
tetrahedron and step that the body takes at rest. Fitted to the scenes, which keep within a factor
of two of it: how much a blade adds depends on the path."""


class ReferenceFrames:
    """Some frames of the organ's cut, which can be done again and again."""

    def __init__(self) -> None:
        self._simulation = prepare(as_run(SCENES[REFERENCE_SCENE]))
        self._simulation.run(FIRST_FRAME * self._simulation.dt)
        self._start = self._simulation.save_state()

    def seconds(self, n_repeats: int = N_REPEATS) -> float:
        """Return the processor time of a mean frame [s], the median of some repeats."""
        return float(np.median([self._repeat() for _ in range(n_repeats)]))

    def _repeat(self) -> float:
        self._simulation.load_state(self._start)
        return processor_time(self._simulation, N_FRAMES) / N_FRAMES


def as_run(scene: Scene) -> Scene:
    """Return a scene as `run` does it: with an account of the energy, where one can be kept."""
    return changed(scene, audit=moves_together(scene.solver.relaxation))


def processor_time(simulation: Simulation, n_frames: int) -> float:
    """Return the processor time of the next frames [s]."""
    with no_garbage_collection():
        start = CPU.now()
        for _ in range(n_frames):
            simulation.step()
        return CPU.now() - start


def scene_costs() -> dict[str, float]:
    """Return what a simulated millisecond of each scene costs, in frames of the reference."""
    costs: dict[str, float] = tomllib.loads(COSTS_FILE.read_text(encoding="utf-8"))["costs"]
    return costs


def expected_factors(reference: float, costs: Mapping[str, float]) -> dict[str, float]:
    """Return the real-time factor that each scene has with a core of its own.

    Args:
        reference: Processor time of a reference frame on this machine [s].
        costs: Of each scene, as `scene_costs` returns them.
    """
    return {scene: MILLISECOND / (cost * reference) for scene, cost in costs.items()}


def cost_of_body(measures: MeshMeasures) -> float:
    """Return what a millisecond of a cut costs about, in frames of the reference."""
    steps = math.ceil(MILLISECOND / measures.time_step)
    return COST_OF_FRAME + COST_OF_STEPS * measures.n_tetrahedra * steps


def factor_of_body(reference: float, measures: MeshMeasures) -> float:
    """Return the real-time factor to expect of a cut, within a factor of two.

    Args:
        reference: Processor time of a reference frame on this machine [s].
        measures: The body, before it is cut.
    """
    return MILLISECOND / (cost_of_body(measures) * reference)
