"""Runge-Kutta steps that are watched: what damping takes, and what contact does to the energy."""

import numpy as np

from tissue.blade.anchors import anchors_energy
from tissue.contact.resolve import prepare
from tissue.core.array_types import FloatArray
from tissue.elasticity.energy import body_energy, dissipated_power
from tissue.integrators.runge_kutta import runge_kutta_nystroem
from tissue.integrators.step_context import Motion, give_way_after, set_right


class Audited:
    """All nodes together, as `tissue.integrators.runge_kutta.relax` moves them, with an account.

    What damping takes is integrated by Simpson's rule over each step, from the motion at its
    begin, middle and end: one order below the motion itself.
    """

    def __init__(self) -> None:
        self.damping = 0.0
        """What viscosity and drag took so far [J]."""
        self.contact = 0.0
        """What contact took so far [J]."""
        self._positions, self._velocities, self._scratch = np.zeros((3, 0, 3))
        self._power_now = 0.0

    def relax_by(self, motion: Motion, n: int) -> None:
        """Advance the motion by `n` Runge-Kutta steps."""
        if len(self._positions) != len(motion.body.positions):
            self._positions, self._velocities, self._scratch = (
                np.zeros_like(motion.body.positions) for _ in range(3)
            )
        share = (motion.end - motion.begin) / n
        for i in range(n):
            at = motion.begin + i * share
            if motion.contact.is_awake:
                prepare(motion.contact.arrays, motion.body)
            if i == 0 or motion.contact.is_awake:
                self._power_now = self._power_of(motion, motion.body.velocities)
            self._step(motion, at, share)
            self._set_right(motion, share * motion.dt, at + share)
            give_way_after(motion, share * motion.dt, at + share)

    def _step(self, motion: Motion, at: float, share: float) -> None:
        body, stages, elastic = motion.body, motion.stages, motion.elasticity.arrays
        n, h = body.n_nodes, share * motion.dt
        self._positions[:n], self._velocities[:n] = body.positions[:n], body.velocities[:n]
        before = self._power_now
        blade = (motion.tool, motion.edge, stages)
        runge_kutta_nystroem(body, elastic, *blade, motion.surroundings, motion.dt, at, share)
        after = self._power_of(motion, body.velocities)
        # Simpson's rule for the way gives the velocity half-way, of 4th order as the rest.
        way = body.positions[:n] - self._positions[:n]
        ends = self._velocities[:n] + body.velocities[:n]
        self._velocities[:n] = 1.5 / h * way - 0.25 * ends
        middle = self._power_of(motion, self._velocities, stages.positions)
        self.damping += h / 6.0 * (before + 4.0 * middle + after)
        self._power_now = after

    def _power_of(
        self, motion: Motion, velocities: FloatArray, positions: FloatArray | None = None
    ) -> float:
        """What damping takes at these velocities, where the nodes are or at `positions` [W]."""
        body, elastic = motion.body, motion.elasticity.arrays
        at = body.positions if positions is None else positions
        return dissipated_power(body, elastic, motion.surroundings, at, velocities, self._scratch)

    def _set_right(self, motion: Motion, seconds: float, when: float) -> None:
        if motion.contact.is_awake:
            before = self._energy(motion, when)
            set_right(motion, seconds)
            self.contact += before - self._energy(motion, when)

    @staticmethod
    def _energy(motion: Motion, when: float) -> float:
        """Of the body, and of what the edge holds [J]."""
        body, tool = motion.body, motion.tool
        stored = body_energy(body, motion.elasticity.arrays, motion.surroundings.gravity)
        return stored + anchors_energy(tool.anchors, body, motion.edge, when, tool.resistance)
