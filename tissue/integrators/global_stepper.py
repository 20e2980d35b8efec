"""All nodes together: the two-level Runge-Kutta method, in as many steps as stability needs."""

import math

from tissue.blade.forces import frequency_with_tool
from tissue.core.array_types import IntArray
from tissue.elasticity.elasticity import Elasticity
from tissue.integrators.audited import Audited
from tissue.integrators.runge_kutta import relax
from tissue.integrators.stability import SAFETY, stable_step
from tissue.integrators.step_context import Motion
from tissue.integrators.threaded import Threads
from tissue.mesh.body import Body

STEPS_BETWEEN_LOOKS = 2
"""Runge-Kutta steps between two looks at how far tetrahedra are strained. A lip that snaps back, or
is pinched, is as much shorter within a frame of eight steps as an element is long."""


class GlobalStepper:
    """See `tissue.integrators.step_context.Relaxation`; it remembers nothing.

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

    def relax(self, motion: Motion) -> int:
        """Advance the motion; return the Runge-Kutta steps taken."""
        elasticity = motion.elasticity
        by_node = elasticity.arrays.frequency_squared
        near = frequency_with_tool(motion.tool, motion.body, by_node, motion.stages.external)
        done = 0
        while True:
            # The bound of the strained body is so wide of the truth that it needs no safety on top.
            strained = SAFETY**2 * elasticity.strained_frequency_squared(motion.body)
            highest = max(elasticity.frequency_squared, near, strained)
            step = stable_step(elasticity, highest, motion.surroundings)
            n = max(1, math.ceil(motion.span / step))
            if not elasticity.follows_strain or n <= STEPS_BETWEEN_LOOKS:
                self.relax_by(motion, n)
                return done + n
            share = STEPS_BETWEEN_LOOKS / n
            end = motion.begin + share * (motion.end - motion.begin)
            self.relax_by(motion._replace(end=end), STEPS_BETWEEN_LOOKS)
            motion = motion._replace(begin=end)
            done += STEPS_BETWEEN_LOOKS

    def relax_by(self, motion: Motion, n: int) -> None:
        """Advance the motion by `n` Runge-Kutta steps."""
        if self._stepper is not None:
            self._stepper.relax_by(motion, n)
            return
        done = 0
        while True:
            done = relax(
                motion.body,
                motion.elasticity.arrays,
                motion.tool,
                motion.edge,
                motion.visits,
                motion.stages,
                motion.contact.arrays,
                motion.queue,
                motion.surroundings,
                motion.reach,
                motion.dt,
                motion.begin,
                motion.end,
                done,
                n,
            )
            if done == n:
                return
            motion.contact.make_room()

    def mesh_changed(self, body: Body, elasticity: Elasticity, nodes: IntArray, n: int) -> None:
        """Nothing is remembered."""

    def body_moved(self, body: Body, elasticity: Elasticity) -> None:
        """Nothing is remembered."""

    def grow(self, n_nodes: int, n_tetrahedra: int) -> None:
        """Nothing is remembered."""
