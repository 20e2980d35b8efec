"""Runge-Kutta steps with an account of energy: the losses in damping and in contact."""

import numpy as np

from tissue.blade.forces import edge_energy
from tissue.contact.resolve import note_all_positions
from tissue.core.array_types import FloatArray
from tissue.elasticity.energy import body_energy, dissipated_power
from tissue.integrators.runge_kutta import runge_kutta_nystroem
from tissue.integrators.step_context import Increment
from tissue.integrators.step_end import resolve_contact, slip_blade
from tissue.integrators.system import System


class Audited:
    """All nodes together, as `runge_kutta_steps` moves them, with an account of energy.

    The loss in damping is integrated by Simpson's rule over each step, from the motion at its
    begin, middle and end: one order below the motion itself.
    """

    def __init__(self) -> None:
        self.damping = 0.0
        """Energy lost in viscosity and drag so far [J]."""
        self.contact = 0.0
        """Energy lost in contact so far [J]."""
        self._positions, self._velocities, self._scratch = np.zeros((3, 0, 3))
        self._power_now = 0.0

    def take_steps(self, system: System, increment: Increment, n: int) -> None:
        """Advance the motion by an increment in `n` Runge-Kutta steps."""
        body, contact = system.body, system.contact
        if len(self._positions) != len(body.positions):
            self._positions, self._velocities, self._scratch = (
                np.zeros_like(body.positions) for _ in range(3)
            )
        share = (increment.end - increment.begin) / n
        for i in range(n):
            at = increment.begin + i * share
            if contact.is_awake:
                note_all_positions(contact.arrays, body)
            if i == 0 or contact.is_awake:
                self._power_now = self._power_of(system, body.velocities)
            self._step(system, increment, at, share)
            self._resolve_contact(system, increment, share * increment.dt, at + share)
            slip_blade(system, increment, share * increment.dt, at + share)

    def _step(self, system: System, increment: Increment, at: float, share: float) -> None:
        body, stages = system.body, system.stages
        n, h = body.n_nodes, share * increment.dt
        self._positions[:n], self._velocities[:n] = body.positions[:n], body.velocities[:n]
        before = self._power_now
        runge_kutta_nystroem(system.context, increment.edge, increment.dt, at, share)
        after = self._power_of(system, body.velocities)
        # Simpson's rule for the displacement gives the velocity half-way, of 4th order as the rest.
        displacement = body.positions[:n] - self._positions[:n]
        ends = self._velocities[:n] + body.velocities[:n]
        self._velocities[:n] = 1.5 / h * displacement - 0.25 * ends
        middle = self._power_of(system, self._velocities, stages.positions)
        self.damping += h / 6.0 * (before + 4.0 * middle + after)
        self._power_now = after

    def _power_of(
        self, system: System, velocities: FloatArray, positions: FloatArray | None = None
    ) -> float:
        """Return the power lost in damping [W] at these velocities and at `positions`, or here."""
        body, elastic = system.body, system.elasticity.arrays
        at = body.positions if positions is None else positions
        return dissipated_power(body, elastic, system.surroundings, at, velocities, self._scratch)

    def _resolve_contact(
        self, system: System, increment: Increment, seconds: float, when: float
    ) -> None:
        if system.contact.is_awake:
            before = self._energy(system, increment, when)
            resolve_contact(system, seconds)
            self.contact += before - self._energy(system, increment, when)

    @staticmethod
    def _energy(system: System, increment: Increment, when: float) -> float:
        """Return the energy of the body and of the anchors [J]."""
        body, blade = system.body, system.interaction.state
        stored = body_energy(body, system.elasticity.arrays, system.surroundings.gravity)
        return stored + edge_energy(blade, body, increment.edge, when)
