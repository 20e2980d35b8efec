"""The default integrator: all nodes together, in as many Runge-Kutta steps as stability needs."""

import math

from tissue.blade.forces import frequency_with_blade
from tissue.core.array_types import IntArray
from tissue.elasticity.elasticity import Elasticity
from tissue.integrators.audited import Audited
from tissue.integrators.runge_kutta import runge_kutta_steps
from tissue.integrators.stability import SAFETY, stable_step
from tissue.integrators.step_context import Increment
from tissue.integrators.system import System
from tissue.integrators.threaded import Threads
from tissue.mesh.body import Body

STEPS_BETWEEN_STRAIN_BOUNDS = 2
"""Runge-Kutta steps between two bounds on the frequencies of the strained body. A lip that snaps
back, or is pinched, is as much shorter within a frame of eight steps as an element is long."""


class GlobalStepper:
    """All nodes together, by the two-level Runge-Kutta method. An `Integrator` without memory.

    Args:
        threads: How many threads share the loops over the body.
        audited: What keeps an account of the energy, where one is wanted; by one thread.
    """

    moved = None
    moving = None

    def __init__(self, threads: int = 1, audited: Audited | None = None) -> None:
        self._stepper: Audited | Threads | None = audited
        if audited is None and threads > 1:
            self._stepper = Threads(threads)

    def advance(self, system: System, increment: Increment) -> int:
        """Advance the motion by an increment; return the Runge-Kutta steps taken."""
        elasticity, blade = system.elasticity, system.interaction.state
        by_node = elasticity.arrays.frequency_squared
        near = frequency_with_blade(blade, system.body, by_node, system.stages.external)
        done = 0
        while True:
            # The bound of the strained body is so wide of the truth that it needs no safety on top.
            strained = SAFETY**2 * elasticity.strained_frequency_squared(system.body)
            highest = max(elasticity.frequency_squared, near, strained)
            step = stable_step(elasticity, highest, system.surroundings)
            n = max(1, math.ceil(increment.span / step))
            if not elasticity.follows_strain or n <= STEPS_BETWEEN_STRAIN_BOUNDS:
                self.take_steps(system, increment, n)
                return done + n
            share = STEPS_BETWEEN_STRAIN_BOUNDS / n
            end = increment.begin + share * (increment.end - increment.begin)
            self.take_steps(system, increment._replace(end=end), STEPS_BETWEEN_STRAIN_BOUNDS)
            increment = increment._replace(begin=end)
            done += STEPS_BETWEEN_STRAIN_BOUNDS

    def take_steps(self, system: System, increment: Increment, n: int) -> None:
        """Advance the motion by an increment in `n` Runge-Kutta steps."""
        if self._stepper is not None:
            self._stepper.take_steps(system, increment, n)
            return
        done = 0
        while True:
            done = runge_kutta_steps(system.context, *increment, done, n)
            if done == n:
                return
            system.contact.make_room()

    def mesh_changed(self, body: Body, elasticity: Elasticity, nodes: IntArray) -> None:
        """Do nothing: no step depends on the one before."""

    def body_moved(self, body: Body, elasticity: Elasticity) -> None:
        """Do nothing: no step depends on the one before."""

    def grow(self, n_nodes: int, n_tetrahedra: int) -> None:
        """Do nothing: there are no arrays."""
