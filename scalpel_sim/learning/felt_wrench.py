"""`FeltWrench`: the wrench on the blade over a control step."""

import math

import numpy as np

from scalpel_sim.arm.hand import edge_rotation
from scalpel_sim.quaternions import matrix_of
from scalpel_sim.simulation import Simulation
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
        result = simulation.bridge.result
        axes = np.array(matrix_of(edge_rotation(simulation.blade.segment.numbers)))
        numbers = np.array(simulation.blade.wrench.numbers[:6])
        self._total += (numbers.reshape(2, 3) @ axes.reshape(3, 3)).ravel()
        self._n_frames += 1
        if result is not None:
            sizes = (math.hypot(*each.numbers[:3]) for each in (result.wrench, result.wrench_t1))
            self.peak = max(self.peak, *sizes)

    @property
    def mean(self) -> FloatArray:
        """Mean force [N] and torque about the tip [N m], tool frame, shape (6,)."""
        return self._total / max(self._n_frames, 1)
