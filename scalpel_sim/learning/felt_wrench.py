"""`FeltWrench`: the wrench on the blade over a control step."""

import math

import mujoco
import numpy as np

from scalpel_sim.simulation import Simulation
from scalpel_sim.strokes.stroke import poses_of_edges
from tissue import FloatArray


class FeltWrench:
    """The wrench on the blade over the frames of a control step.

    Args:
        simulation: The simulation whose blade it is.
    """

    def __init__(self, simulation: Simulation) -> None:
        self._simulation = simulation
        self.begin()

    def begin(self) -> None:
        """Begin a control step."""
        self._total, self._n_frames = np.zeros(6), 0
        self.peak = 0.0
        """Largest force in it [N]."""

    def add(self) -> None:
        """Add the last frame."""
        simulation = self._simulation
        frame, result = simulation.frame, simulation.bridge.result
        edge, axes = frame.segment_to_tissue(simulation.blade.segment), np.empty(9)
        _, rotations, _ = poses_of_edges(edge.tip[None], edge.heel[None], edge.forward[None])
        mujoco.mju_quat2Mat(axes, rotations[0])
        to_tool = axes.reshape(3, 3).T @ frame.rotation.T
        numbers = np.array(simulation.blade.wrench.numbers[:6]).reshape(2, 3)
        self._total += np.concatenate([to_tool @ each for each in numbers])
        self._n_frames += 1
        if result is not None:
            sizes = (math.hypot(*each.numbers[:3]) for each in (result.wrench, result.wrench_t1))
            self.peak = max(self.peak, *sizes)

    @property
    def mean(self) -> FloatArray:
        """Mean force [N] and torque about the tip [N m], tool frame, shape (6,)."""
        return self._total / max(self._n_frames, 1)
